"""The closed loop under the rules beyond the paper: hidden cells, new routes, long robots, lanes side by side."""

import math
from dataclasses import replace

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from adwa_jax.episode import Outcome
from adwa_jax.footprint import covering_discs
from adwa_jax.grid import distance_field
from adwa_jax.judge import clearances
from adwa_jax.lanes import drive_lanes, trace
from adwa_jax.learn import first_memory, in_range
from adwa_jax.plan import plan
from adwa_jax.presets import extended, preset
from adwa_jax.rollout import RobotState
from adwa_jax.rules import Rules
from adwa_jax.simulate import control_step, drive, start_episode
from scenarios.generators.paper import PaperSpec, generate
from scenarios.hiding import hide
from scenarios.padding import PaddedShape, pad, stack
from tests.reference import distance as distance_reference
from tests.reference import route as route_reference
from tests.reference.dwa import square_distance
from tests.test_adwa_jax.worlds import CAPACITY, SHAPE, drawn, plan_by_hand, random_map, scenario

EXTENDED = extended()
DT = EXTENDED.constants.behaviour.dt
STEPS = 250  # rows kept of a trace; every time limit here is shorter
ROOM = np.zeros(SHAPE, bool)
NOTHING_HIDDEN = ROOM


def task(occupied=ROOM, start=(1.5, 6.5), goal=(10.5, 6.5), hidden=NOTHING_HIDDEN, **more):
    """Every task here has room for hidden cells, so that one compiled program serves all."""
    return scenario(occupied, start, goal, hidden=hidden, **more)


planned = jax.jit(plan, static_argnames="options")
alone = jax.jit(drive, static_argnames="options")
side_by_side = jax.jit(drive_lanes, static_argnames="options")
follow = jax.jit(trace, static_argnames=("options", "steps"))


def plan_of(world, constants, options):
    return planned(world.grid, world.start[:2], world.goal, constants, options=options.plan)


def traced(world, constants=EXTENDED.constants):
    """Outcome, episode and path of an extended robot."""
    options = EXTENDED.options
    known = plan_of(world, constants, options)
    episode, path = jax.device_get(follow(world, known, constants, options=options, steps=STEPS))
    return Outcome(int(episode.outcome)), episode, path


def drive_all(worlds):
    """Episodes of extended robots side by side."""
    plans = [plan_of(world, *EXTENDED) for world in worlds]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *plans)
    return jax.device_get(side_by_side(stack(worlds), stacked, EXTENDED.constants, options=EXTENDED.options))


def sensing(sensor_range):
    constants = EXTENDED.constants
    return replace(constants, behaviour=replace(constants.behaviour, sensor_range=sensor_range))


def positions(world, path):
    """[T + 1, 2]: the start and the place after every step."""
    length = int(path.length)
    return np.concatenate([np.asarray(world.start)[None, :2], np.stack([path.robot.x, path.robot.y], 1)[:length]])


def cells(*pairs):
    found = np.zeros(SHAPE, bool)
    for row, column in pairs:
        found[row, column] = True
    return found


BARRIER = cells(*[(row, 6) for row in range(3, 10)])
MOVERS = ((9.0, 9.0, -0.3, -0.4, 0.3), (4.0, 8.0, 0.5, 0.1, 0.2))
UNEQUAL = [
    task(),
    task(hidden=BARRIER),
    task(drawn(*["............"] * 5, "#########...", *["............"] * 6), (1.5, 1.5), (1.5, 9.5),
         squares=[(10.5, 5.5, 0.6)], movers=MOVERS),
    task(drawn(".#."), (0.5, 0.5), (2.5, 0.5)),
    task(squares=[(6.0, 6.5, 1.2)], movers=MOVERS[:1]),
    task(time_limit=0.5),
    task(random_map(4, (9, 9), 0.15), (0.5, 0.5), (8.5, 8.5), hidden=random_map(5, (9, 9), 0.1), movers=MOVERS),
]  # fmt: skip


@pytest.fixture(scope="module")
def lanes():
    """Every unequal task driven side by side."""
    return drive_all(UNEQUAL)


@pytest.mark.parametrize("index", range(len(UNEQUAL)))
def test_lane_equals_the_same_scenario_driven_alone_in_every_bit(lanes, index):
    world, (constants, options) = UNEQUAL[index], EXTENDED
    episode = jax.device_get(alone(world, plan_of(world, constants, options), constants, options=options))
    chex.assert_trees_all_equal(jax.tree.map(lambda leaf: leaf[index], lanes), episode)


def test_lanes_end_at_different_times_and_learn_different_things(lanes):
    assert len(set(lanes.measures.time.tolist())) >= 5
    assert len(set(lanes.replans.tolist())) >= 2
    assert {Outcome.REACHED, Outcome.NO_PATH, Outcome.TIMEOUT} <= set(map(Outcome, lanes.outcome.tolist()))


def test_lanes_do_not_depend_on_their_neighbours(lanes):
    turned = drive_all(UNEQUAL[::-1])
    chex.assert_trees_all_equal(jax.tree.map(lambda leaf: leaf[::-1], turned), lanes)


@pytest.mark.parametrize("index", range(len(UNEQUAL)))
def test_trace_tells_the_story_of_the_drive(lanes, index):
    _, episode, path = traced(UNEQUAL[index])
    chex.assert_trees_all_close(episode, jax.tree.map(lambda leaf: leaf[index], lanes), atol=1e-4)
    assert int(path.length) == round(float(episode.measures.time) / DT)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(path))
    x, length = np.concatenate([UNEQUAL[index].start[:1], path.robot.x]), int(path.length)
    np.testing.assert_array_equal(x[length:], np.full(STEPS + 1 - length, x[length]))  # it stays where it ended


def test_robot_obeys_its_limits_in_every_step():
    robot = EXTENDED.constants.robot
    for world in UNEQUAL[1:3]:
        _, _, path = traced(world)
        length = int(path.length)
        v, yaw_rate = (np.concatenate([[0.0], part[:length]]) for part in (path.robot.v, path.robot.yaw_rate))
        assert robot.v_min - 1e-6 <= v.min()
        assert v.max() <= robot.v_max + 1e-6
        assert abs(yaw_rate).max() <= robot.yaw_rate_max + 1e-6
        assert abs(np.diff(v)).max() <= robot.acceleration * DT + 1e-5
        assert abs(np.diff(yaw_rate)).max() <= robot.yaw_acceleration * DT + 1e-5


# Hidden cells.


def seen_along(world, places, sensor_range):
    """Hidden cells within range of any of these places."""
    seen = np.zeros(SHAPE, bool)
    for place in places:
        seen |= np.asarray(in_range(world, jnp.float32(place), jnp.float32(sensor_range)))
    return seen


def test_robot_without_a_map_has_seen_what_was_in_range_and_nothing_else():
    hidden = cells((2, 2), (6, 6), (7, 6), (9, 3), (11, 11), (4, 9))
    world = task(hidden=hidden)
    _, _, path = traced(world, sensing(2.0))
    seen = seen_along(world, positions(world, path), 2.0)
    # What comes into range with the last step may be left for a step that is not made.
    before = seen_along(world, positions(world, path)[:-1], 2.0)
    assert (before <= path.seen).all()
    assert (path.seen <= seen).all()
    assert path.seen.sum() >= 2
    assert not path.seen[11, 11]


def test_hidden_wall_is_driven_round_on_a_new_route():
    outcome, episode, path = traced(task(hidden=BARRIER))
    assert outcome is Outcome.REACHED
    assert int(episode.replans) >= 1
    assert path.seen[6, 6]
    assert float(episode.measures.least_clearance) > 0
    # Straight ahead it is 9 m; the last route goes past an end of the wall.
    assert float(episode.measures.length) > 10
    points = path.route.points[: int(path.route.count)]
    np.testing.assert_allclose(points[-1], (10.5, 6.5), rtol=1e-6)


def test_unseen_hidden_cell_is_hit_unknowingly():
    # Its side is at x = 6: the outline, 0.25 m ahead of the centre, gets there at 5.75.
    outcome, episode, path = traced(task(hidden=cells((6, 6))), sensing(0.0))
    assert outcome is Outcome.HIT_UNKNOWN
    x = float(path.robot.x[int(path.length) - 1])
    assert 5.75 < x <= 5.85 + 1e-3
    assert float(episode.measures.least_clearance) == pytest.approx(5.75 - x, abs=1e-3)


def test_hidden_cell_beside_the_way_is_passed_however_near_if_it_is_not_touched():
    # Its side is at y = 7: 0.01 m from the outline of a robot that drives along y = 6.74, which cannot turn.
    robot = replace(EXTENDED.constants.robot, yaw_rate_max=1e-6)
    for y, expected in ((6.74, Outcome.REACHED), (6.76, Outcome.HIT_UNKNOWN)):
        world = task(start=(1.5, y), goal=(10.5, y), hidden=cells((7, 6)), heading=0.0)
        outcome, _, path = traced(world, replace(sensing(0.0), robot=robot))
        assert outcome is expected, y
        np.testing.assert_allclose(path.robot.y, y, atol=1e-4)


def test_robot_that_stands_next_to_a_hidden_cell_it_sees_has_not_hit_it():
    # 0.01 m away: nearer than the distance field, which it now holds, can tell.
    world = task(start=(4.74, 6.5), goal=(2.5, 6.5), hidden=cells((6, 5)), heading=math.pi)
    outcome, episode, path = traced(world)
    assert path.seen[6, 5]
    assert outcome is Outcome.REACHED
    assert 0 < float(episode.measures.least_clearance) < 0.06  # after a step away from it


# New routes.


def test_square_across_the_way_is_rounded_on_a_new_route():
    world = task(drawn(*["............"] * 3, *["######......"] * 2, *["............"] * 7), squares=[(6.0, 6.5, 1.4)])
    outcome, episode, path = traced(world, sensing(2.0))
    assert outcome is Outcome.REACHED
    assert int(episode.replans) >= 1
    steps = positions(world, path)
    clear = min(square_distance(x, y, (6.0, 6.5), 1.4) for x, y in steps)
    assert clear > 0.25


def test_robot_that_does_not_get_away_looks_for_another_route_before_it_counts_as_stuck():
    crawling = replace(EXTENDED.constants, robot=replace(EXTENDED.constants.robot, v_max=5e-4, v_min=0.0))
    outcome, episode, _ = traced(task(), crawling)
    assert outcome is Outcome.STUCK
    assert float(episode.measures.time) == pytest.approx(15.0)
    assert int(episode.replans) == 2  # after 5 s and 10 s; after 15 s it is over


def test_goal_in_the_robots_own_cell_is_reached():
    outcome, episode, _ = traced(task(start=(6.05, 6.1), goal=(6.9, 6.8)))
    assert outcome is Outcome.REACHED
    assert float(episode.measures.length) < 1.5


def test_target_never_runs_ahead_of_the_route_by_more_than_the_lookahead():
    for world in UNEQUAL[:3]:
        _, episode, path = traced(world)
        if int(episode.replans):
            continue  # the trace holds only the last route
        route = path.route.points[: int(path.route.count)].astype(float).tolist()
        for place, target in zip(positions(world, path), path.target[: int(path.length)], strict=False):
            here = min(route_reference.feet(route, *map(float, place)))[1]
            away = min(route_reference.feet(route, *map(float, target)))
            assert away[0] < 1e-3
            assert away[1] - here <= EXTENDED.constants.behaviour.lookahead + 0.05


# What the robot hits.

def without_movers(index):
    """A map like the paper's with squares on it; every other one shows the robot nothing beforehand."""
    key = jax.random.fold_in(jax.random.key(11, impl="threefry2x32"), index)
    spec = PaperSpec(cells=SHAPE[0], movers=0, squares=CAPACITY, square_distance=2.0, time_limit=60.0,
                     density=(0.1, 0.2, 0.3)[index % 3])  # fmt: skip
    world = generate(key, spec)
    return pad(hide(world) if index % 2 else world, PaddedShape(*SHAPE, CAPACITY, CAPACITY, 0, hidden=True))


def test_nothing_that_stands_is_ever_hit():
    outcomes, replans = [], 0
    for first in range(0, 10 * len(UNEQUAL), len(UNEQUAL)):  # in lanes as above, for the same compiled program
        episodes = drive_all([without_movers(first + lane) for lane in range(len(UNEQUAL))])
        assert episodes.measures.least_clearance.min() > 0
        outcomes += map(Outcome, episodes.outcome.tolist())
        replans += episodes.replans.sum()
    assert not {Outcome.HIT_KNOWN, Outcome.HIT_UNKNOWN, Outcome.HIT_MOVER} & set(outcomes)
    assert outcomes.count(Outcome.REACHED) > 0.9 * len(outcomes)
    assert replans > 10


LENGTH, WIDTH = 0.8, 0.3
ROD_RADIUS, ROD_OFFSETS = covering_discs(LENGTH, WIDTH, 3)


ROD = replace(EXTENDED.constants.robot, radius=ROD_RADIUS, disc_offsets=ROD_OFFSETS)


started = jax.jit(start_episode)
judged = jax.jit(clearances, static_argnames="options")


def clearances_of(world, x, y, heading):
    """To known squares, to what is unknown, to movers, of a long robot placed there."""
    known = plan_of(world, *EXTENDED)
    state = started(world, known)._replace(robot=RobotState(*map(jnp.float32, (x, y, heading, 0.0, 0.0))))
    return judged(state, world, known.field, replace(EXTENDED.constants, robot=ROD), options=EXTENDED.options)


@pytest.mark.parametrize("heading", [0.0, 0.6, math.pi / 2, -2.0])
def test_every_disc_is_judged_for_contact(heading):
    occupied = cells((5, 8), (9, 4))
    world = task(occupied, hidden=cells((7, 5)), squares=[(4.0, 4.0, 0.4)], movers=[(7.2, 7.6, 0.0, 0.0, 0.3)])
    for x, y in ((6.5, 6.5), (7.3, 5.6), (5.4, 6.2)):
        found = clearances_of(world, x, y, heading)
        centres = [(x + offset * math.cos(heading), y + offset * math.sin(heading)) for offset in ROD_OFFSETS]
        known = min(distance_reference.distance(occupied, *centre) for centre in centres)
        unknown = min(min(square_distance(*centre, (4.0, 4.0), 0.4),
                          math.sqrt(distance_reference.squared_gap(*centre, 7, 5))) for centre in centres)
        moving = min(math.dist(centre, (7.2, 7.6)) - 0.3 for centre in centres)
        if known < 2:  # exact within the contact window; a lower bound beyond
            assert float(found[0]) == pytest.approx(known - ROD_RADIUS, abs=1e-4)
        assert float(found[0]) <= known - ROD_RADIUS + 1e-4
        assert float(found[1]) == pytest.approx(unknown - ROD_RADIUS, abs=1e-4)
        assert float(found[2]) == pytest.approx(moving - ROD_RADIUS, abs=1e-4)


def test_long_robot_hits_with_its_ends_what_a_disc_would_miss():
    # The robot stands 0.42 m from the cell; its front disc reaches 0.27 + 0.2 m ahead, a single one of that size 0.2 m.
    assert pytest.approx((0.2667, 0.2007), abs=1e-3) == (ROD_OFFSETS[-1], ROD_RADIUS)
    world = task(hidden=cells((6, 2)), start=(1.58, 6.5), heading=0.0)
    ahead, aside = (float(clearances_of(world, 1.58, 6.5, heading)[1]) for heading in (0.0, math.pi / 2))
    assert ahead == pytest.approx(0.42 - 0.2667 - 0.2007, abs=1e-3)
    assert aside == pytest.approx(0.42 - 0.2007, abs=1e-3)
    assert ahead < 0 < aside


# Movers at the border.


def test_movers_are_expected_to_turn_back_at_the_maps_own_border():
    # A map of 9 × 9 m in a padded grid; a disc of 0.4 m nears its border at 0.5 m/s and is mirrored at x = 8.6. After
    # 2 s it is at 7.8 rather than at 9.4, nearer to the robot that stands at x = 7 than it ever was.
    world = task(np.zeros((9, 9), bool), (7.0, 4.5), (1.5, 4.5), movers=[(8.4, 4.5, 0.5, 0.0, 0.4)], heading=math.pi)
    constants, options = preset(Rules().only("border"))
    ends = jnp.float32([world.start[:2], world.goal])
    known = plan_by_hand(ends, jnp.int32(2), jax.jit(distance_field)(world.grid))
    step = jax.jit(control_step, static_argnames="options")
    _, decision = step(started(world, known), first_memory(world, known), world, known, constants, options=options)
    standing_still = float(decision.candidates.clearance[0, 0])
    assert standing_still == pytest.approx(7.8 - 7 - 0.4 - 0.25, abs=1e-4)


def test_changing_constants_and_tasks_does_not_retrace():
    traced(UNEQUAL[0])
    before = follow._cache_size()
    traced(UNEQUAL[1], jax.tree.map(lambda value: value * 1.01, EXTENDED.constants))
    traced(task(random_map(7, (9, 9), 0.1), (0.5, 0.5), (8.5, 8.5)), sensing(1.0))
    assert follow._cache_size() == before
