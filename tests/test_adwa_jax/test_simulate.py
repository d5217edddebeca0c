"""The closed loop: outcomes, sensing, targets and measures of whole episodes."""

import math
from dataclasses import replace
from functools import partial

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from adwa_jax.constants import Behaviour, DwaOptions, Options, PlanOptions
from adwa_jax.episode import Outcome
from adwa_jax.lanes import trace
from adwa_jax.plan import plan
from adwa_jax.presets import paper
from adwa_jax.score import ScoreWeights
from adwa_jax.simulate import drive
from adwa_jax.window import RobotLimits
from tests.reference import distance as distance_reference
from tests.reference import metrics as metrics_reference
from tests.reference.dwa import square_distance
from tests.test_adwa_jax.worlds import counting, drawn, random_map, scenario

OPTIONS = Options(plan=PlanOptions(subdivision=2), dwa=DwaOptions(5, 9, 10))
DT = 0.1
CONSTANTS = replace(
    paper().constants,
    weights=ScoreWeights(local_heading=0.8, clearance=0.3, velocity=0.8, global_heading=0.1),
    robot=RobotLimits(radius=0.25, v_min=0.0, v_max=1.0, yaw_rate_max=1.5, acceleration=2.0, yaw_acceleration=6.0,
                      brake=2.0, yaw_brake=60.0),
    behaviour=Behaviour(dt=DT, clearance_cap=0.5, clearance_margin=0.25, keypoint_tolerance=1.0, sensor_range=5.0,
                        danger_clearance=0.1, stuck_radius=0.25, stuck_time=15.0),
)
STEPS = 250  # rows kept of a trace; every time limit here is shorter


def changed(**behaviour):
    return replace(CONSTANTS, behaviour=replace(CONSTANTS.behaviour, **behaviour))


def crawling():
    """A robot that cannot be said to move."""
    return replace(CONSTANTS, robot=replace(CONSTANTS.robot, v_max=5e-4))


def whole_run(world, constants):
    """Plan and episode."""
    known = plan(world.grid, world.start[:2], world.goal, constants, OPTIONS.plan)
    return known, drive(world, known, constants, OPTIONS)


run, traces = counting(whole_run)


def driven(world, constants):
    return run(world, constants)[1]


follow = jax.jit(partial(trace, options=OPTIONS, steps=STEPS))


def traced(world, constants):
    return follow(world, run(world, constants)[0], constants)


def outcome(world, constants=CONSTANTS):
    return Outcome(int(driven(world, constants).outcome))


ROOM = np.zeros((12, 12), bool)
ACROSS = scenario(ROOM, (2.5, 6.5), (9.5, 6.5))
WALL = drawn(*["............"] * 5, "#########...", *["............"] * 6)
ROUND_THE_WALL = scenario(WALL, (1.5, 1.5), (1.5, 9.5))


def test_open_room_is_crossed_straight_ahead():
    episode, path = traced(ACROSS, CONSTANTS)
    length = int(path.length)
    assert Outcome(int(episode.outcome)) is Outcome.REACHED
    np.testing.assert_allclose(path.robot.y[:length], 6.5, atol=1e-3)
    # 7 m less the tolerance of 0.4 m and at most one step; 0.1 m a step once it is up to speed.
    assert 6.6 <= float(episode.measures.length) <= 6.7
    assert 66 <= length <= 72
    assert float(episode.measures.time) == pytest.approx(DT * length)
    assert int(episode.measures.breaking_points) == 0
    assert float(episode.measures.spl) == 1.0


@pytest.mark.parametrize(("world", "constants", "expected"), [
    (scenario(drawn(".#.", ".#.", ".#."), (0.5, 0.5), (2.5, 0.5)), CONSTANTS, Outcome.NO_PATH),
    (scenario(drawn(".#.", ".#.", ".#."), (1.5, 0.5), (2.5, 0.5)), CONSTANTS, Outcome.NO_PATH),
    (scenario(ROOM, (2.5, 6.5), (9.5, 6.5), time_limit=1.0), CONSTANTS, Outcome.TIMEOUT),
    (ACROSS, replace(crawling(), behaviour=changed(stuck_time=2.0).behaviour), Outcome.STUCK),
    (scenario(ROOM, (2.5, 6.5), (9.5, 6.5), squares=[(6.0, 6.5, 0.5)]), changed(sensor_range=0.0), Outcome.HIT_UNKNOWN),
    (scenario(ROOM, (2.5, 6.5), (9.5, 6.5), movers=[(8.0, 6.5, -0.5, 0.0, 0.4)]), changed(sensor_range=0.0),
     Outcome.HIT_MOVER),
    (scenario(drawn("#..", "...", "..."), (1.05, 0.5), (2.5, 2.5)), CONSTANTS, Outcome.HIT_KNOWN),
], ids=["walled off", "start blocked", "out of time", "stuck", "unknown square", "mover", "known square"])
def test_every_way_to_end(world, constants, expected):
    episode = driven(world, constants)
    assert Outcome(int(episode.outcome)) is expected
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(episode.measures))
    assert float(episode.measures.spl) == float(episode.measures.barn_score) == 0.0
    assert not episode.hit_while_stopped


def test_times_of_the_ends_by_hand():
    assert float(driven(scenario(ROOM, (2.5, 6.5), (9.5, 6.5), time_limit=1.0), CONSTANTS).measures.time) == 1.0
    stuck = driven(ACROSS, replace(crawling(), behaviour=changed(stuck_time=2.0).behaviour))
    assert float(stuck.measures.time) == pytest.approx(2.0)
    walled_off = driven(scenario(drawn(".#."), (0.5, 0.5), (2.5, 0.5)), CONSTANTS)
    assert float(walled_off.measures.time) == float(walled_off.measures.length) == 0.0


def test_mover_that_runs_into_a_standing_robot_is_told_apart():
    # Outlines at 2.75 and x − 0.4, x = 8.05 − t: they meet after 4.9 s, and overlap at the end of step 49.
    world = scenario(ROOM, (2.5, 6.5), (9.5, 6.5), movers=[(8.04, 6.5, -1.0, 0.0, 0.4)])
    episode = driven(world, crawling())
    assert Outcome(int(episode.outcome)) is Outcome.HIT_MOVER
    assert bool(episode.hit_while_stopped)
    assert float(episode.measures.time) == pytest.approx(4.9)


def test_sensed_square_is_driven_round_and_stays_known():
    world = scenario(ROOM, (2.5, 6.5), (9.5, 6.5), squares=[(6.0, 6.7, 0.5)])
    episode, path = traced(world, changed(sensor_range=2.03))
    length = int(path.length)
    assert Outcome(int(episode.outcome)) is Outcome.REACHED
    known = np.asarray(path.known)[:length, 0]
    assert not known[0]
    assert known[-1]
    assert (np.diff(known.astype(int)) >= 0).all()
    # Known from the step whose start is within 2.03 m of the side at x = 5.5.
    x = np.concatenate([[2.5], np.asarray(path.robot.x)[: length - 1]])
    np.testing.assert_array_equal(known, x >= 3.47)
    assert not np.asarray(path.known)[:, 1].any()


def test_wall_is_rounded_by_way_of_the_key_points():
    episode, path = traced(ROUND_THE_WALL, CONSTANTS)
    assert Outcome(int(episode.outcome)) is Outcome.REACHED
    targets = np.asarray(path.target)[: int(path.length)]
    assert len(np.unique(targets, axis=0)) >= 2
    np.testing.assert_array_equal(targets[-1], [1.5, 9.5])
    assert (np.asarray(path.robot.x)[: int(path.length)]).max() > 9.0


def test_robot_faces_its_first_key_point_unless_a_heading_is_given():
    standing = crawling()
    first = run(ROUND_THE_WALL, standing)[0].key_points[1]
    towards = math.atan2(float(first[1]) - 1.5, float(first[0]) - 1.5)
    first_turn = CONSTANTS.robot.yaw_acceleration * DT * DT
    assert abs(float(traced(ROUND_THE_WALL, standing)[1].robot.heading[0]) - towards) <= first_turn + 1e-5
    given = scenario(WALL, (1.5, 1.5), (1.5, 9.5), heading=-2.0)
    assert abs(float(traced(given, standing)[1].robot.heading[0]) + 2.0) <= first_turn + 1e-5


BUSY_MOVERS = ((9.0, 9.0, -0.3, -0.4, 0.3), (4.0, 8.0, 0.5, 0.1, 0.2))
BUSY = scenario(WALL, (1.5, 1.5), (1.5, 9.5), squares=[(6.0, 2.2, 0.3)], movers=BUSY_MOVERS)


@pytest.mark.parametrize("world", [ACROSS, ROUND_THE_WALL, BUSY], ids=["room", "wall", "busy"])
def test_measures_equal_plain_loops_over_the_trace(world):
    episode, path = traced(world, CONSTANTS)
    length = int(path.length)
    x, y, heading, v, yaw_rate = (np.asarray(part, np.float64)[:length] for part in path.robot)
    positions = [tuple(map(float, world.start[:2])), *zip(x, y, strict=True)]
    turns = np.concatenate([[0.0], np.cumsum(yaw_rate * DT)])
    clearance = np.asarray(path.clearance)[:length].tolist()
    shortest = float(run(world, CONSTANTS)[0].optimal_length)
    success = Outcome(int(episode.outcome)) is Outcome.REACHED
    expected = {
        "time": length * DT,
        "length": metrics_reference.length(positions),
        "spl": metrics_reference.spl(success, shortest, metrics_reference.length(positions)),
        "breaking_points": metrics_reference.driven_breaking_points(turns),
        "danger_points": metrics_reference.driven_danger_points(clearance, CONSTANTS.behaviour.danger_clearance),
        "least_clearance": min(clearance),
        "mean_clearance": sum(clearance) / length,
        "curvature": metrics_reference.curvature(positions, turns),
        "angle_over_length": metrics_reference.angle_over_length(positions, turns),
        "command_variation": metrics_reference.command_variation([0.0, *v], [0.0, *yaw_rate]),
        "jerk": metrics_reference.jerk(positions, DT),
        "barn_score": metrics_reference.barn_score(success, length * DT, shortest),
    }
    for name, value in expected.items():
        assert float(getattr(episode.measures, name)) == pytest.approx(value, rel=2e-3, abs=2e-3), name
    # The heading in the trace is the accumulated one, wrapped.
    start = heading[0] - yaw_rate[0] * DT
    np.testing.assert_allclose(np.cos(heading - start - turns[1:]), 1.0, atol=1e-4)


def test_clearance_of_every_step_equals_brute_force_near_obstacles_and_never_exceeds_it():
    _, path = traced(BUSY, CONSTANTS)
    near = 0
    for k in range(0, int(path.length), 3):
        x, y = float(path.robot.x[k]), float(path.robot.y[k])
        static = distance_reference.distance(WALL, x, y)
        others = [square_distance(x, y, (6.0, 2.2), 0.3)]
        for m, (mx, my, vx, vy, radius) in enumerate(BUSY_MOVERS):
            time = (k + 1) * DT
            mover = (bounced(mx + vx * time), bounced(my + vy * time))
            np.testing.assert_allclose(path.movers.position[k, m], mover, atol=1e-3)
            others.append(math.dist((x, y), mover) - radius)
        truth = min(static, *others) - CONSTANTS.robot.radius
        found = float(path.clearance[k])
        assert found <= truth + 1e-3
        if min(static, *others) < 2.0:
            near += 1
            assert found == pytest.approx(truth, abs=1e-3)
    assert near > 10


def bounced(coordinate):
    """A coordinate mirrored at 0 and 12."""
    coordinate = abs(coordinate) % 24
    return 24 - coordinate if coordinate > 12 else coordinate


def test_trace_and_drive_tell_the_same_story():
    for world in (ACROSS, BUSY, scenario(drawn(".#."), (0.5, 0.5), (2.5, 0.5))):
        episode, path = traced(world, CONSTANTS)
        alone = driven(world, CONSTANTS)
        chex.assert_trees_all_close(episode, alone, atol=1e-4)
        assert int(path.length) == round(float(alone.measures.time) / DT)
        assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(path))


def test_robot_obeys_its_limits_in_every_step():
    for world in (ROUND_THE_WALL, BUSY):
        _, path = traced(world, CONSTANTS)
        v = np.concatenate([[0.0], np.asarray(path.robot.v)[: int(path.length)]])
        yaw_rate = np.concatenate([[0.0], np.asarray(path.robot.yaw_rate)[: int(path.length)]])
        robot = CONSTANTS.robot
        assert v.min() >= robot.v_min - 1e-6
        assert v.max() <= robot.v_max + 1e-6
        assert abs(yaw_rate).max() <= robot.yaw_rate_max + 1e-6
        assert abs(np.diff(v)).max() <= robot.acceleration * DT + 1e-5
        assert abs(np.diff(yaw_rate)).max() <= robot.yaw_acceleration * DT + 1e-5


def test_vmap_equals_a_loop_with_unequal_episodes():
    worlds = [ACROSS, BUSY, ROUND_THE_WALL, scenario(drawn(".#."), (0.5, 0.5), (2.5, 0.5)),
              scenario(random_map(4, (9, 9), 0.15), (0.5, 0.5), (8.5, 8.5)),
              scenario(ROOM, (2.5, 6.5), (9.5, 6.5), time_limit=0.5)]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *worlds)
    plans, episodes = jax.jit(jax.vmap(whole_run, (0, None)))(stacked, CONSTANTS)
    for k, world in enumerate(worlds):
        plan_alone, alone = run(world, CONSTANTS)
        chex.assert_trees_all_close(jax.tree.map(lambda leaf, k=k: leaf[k], plans), plan_alone, rtol=1e-6)
        episode = jax.tree.map(lambda leaf, k=k: leaf[k], episodes)
        chex.assert_trees_all_close(episode, alone, rtol=1e-3, atol=1e-3)
    assert len(set(np.asarray(episodes.measures.time).tolist())) >= 5


def test_padding_changes_neither_plan_nor_episode():
    occupied = random_map(4, (9, 9), 0.15)
    inside = {"squares": [(4.0, 5.0, 0.2)], "movers": [(6.0, 2.0, 0.2, 0.3, 0.2)]}
    plan_padded, padded = run(scenario(occupied, (0.5, 0.5), (8.5, 8.5), **inside), CONSTANTS)
    plan_alone, alone = run(scenario(occupied, (0.5, 0.5), (8.5, 8.5), **inside, shape=None), CONSTANTS)
    chex.assert_trees_all_close(padded, alone, rtol=1e-3, atol=1e-3)
    for name in ("length", "key_point_length", "key_point_count", "optimal_length", "measures"):
        chex.assert_trees_all_equal(getattr(plan_alone, name), getattr(plan_padded, name))
    np.testing.assert_array_equal(plan_alone.search.expanded_at, plan_padded.search.expanded_at[:9, :9])
    np.testing.assert_array_equal(plan_alone.key_points, plan_padded.key_points[:81])
    assert float(padded.measures.time) > 1.0


def test_reference_length_sets_the_barn_score():
    time = float(driven(ACROSS, CONSTANTS).measures.time)
    for reference_length in (1.0, 9.0, 40.0):
        world = scenario(ROOM, (2.5, 6.5), (9.5, 6.5), reference_length=reference_length)
        expected = metrics_reference.barn_score(True, time, reference_length)
        assert float(driven(world, CONSTANTS).measures.barn_score) == pytest.approx(expected, rel=1e-5)


def test_changing_constants_and_scenarios_does_not_retrace():
    run(ACROSS, CONSTANTS)
    before = len(traces)
    for k, world in enumerate((ACROSS, BUSY, scenario(drawn(".#."), (0.5, 0.5), (2.5, 0.5)))):
        weights = replace(CONSTANTS.weights, velocity=0.1 * (k + 1))
        run(world, replace(changed(sensor_range=1.0 + k), weights=weights))
    assert len(traces) == before
