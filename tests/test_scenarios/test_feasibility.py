"""What the feasibility search proves, against worlds worked out by hand, robots driven at random and real commands."""

import math
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import jax
import numpy as np
import pytest

from adwa_jax import paper
from adwa_jax.obstacles import movers_at
from adwa_jax.scenario import UnknownSquares
from scenarios import feasibility as module
from scenarios.errors import InputError
from scenarios.feasibility import HEADINGS, Feasibility, arrival, feasibility, label
from scenarios.generators import toy
from scenarios.generators.assembly import walkers_of
from scenarios.padding import PaddedShape, pad, stack
from scenarios.suite import make_suite
from tuning.evaluate import evaluate

ROBOT = paper().constants.robot  # radius 0.25 m, 1 m/s, 2 m/s²
DT = 0.1
KEY = jax.random.key(0)
CORRIDOR = "S.........G"
TURN, FIRST, START = 7, 23, 2  # control steps: of a turn by 45°, by 180°, and of the wait before and after a way


def drawn(drawing, seconds=30.0, **spec):
    return toy.generate(KEY, toy.ToySpec(drawing=drawing, time_limit=seconds, **spec))


def with_walkers(scenario, *tracks, radius=0.4):
    return replace(scenario, movers=walkers_of([radius] * len(tracks), [np.array(track) for track in tracks],
                                               [0.0] * len(tracks)))  # fmt: skip


def one_square(x, y, half_width, rounding):
    return UnknownSquares(np.array([[x, y]], np.float32), np.array([half_width], np.float32),
                          np.array([rounding], np.float32), np.array([True]))  # fmt: skip


def test_arrival_along_a_straight_way():
    times = arrival(drawn("...........\nS.........G\n..........."), ROBOT)
    assert times.soonest == pytest.approx(9.6)  # 10 m less the goal's 0.4 m
    assert times.assured == pytest.approx(DT * (FIRST + START + 97 + START))  # to stand within, not on the edge


def test_arrival_along_a_diagonal_is_a_little_early():
    rows = [["."] * 12 for _ in range(12)]
    rows[0][11], rows[11][0] = "G", "S"
    soonest = arrival(drawn("\n".join(map("".join, rows))), ROBOT).soonest
    true = 11 * math.sqrt(2) - 0.4
    stretches = true // (module.STRETCH * DT) * module.STRETCH * DT
    assert 0.93 * stretches + (true - stretches) / math.sqrt(2) - DT < soonest < true + DT


def test_pace_of_the_paper_robot():
    pace = module._pace(ROBOT, DT)
    assert (pace.turn, pace.first, pace.start) == (TURN, FIRST, START)
    assert pace.lead == pytest.approx(0.02 + 0.04)


def test_arrival_at_the_goal_from_the_start():
    times = arrival(drawn("SG", goal_tolerance=1.5), ROBOT)
    assert times == (pytest.approx(DT), pytest.approx(DT * FIRST))


def test_a_faster_robot_arrives_earlier():
    scenario = drawn(CORRIDOR)
    assert arrival(scenario, replace(ROBOT, v_max=2.0)).soonest == pytest.approx(4.8)
    assert arrival(scenario, replace(ROBOT, v_min=-2.0)).soonest == pytest.approx(4.8)


@pytest.mark.parametrize(("drawing", "expected"), [
    ("S.........G", Feasibility.POSSIBLE),
    ("S....#....G", Feasibility.IMPOSSIBLE),
    ("S....#....G\n...........", Feasibility.POSSIBLE),
    ("..#..\nS.#.G\n..#..", Feasibility.IMPOSSIBLE),
    (".#...\nS#.#G\n...#.", Feasibility.POSSIBLE),
    ("S#.\n.#.\n##.\n..G", Feasibility.IMPOSSIBLE),  # cells that meet at a corner leave no gap
])  # fmt: skip
def test_walls(drawing, expected):
    assert feasibility(drawn(drawing), ROBOT) == expected


@pytest.mark.parametrize(("resolution", "expected"), [
    (0.4, Feasibility.IMPOSSIBLE),  # the robot is 0.5 m wide
    (0.44, Feasibility.IMPOSSIBLE),
    (0.51, Feasibility.UNKNOWN),
    (0.8, Feasibility.POSSIBLE),
])  # fmt: skip
def test_corridor_of_one_cell(resolution, expected):
    assert feasibility(drawn(CORRIDOR, resolution=resolution, robot_radius=0.2), ROBOT) == expected


def test_hidden_cells_and_unknown_squares_count():
    free = drawn("S.........G")
    hidden = np.zeros(free.grid.occupied.shape, bool)
    hidden[0, 5] = True
    assert feasibility(replace(free, hidden=hidden), ROBOT) == Feasibility.IMPOSSIBLE
    for y, half_width, rounding, expected in [
        (0.5, 0.3, 0.0, Feasibility.IMPOSSIBLE), (0.5, 0.0, 0.3, Feasibility.IMPOSSIBLE),
        (0.5, 0.1, 0.2, Feasibility.IMPOSSIBLE), (0.9, 0.1, 0.0, Feasibility.POSSIBLE),
        (0.9, 0.0, 0.1, Feasibility.POSSIBLE), (0.9, 0.05, 0.05, Feasibility.POSSIBLE),
    ]:  # fmt: skip
        square = one_square(5.5, y, half_width, rounding)
        assert feasibility(replace(free, squares=square), ROBOT) == expected
        absent = replace(square, valid=np.array([False]))
        assert feasibility(replace(free, squares=absent), ROBOT) == Feasibility.POSSIBLE


def test_a_mover_that_stands_in_a_corridor_forever():
    spec = {"mover_speed": (0.0, 0.0), "mover_radius": (0.3, 0.3)}
    assert feasibility(drawn("S....>....G", **spec), ROBOT) == Feasibility.IMPOSSIBLE
    assert feasibility(drawn("...........\nS....>....G", **spec), ROBOT) == Feasibility.POSSIBLE


def test_a_mover_that_sweeps_a_dead_end():
    """It comes upon the robot, moving or standing, before the goal's disc can be reached."""
    swept = drawn("S........<...G", mover_radius=(0.4, 0.4))
    assert arrival(swept, ROBOT) == (math.inf, math.inf)
    niche = drawn("S........<...G\n##.###########\n##.###########", mover_radius=(0.4, 0.4))
    assert feasibility(niche, ROBOT) == Feasibility.POSSIBLE  # lets it pass


def test_a_mover_that_leaves_in_time():
    blocked = with_walkers(drawn(CORRIDOR), [[0.0, 5.5, 0.5], [15.0, 5.6, 0.5]])
    times = arrival(blocked, ROBOT)
    # From 15.1 s on, 0.65 m before the mover, which is 4.9 m from the start: 10 m to go, less 4.35 m and 0.4 m.
    assert times.soonest == pytest.approx(15.1 + 5.1, abs=0.2)
    assert math.isfinite(times.assured)
    assert feasibility(replace(blocked, time_limit=np.float32(19.5)), ROBOT) == Feasibility.IMPOSSIBLE


def test_the_time_limit():
    for seconds, expected in [(9.5, Feasibility.IMPOSSIBLE), (9.6, Feasibility.UNKNOWN), (12.3, Feasibility.UNKNOWN),
                              (12.4, Feasibility.POSSIBLE)]:
        assert feasibility(drawn(CORRIDOR, seconds), ROBOT) == expected, seconds


def points_of(bits, lattice):
    """[Y, X] bool, of a set."""
    rows = [bits >> row * lattice.stride for row in range(len(lattice.y))]
    return np.array([[row >> column & 1 for column in range(len(lattice.x))] for row in rows], bool)


def test_cells_within_a_disc_are_those_of_every_pair():
    lattice = module._lattice(drawn("....\n.S.G\n....\n...."), 0.1)
    stride, steps = lattice.stride, 5
    origin = (17, 12)
    disc = points_of(module._within_disc(1 << lattice.index(*origin), steps, stride), lattice)
    rows, columns = np.indices(disc.shape)
    across, along = np.abs(rows - origin[0]), np.abs(columns - origin[1])
    expected = np.maximum(across - 1, 0) ** 2 + np.maximum(along - 1, 0) ** 2 <= steps**2
    expected &= (across <= steps) & (along <= steps)
    np.testing.assert_array_equal(disc, expected)


def clearance(scenario, x, y, step):
    """The robot's least clearance [m] at points [n] after control steps [n], from every square and mover in turn."""
    grid, squares, movers = jax.tree.map(np.asarray, (scenario.grid, scenario.squares, scenario.movers))
    occupied = np.pad(grid.occupied, 1, constant_values=True)
    least = np.full(x.shape, np.inf)
    for row, column in np.argwhere(occupied) - 1.0:
        low = grid.origin + np.array([column, row]) * grid.resolution
        least = np.minimum(least, to_box(x, y, low, low + grid.resolution))
    for centre, half, rounding in zip(squares.centre, squares.half_width, squares.rounding, strict=True):
        least = np.minimum(least, to_box(x, y, centre - half, centre + half) - rounding)
    states = jax.vmap(partial(movers_at, scenario.movers))(step.astype(np.float32) * np.float32(DT))
    apart = np.hypot(x[:, None] - states.position[..., 0], y[:, None] - states.position[..., 1]) - movers.radius
    return np.minimum(least, np.where(states.present, apart, np.inf).min(axis=1, initial=np.inf)) - ROBOT.radius


def to_box(x, y, low, high):
    """Distance [m] to the rectangle between two corners."""
    return np.hypot(np.maximum(np.maximum(low[0] - x, x - high[0]), 0),
                    np.maximum(np.maximum(low[1] - y, y - high[1]), 0))  # fmt: skip


# A thicket: unknown squares and movers among walls.
THICKET = """
......#....G
.#.>..#.o...
...o....##.<
.##..v......
S.....#..^..
"""


@pytest.fixture(scope="module")
def thicket():
    return drawn(THICKET, mover_speed=(0.9, 0.9), mover_radius=(0.35, 0.35))


def optimistic_sets(scenario):
    lattice = module._lattice(scenario, ROBOT.v_max * DT + module._slack(scenario))
    moving = module._mover_ways(scenario, DT)
    free = module._free_sets(scenario, lattice, moving, ROBOT.radius, ROBOT.radius, lattice.spacing / 2)
    return lattice, module._reachable(free, lattice)


def test_robots_driven_at_random_stay_within_the_optimistic_set(thicket):
    """Half of them at top speed; those in contact give their place to others, half to some far on their way."""
    lattice, sets = optimistic_sets(thicket)
    random = np.random.default_rng(0)
    place = np.repeat(np.asarray(thicket.start, float)[None, :2], 2000, axis=0)
    heading = random.uniform(0, 2 * np.pi, len(place))
    for step, reached in zip(range(1, 200), sets, strict=False):
        way = DT * ROBOT.v_max * np.minimum(random.uniform(0, 2, len(place)), 1)
        place = place + way[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
        alive = np.flatnonzero(clearance(thicket, *place.T, np.full(len(place), step)) >= 0)
        cells = np.round((place[alive] - [lattice.x[0], lattice.y[0]]) / lattice.spacing).astype(int)
        assert points_of(reached, lattice)[cells[:, 1], cells[:, 0]].all(), step
        order = alive[np.argsort(place[alive].sum(axis=1))]
        later = random.choice(order[-200:], (len(place) - len(order)) // 2)
        chosen = np.concatenate([order, later, random.choice(order, len(place) - len(order) - len(later))])
        turned = random.choice([0.0, 0.3, 1.5, 3.0], len(place), p=[0.8, 0.1, 0.08, 0.02])
        heading = heading[chosen] + turned * random.choice([-1.0, 1.0], len(place))
        place = place[chosen]
    goal = np.asarray(thicket.goal)
    assert np.hypot(*(place - goal).T).min() < 1  # some came far


def history(scenario):
    """Everything the conservative search was through."""
    lattice, pace, free_sets = module._conservative(scenario, ROBOT, DT, module._mover_ways(scenario, DT))
    return lattice, pace, list(module._driven(free_sets, lattice, pace))


def test_a_turn_needs_a_clear_point_throughout():
    """What is in contact at one instant of a turn, or of a wait before a way, is lost."""
    lattice = module._lattice(drawn(CORRIDOR), 0.1)
    point = 1 << lattice.index(*lattice.start)
    free_sets = [point] * (FIRST + 2) + [0] + [point] * 20
    driven = list(module._driven(iter(free_sets), lattice, module._pace(ROBOT, DT)))
    assert driven[FIRST - 1].standing == [point] * 8
    assert not any(any(driving.rolling + driving.standing) for driving in driven[FIRST + 2 :])


class Way(NamedTuple):
    """A leg of a drive: a turn to a heading or `hops` along it, in so many control steps."""

    kind: str
    heading: int
    hops: int
    steps: int


def legs(scenario):
    """How the conservative robot gets to the goal, from the sets backwards; and lattice and pace."""
    lattice, pace, past = history(scenario)
    within = module._bits(module._near(lattice, tuple(map(float, scenario.goal)), 0.39), lattice)
    step = next(step for step, driving in enumerate(past, 1) if any(bits & within for bits in driving.standing))
    heading = next(heading for heading in range(8) if past[step - 1].standing[heading] & within)
    point = (past[step - 1].standing[heading] & within).bit_length() - 1

    def holds(sets, heading, ago):
        """Whether the point was in the set some steps ago, and clear since."""
        still = all(past[step - 1 - back].free >> point & 1 for back in range(ago))
        return step > ago and still and getattr(past[step - 1 - ago], sets)[heading] >> point & 1

    found = []
    while step > pace.first:
        if holds("standing", heading, 1):
            found.append(Way("wait", heading, 0, 1))
            step -= 1
        elif holds("rolling", heading, pace.start):
            hops, begin, step = 0, step, step - pace.start
            row, column = HEADINGS[heading]
            while not holds("standing", heading, pace.start):
                hops, step = hops + 1, step - (1 + heading % 2)
                point -= row * lattice.stride + column
            step -= pace.start
            found.append(Way("straight", heading, hops, begin - step))
        else:
            before = next(other % 8 for other in (heading - 1, heading + 1) if holds("standing", other % 8, pace.turn))
            found.append(Way("turn", heading, 0, pace.turn))
            heading, step = before, step - pace.turn
    assert point == lattice.index(*lattice.start)
    return [Way("turn", heading, 0, pace.first), *reversed(found)], lattice


def profile(total, steps, top, gain):
    """Values of `steps` control steps that sum up to total: no larger than top, rising and falling by at most gain."""

    def shape(gain):
        rising = np.arange(1, steps + 1) * gain
        return np.minimum(np.minimum(rising, rising[::-1]), top)

    low, high = 0.0, gain
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if shape(middle).sum() > total else (middle, high)
    assert shape(high).sum() == pytest.approx(total, abs=1e-9)
    return shape(high)


def commands(scenario):
    """[T, 2] speed [m/s] and yaw rate [rad/s], from the start facing along x."""
    ways, lattice = legs(scenario)
    speed, yaw_rate, facing = [], [], 0.0
    for way in ways:
        length = way.hops * lattice.spacing * (math.sqrt(2) if way.heading % 2 else 1.0)
        speed.append(profile(length / DT, way.steps, ROBOT.v_max, ROBOT.acceleration * DT))
        turn = (way.heading * math.pi / 4 - facing + math.pi) % (2 * math.pi) - math.pi
        turned = profile(abs(turn) / DT, way.steps, ROBOT.yaw_rate_max, ROBOT.yaw_acceleration * DT)
        yaw_rate.append(math.copysign(1.0, turn) * turned)
        facing = way.heading * math.pi / 4
    return np.stack([np.concatenate(speed), np.concatenate(yaw_rate)], axis=1)


def test_commands_of_a_possible_scenario_drive_the_robot_to_its_goal(thicket):
    """Within the limits of speed, yaw rate and acceleration, clear at each control step, by eq. 7."""
    for scenario in (thicket, *make_suite("paper-15", seed=2, count=2).scenarios):
        v, yaw_rate = commands(scenario).T
        assert len(v) * DT == pytest.approx(arrival(scenario, ROBOT).assured)
        assert v.min() >= 0
        assert v.max() <= ROBOT.v_max
        assert np.abs(yaw_rate).max() <= ROBOT.yaw_rate_max
        assert np.abs(np.diff(v, prepend=0)).max() <= ROBOT.acceleration * DT + 1e-9
        assert np.abs(np.diff(yaw_rate, prepend=0)).max() <= ROBOT.yaw_acceleration * DT + 1e-9
        heading = np.cumsum(np.concatenate([[0.0], yaw_rate[:-1]])) * DT
        x = scenario.start[0] + np.cumsum(v * np.cos(heading)) * DT
        y = scenario.start[1] + np.cumsum(v * np.sin(heading)) * DT
        assert clearance(scenario, x, y, np.arange(1, len(v) + 1)).min() >= 0.9 * module.MARGIN
        assert np.hypot(x[-1] - scenario.goal[0], y[-1] - scenario.goal[1]) <= scenario.goal_tolerance


def test_what_the_planner_reaches_is_not_impossible():
    suite = make_suite("paper-15", seed=5, count=32)
    results = evaluate(suite, paper())
    times = np.array([arrival(scenario, ROBOT) for scenario in suite.scenarios])
    assert results.reached.sum() > 10
    assert (times[results.reached, 0] <= results.measures["time"][results.reached] + 1e-4).all()


def test_labels_are_in_order_and_padding_changes_none():
    scenarios = [drawn(drawing) for drawing in ("S....#....G", CORRIDOR, "S....#....G\n...........", "S..v......G")]
    seen = []
    labels = label(scenarios, ROBOT, progress=lambda done, total: seen.append((done, total)))
    assert labels.tolist() == [feasibility(scenario, ROBOT) for scenario in scenarios]
    assert seen == [(1, 4), (2, 4), (3, 4), (4, 4)]
    padded = [pad(scenario, PaddedShape(16, 24, 8, 8, 0)) for scenario in scenarios]
    assert label(padded, ROBOT).tolist() == labels.tolist()
    assert label([], ROBOT).shape == (0,)


def test_refusals():
    scenario = drawn(CORRIDOR)
    nan = np.array([np.nan, 0.5], np.float32)
    for bad, robot, dt, words in [
        (stack([scenario, scenario]), ROBOT, DT, "take them out of the batch"),
        (scenario, replace(ROBOT, disc_offsets=(-0.1, 0.1)), DT, "must be one"),
        (scenario, ROBOT, 0.0, "dt: 0.0"),
        (replace(scenario, goal=nan), ROBOT, DT, "finite"),
        (scenario, replace(ROBOT, v_max=1e-4), DT, "at most"),
        (replace(scenario, start=np.array([-1.0, 0.5, 0.0], np.float32)), ROBOT, DT, "on the map"),
    ]:
        with pytest.raises(InputError, match=words):
            arrival(bad, robot, dt)
