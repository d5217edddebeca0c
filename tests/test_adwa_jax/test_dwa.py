"""One decision against the double-precision oracle and by hand."""

import math
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from adwa_jax.admissible import is_admissible
from adwa_jax.constants import DwaOptions, Options
from adwa_jax.dwa import Guidance, decide
from adwa_jax.presets import paper
from adwa_jax.rollout import RobotState, wrap
from adwa_jax.score import ScoreWeights
from adwa_jax.window import RobotLimits
from tests.reference import dwa as reference
from tests.test_adwa_jax.scenes import (
    EMPTY,
    SUBDIVISION,
    field_of,
    looked_up,
    random_scene,
    scene_lattice,
    sensed,
    state,
)
from tests.test_adwa_jax.worlds import counting, grid_of

OPTIONS = DwaOptions(v_samples=5, yaw_rate_samples=7, horizon_steps=6)
DT = 0.25
CAP = 0.8
LIMITS = {"radius": 0.25, "v_min": 0.0, "v_max": 1.0, "yaw_rate_max": 1.5, "brake": 1.0, "yaw_brake": 3.0}
ROBOT = RobotLimits(**LIMITS, acceleration=1.0, yaw_acceleration=3.0)
ORACLE_ROBOT = reference.Robot(**LIMITS, a_max=1.0, yaw_a_max=3.0)
WEIGHTS = (0.4, 0.3, 0.5, 0.1)

decided, traces = counting(decide, static_argnames="options")


def constants_of(weights=WEIGHTS, robot=ROBOT):
    """Those of a decision; the others, of the plan and the closed loop, are the preset's."""
    base = paper().constants
    weights = weights if isinstance(weights, ScoreWeights) else ScoreWeights(*weights)
    return replace(base, weights=weights, robot=robot, behaviour=replace(base.behaviour, dt=DT, clearance_cap=CAP))


def choose(robot_state, local_target, goal=(11.0, 6.0), field=EMPTY, known=None, weights=WEIGHTS, robot=ROBOT,
           options=OPTIONS):
    return decided(robot_state, Guidance(jnp.float32(local_target), jnp.float32(goal)), field, known or sensed(),
                   constants_of(weights, robot), options=Options(dwa=options))


@pytest.mark.parametrize("normalisation", ["sum", "minmax", "none"])
def test_decisions_equal_the_oracle(normalisation):
    options = DwaOptions(5, 7, 6, normalisation)
    chosen, braking = 0, 0
    for seed in range(24):
        occupied, start, known, seen, local, goal = random_scene(seed)
        lattice = scene_lattice(seed)
        expected = reference.decide(
            start[:3], start[3], start[4], local, goal, ORACLE_ROBOT, reference.Weights(*WEIGHTS),
            static_distance=lambda x, y, grid=lattice: looked_up(grid, x, y), squares=known, movers=seen, dt=DT,
            steps=6, v_count=5, yaw_count=7, clearance_cap=CAP, normalisation=normalisation)
        found = choose(state(*start), local, goal, field_of(grid_of(occupied), subdivision=SUBDIVISION),
                       sensed(known, seen), options=options)
        assert_candidates_agree(found.candidates, expected.candidates)
        assert_choice_agrees(found, expected)
        chosen += expected.index >= 0
        braking += expected.index < 0
    assert chosen > 8
    assert braking > 2


def assert_candidates_agree(found, expected):
    found = jax.tree.map(np.asarray, found)
    assert found.terms[4:] == (None,) * 5  # those of eq. 9 and no others
    for n, candidate in enumerate(expected):
        index = divmod(n, 7)
        assert float(found.v[index[0]]) == pytest.approx(candidate.v, abs=1e-6)
        assert float(found.yaw_rate[index[1]]) == pytest.approx(candidate.yaw_rate, abs=1e-6)
        assert float(found.clearance[index]) == pytest.approx(candidate.clearance, abs=2e-5)
        assert bool(found.admissible[index]) == candidate.admissible
        for term, value in zip(found.terms[:4], candidate.terms, strict=True):
            assert float(term[index]) == pytest.approx(value, abs=1e-3)
        if candidate.admissible:
            assert float(found.score[index]) == pytest.approx(candidate.score, abs=1e-3)


def assert_choice_agrees(found, expected):
    """The oracle's choice, or one whose score in double precision is as good but for rounding."""
    index = int(found.index)
    if index != expected.index:
        assert index >= 0
        assert expected.index >= 0
        assert expected.candidates[index].score > expected.candidates[expected.index].score - 1e-6
    elif index < 0:
        assert float(found.v) == pytest.approx(expected.v, abs=1e-6)
        assert float(found.yaw_rate) == pytest.approx(expected.yaw_rate, abs=1e-4)
    if index >= 0:
        assert float(found.v) == float(found.candidates.v[index // 7])
        assert float(found.yaw_rate) == float(found.candidates.yaw_rate[index % 7])


def test_heading_alone_steers_at_the_target():
    # At 0.5 m/s towards +x, the target straight above: of yaw rates −0.75 … 0.75 the largest turns furthest to it.
    found = choose(state(6, 6, 0, 0.5, 0), (6.0, 11.0), weights=(1.0, 0.0, 0.0, 0.0))
    assert float(found.yaw_rate) == pytest.approx(0.75)
    found = choose(state(6, 6, 0, 0.5, 0), (6.0, 1.0), weights=(1.0, 0.0, 0.0, 0.0))
    assert float(found.yaw_rate) == pytest.approx(-0.75)
    # The goal counts through its own weight alone.
    found = choose(state(6, 6, 0, 0.5, 0), (6.0, 11.0), goal=(6.0, 1.0), weights=(0.0, 0.0, 0.0, 1.0))
    assert float(found.yaw_rate) == pytest.approx(-0.75)


def test_velocity_alone_takes_the_fastest_and_ties_go_to_the_lower_index():
    found = choose(state(6, 6, 0, 0.5, 0), (11.0, 6.0), weights=(0.0, 0.0, 1.0, 0.0))
    assert (int(found.index), float(found.v)) == (28, 0.75)
    assert float(found.yaw_rate) == pytest.approx(-0.75)
    found = choose(state(6, 6, 0, 0.5, 0), (11.0, 6.0), weights=(0.0, 0.0, 0.0, 0.0))
    assert int(found.index) == 0


def test_oncoming_mover_is_met_where_it_will_be():
    # The robot at rest may reach 0.25 m/s; at v = 0 it stays at (3, 6) for 1.5 s.
    oncoming = sensed(movers=[((6.0, 6.0), (-1.0, 0.0), 0.5)])
    clearance = choose(state(3, 6, 0, 0, 0), (9.0, 6.0), known=oncoming).candidates.clearance
    # Standing: at 1.5 s the mover is at 4.5; 1.5 − 0.5 − 0.25. Fastest: the robot is at 3.375.
    assert float(clearance[0, 3]) == pytest.approx(0.75, abs=1e-5)
    assert float(clearance[4, 3]) == pytest.approx(0.375, abs=1e-5)
    receding = sensed(movers=[((6.0, 6.0), (1.0, 0.0), 0.5)])
    clearance = choose(state(3, 6, 0, 0, 0), (9.0, 6.0), known=receding).candidates.clearance
    assert float(clearance[0, 3]) == pytest.approx(2.5, abs=1e-5)  # its first point, at 0.25 s: 3.25 − 0.75


def test_admissible_needs_room_to_stop_and_to_stop_turning():
    clearance = jnp.float32([[0.5], [0.49], [0.0], [-1.0]])
    fast = is_admissible(clearance, jnp.full((4,), 1.0, jnp.float32), jnp.zeros((1,), jnp.float32), ROBOT)
    np.testing.assert_array_equal(fast[:, 0], [True, False, False, False])  # √(2 · 0.5 · 1) = 1
    turning = is_admissible(jnp.float32([[0.375], [0.37], [0.0]]), jnp.zeros((3,), jnp.float32), jnp.float32([-1.5]),
                            ROBOT)
    np.testing.assert_array_equal(turning[:, 0], [True, False, False])  # √(2 · 0.375 · 3) = 1.5


def test_boxed_in_robot_brakes_and_turns_to_the_local_target():
    box = sensed(squares=[((6.0, 6.0), 1.0)])
    found = choose(state(6, 6, 0, 0.6, 0.3), (6.0, 11.0), known=box)
    assert int(found.index) == -1
    assert not found.candidates.admissible.any()
    assert float(found.v) == pytest.approx(0.35)
    assert float(found.yaw_rate) == pytest.approx(1.05)
    right_ahead = choose(state(6, 6, 0.1, 0.1, 0.0), (11.0, 6.0), known=box)
    assert float(right_ahead.v) == 0.0
    assert float(right_ahead.yaw_rate) == pytest.approx(-0.1 / DT, rel=1e-5)


def test_braking_in_reverse_does_not_leave_the_window():
    reverse = RobotLimits(**(LIMITS | {"v_min": -1.0}), acceleration=1.0, yaw_acceleration=3.0)
    box = sensed(squares=[((6.0, 6.0), 1.0)])
    assert float(choose(state(6, 6, 0, -0.6, 0), (6.0, 11.0), known=box, robot=reverse).v) == pytest.approx(-0.35)
    assert float(choose(state(6, 6, 0, -0.1, 0), (6.0, 11.0), known=box, robot=reverse).v) == 0.0


def test_traditional_dwa_is_the_goal_as_only_target():
    occupied, start, known, seen, local, goal = random_scene(3)
    field = field_of(grid_of(occupied), subdivision=SUBDIVISION)
    once = choose(state(*start), goal, goal, field, sensed(known, seen), (0.5, 0.3, 0.5, 0.0))
    split = choose(state(*start), goal, local, field, sensed(known, seen), (0.5, 0.3, 0.5, 0.0))
    np.testing.assert_array_equal(once.candidates.score, split.candidates.score)


def finite(tree):
    return all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(tree))


@pytest.mark.parametrize("normalisation", ["sum", "minmax", "none"])
@pytest.mark.parametrize("known", [sensed(), sensed(squares=[((6.0, 6.0), 1.0)]), sensed(capacity=0)],
                         ids=["free", "boxed in", "no capacity"])
def test_no_nan_even_on_the_target_or_without_any_candidate(normalisation, known):
    options = DwaOptions(5, 7, 6, normalisation)
    for v, target in ((0.0, (6.0, 6.0)), (0.0, (7.0, 6.0)), (1.0, (6.25, 6.0))):
        assert finite(choose(state(6, 6, 0, v, 0), target, target, known=known, options=options))


PLACES = ((6.0, 6.0), (5.0, 5.0), (0.0, 0.0), (5.0, 5.5), (4.0, 6.0), (2.0, 9.0))


def test_gradients_of_scores_and_commands_are_finite():
    occupied = np.zeros((12, 12), bool)
    occupied[5, 5] = True  # the places: its corners, its side, the map's corner, free ground
    field = field_of(grid_of(occupied), subdivision=SUBDIVISION)

    def outputs(robot_state, weights, target, mover):
        known = sensed(squares=[((3.0, 6.0), 1.0)])._replace(position=jnp.broadcast_to(mover, (3, 2)),
                                                             seen=jnp.array([True, False, False]))
        found = decide(robot_state, Guidance(target, target), field, known, constants_of(weights), Options(dwa=OPTIONS))
        score = jnp.sum(jnp.where(found.candidates.admissible, found.candidates.score, 0.0))
        return jnp.stack([score, found.v, found.yaw_rate])

    slopes = jax.jit(jax.jacrev(outputs, argnums=(0, 1, 2, 3)))
    weights = ScoreWeights(*map(jnp.float32, WEIGHTS))
    for place in PLACES:
        here = jnp.float32(place)
        assert finite(slopes(state(*place, 0.7, 0.5, 0.2), weights, jnp.float32([9.0, 9.0]), here))
        assert finite(slopes(state(*place, 0.0, 0.0, 0.0), weights, here, jnp.float32([9.0, 9.0])))


def test_padding_of_obstacles_and_map_changes_nothing():
    occupied, start, known, seen, local, goal = random_scene(5)
    occupied = occupied[:9, :9]
    inside = (4.5, 4.5, *start[2:])
    full = choose(state(*inside), local, goal, field_of(grid_of(occupied), subdivision=SUBDIVISION),
                  sensed(known, seen, capacity=3))
    alone = choose(state(*inside), local, goal, field_of(grid_of(occupied, shape=None), subdivision=SUBDIVISION),
                   sensed(known, seen, capacity=2))
    np.testing.assert_allclose(full.candidates.clearance, alone.candidates.clearance, atol=1e-6)
    assert int(full.index) == int(alone.index)


def test_vmap_equals_a_loop():
    starts = [random_scene(seed)[1] for seed in range(6)]
    box = sensed(squares=[((6.0, 6.0), 0.5)], movers=[((3.0, 3.0), (0.5, 0.5), 0.3)])
    states = RobotState(*jnp.float32(np.array(starts).T))
    target = jnp.float32([9.0, 3.0])

    def one(robot_state):
        return decide(robot_state, Guidance(target, target), EMPTY, box, constants_of(), Options(dwa=OPTIONS))

    together = jax.jit(jax.vmap(one))(states)
    for k, start in enumerate(starts):
        alone = choose(state(*start), target, target, known=box)
        assert int(together.index[k]) == int(alone.index)
        for lane, leaf in zip(jax.tree.leaves(together), jax.tree.leaves(alone), strict=True):
            np.testing.assert_allclose(lane[k], leaf, atol=1e-5)


def test_changing_weights_limits_and_targets_does_not_retrace():
    choose(state(6, 6, 0, 0, 0), (9.0, 9.0))
    before = len(traces)
    for k in range(3):
        robot = RobotLimits(**(LIMITS | {"radius": 0.1 * k}), acceleration=1.0 + k, yaw_acceleration=3.0)
        choose(state(6, 6, k, 0, 0), (9.0, k), weights=(0.1 * k, 0.2, 0.3, 0.4), robot=robot)
    assert len(traces) == before


@pytest.mark.parametrize(("angle", "wrapped"), [(0.0, 0.0), (4.0, 4.0 - 2 * math.pi), (-4.0, 2 * math.pi - 4.0),
                                                (20.0, 20.0 - 6 * math.pi), (3.0, 3.0)])
def test_wrap_is_the_short_way_round(angle, wrapped):
    assert float(wrap(jnp.float32(angle))) == pytest.approx(wrapped, abs=1e-5)


@pytest.mark.parametrize("changed", [{"v_samples": 0}, {"yaw_rate_samples": 0}, {"horizon_steps": 0},
                                     {"v_samples": 2.5}, {"normalisation": "softmax"}, {"stride": 0},
                                     {"turn_step": 0}, {"halt_steps": 0}, {"watch_beyond": -1}])
def test_nonsense_options_are_refused(changed):
    with pytest.raises(ValueError, match=next(iter(changed))):
        DwaOptions(**changed)
