"""Candidate generators: ramps within the acceleration limits, second phases, and braking to a halt."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adwa_jax.dwa import begins_of, candidate_profiles
from adwa_jax.presets import extended, paper, preset
from adwa_jax.profiles import Targets, halting_profiles, ramped_profiles, window_profiles, yaw_rates_over_range
from adwa_jax.rules import EVERY_RULE, Rules
from tests.reference.prediction import braking
from tests.test_adwa_jax.scenes import state
from tests.test_adwa_jax.worlds import many_examples

ROBOT = replace(paper().constants.robot, acceleration=2.0, yaw_acceleration=6.0, v_max=1.0, yaw_rate_max=1.5)
DT = 0.1  # so that a control step changes v by 0.2 m/s and the yaw rate by 0.6 rad/s
REACH, YAW_REACH = 0.2, 0.6
STEPS = 5

ramped = jax.jit(ramped_profiles, static_argnames=("steps", "stride", "turn_step"))
halting = jax.jit(halting_profiles, static_argnames="steps")
profiles_of = jax.jit(candidate_profiles, static_argnames="options")


def ramp(v=0.0, yaw_rate=0.0, speeds=((0.0, 0.0),), turns=((0.0, 0.0),), stride=1, turn_step=2):
    """Profiles of pairs (first target, second target)."""
    speeds, turns = Targets(*jnp.float32(speeds).T), Targets(*jnp.float32(turns).T)
    return ramped(jnp.float32(v), jnp.float32(yaw_rate), speeds, turns, ROBOT, jnp.float32(DT), steps=STEPS,
                  stride=stride, turn_step=turn_step)


@pytest.mark.parametrize(("v", "targets", "stride", "expected"), [
    (0.5, (1.0, 1.0), 1, [0.7, 0.9, 1.0, 1.0, 1.0]),
    (0.5, (0.0, 0.0), 1, [0.3, 0.1, 0.0, 0.0, 0.0]),
    (0.5, (1.0, 0.0), 1, [0.7, 0.9, 0.7, 0.5, 0.3]),  # a change of mind after the second step
    (0.1, (0.0, 1.0), 1, [0.0, 0.0, 0.2, 0.4, 0.6]),
    (-0.2, (-0.4, -0.4), 1, [-0.4] * 5),
    # Two control steps a predicted one, which shows their mean: 0.2 and 0.4, 0.6 and 0.8, 1 and 1.
    (0.0, (1.0, 1.0), 2, [0.3, 0.7, 1.0, 1.0, 1.0]),
    (0.0, (1.0, 0.0), 2, [0.3, 0.7, 0.5, 0.1, 0.0]),  # 0.8 after the turning step; then 0.6 and 0.4
])
def test_speeds_ahead_by_hand(v, targets, stride, expected):
    found = ramp(v=v, speeds=[targets], stride=stride)
    np.testing.assert_allclose(found.v_ahead[:, 0], expected, atol=1e-6)


@pytest.mark.parametrize(("yaw_rate", "targets", "stride", "expected"), [
    (0.3, (1.5, -1.5), 1, [0.9, 1.5, 0.9, 0.3, -0.3]),
    (0.3, (1.5, -1.5), 2, [1.2, 1.5, 0.6, -0.6, -1.5]),
    (0.0, (-1.5, 0.0), 1, [-0.6, -1.2, -0.6, 0.0, 0.0]),
])
def test_yaw_rates_ahead_by_hand(yaw_rate, targets, stride, expected):
    found = ramp(yaw_rate=yaw_rate, turns=[targets], stride=stride)
    np.testing.assert_allclose(found.yaw_rate_ahead[:, 0], expected, atol=1e-6)


def controlled(value, targets, reach, steps, turn_step):
    """One value a control step: as near to its target as the reach allows."""
    values = []
    for step in range(steps):
        target = targets[0] if step < turn_step else targets[1]
        value += min(max(target - value, -reach), reach)
        values.append(value)
    return values


speeds = st.floats(-0.4, 1.0)


@many_examples
@given(speeds, st.tuples(speeds, speeds), st.integers(1, 3))
def test_predicted_speeds_are_those_of_the_control_steps_and_never_beyond_the_limits(v, targets, turn_step):
    single = ramp(v=v, speeds=[targets], turn_step=turn_step)
    expected = controlled(v, targets, REACH, STEPS, turn_step)
    np.testing.assert_allclose(single.v_ahead[:, 0], expected, atol=1e-5)
    assert float(single.v[0]) == float(single.v_ahead[0, 0])  # what is commanded is the first control step
    assert np.abs(np.diff([v, *single.v_ahead[:, 0]])).max() <= REACH + 1e-5

    double = ramp(v=v, speeds=[targets], stride=2, turn_step=turn_step)
    means = np.reshape(controlled(v, targets, REACH, 2 * STEPS, 2 * turn_step), (STEPS, 2)).mean(axis=1)
    # A target that is reached between the two control steps counts as reached up to a quarter of the reach early.
    np.testing.assert_allclose(double.v_ahead[:, 0], means, atol=REACH / 4 + 1e-5)
    assert float(double.v[0]) == float(single.v[0])


def test_yaw_rates_obey_limits_of_their_own():
    found = ramp(yaw_rate=-1.2, turns=[(1.5, -1.5), (0.0, 0.0)])
    np.testing.assert_allclose(found.yaw_rate, [-0.6, -0.6], atol=1e-6)
    changes = np.diff(np.concatenate([[[-1.2, -1.2]], found.yaw_rate_ahead]), axis=0)
    assert np.abs(changes).max() <= YAW_REACH + 1e-5


def test_braking_takes_one_step_at_the_command_and_then_slows_down_to_rest():
    found = halting(jnp.float32([1.0, 0.3, -0.5, 0.0]), jnp.float32([1.5, -0.7]), ROBOT, jnp.float32(DT), steps=6)
    expected = [[1.0, 0.3, -0.5, 0.0], [0.8, 0.1, -0.3, 0.0], [0.6, 0.0, -0.1, 0.0], [0.4, 0, 0, 0], [0.2, 0, 0, 0],
                [0, 0, 0, 0]]  # fmt: skip
    np.testing.assert_allclose(found.v_ahead, expected, atol=1e-6)
    turning = [[1.5, -0.7], [0.9, -0.1], [0.3, 0], [0, 0], [0, 0], [0, 0]]
    np.testing.assert_allclose(found.yaw_rate_ahead, turning, atol=1e-6)


@many_examples
@given(st.floats(-0.4, 1.0), st.floats(-1.5, 1.5))
def test_braking_ends_at_rest_within_the_extended_presets_steps(v, yaw_rate):
    steps = extended().options.dwa.halt_steps
    found = halting(jnp.float32([v]), jnp.float32([yaw_rate]), extended().constants.robot, jnp.float32(DT), steps=steps)
    speeds_left, yaw_rates_left = braking(v, yaw_rate, REACH, YAW_REACH, steps)
    np.testing.assert_allclose(found.v_ahead[:, 0], speeds_left, atol=1e-5)
    np.testing.assert_allclose(found.yaw_rate_ahead[:, 0], yaw_rates_left, atol=1e-5)
    assert abs(float(found.v_ahead[-1, 0])) < 1e-6
    assert abs(float(found.yaw_rate_ahead[-1, 0])) < 1e-6


@pytest.mark.parametrize("samples", [3, 5, 7, 9, 11, 13, 21])
def test_straight_on_is_exactly_among_the_yaw_rates_and_they_are_even(samples):
    found = np.asarray(jax.jit(lambda robot: yaw_rates_over_range(robot, samples))(ROBOT))
    assert found[samples // 2] == 0.0
    assert (found[0], found[-1]) == (-1.5, 1.5)
    np.testing.assert_allclose(np.diff(found), 3.0 / (samples - 1), rtol=1e-5)


def commands(rules, v, yaw_rate):
    """Profiles of a robot that drives so, under the preset of these rules."""
    constants, options = preset(rules)
    return jax.device_get(profiles_of(state(0, 0, 0, v, yaw_rate), constants, options=options)), constants, options


NAMES = ("ramp", "second_phase", "reverse", "long_watch")  # the rules that make candidates


@pytest.mark.parametrize("rules", [*map(Rules().only, NAMES), EVERY_RULE, *map(EVERY_RULE.without, NAMES)],
                         ids=[*NAMES, "every", *(f"without {name}" for name in NAMES)])
def test_no_candidate_of_any_mix_of_rules_asks_for_more_than_the_robot_can(rules):
    for v, yaw_rate in ((0.0, 0.0), (0.75, -1.1), (1.0, 1.5)):
        found, constants, options = commands(rules, v, yaw_rate)
        robot, dt = constants.robot, constants.behaviour.dt
        assert np.abs(found.v - np.float32(v)).max() <= robot.acceleration * dt + 1e-5
        assert np.abs(found.yaw_rate - np.float32(yaw_rate)).max() <= robot.yaw_acceleration * dt + 1e-5
        for speed in (found.v, found.v_ahead):
            assert robot.v_min - 1e-6 <= speed.min()
            assert speed.max() <= robot.v_max + 1e-6
        for turn in (found.yaw_rate, found.yaw_rate_ahead):
            assert np.abs(turn).max() <= robot.yaw_rate_max + 1e-6
        steps = options.dwa.horizon_steps + (options.dwa.watch_beyond if rules.long_watch else 0)
        assert found.v_ahead.shape == (steps, *found.v.shape)
        assert found.yaw_rate_ahead.shape == (steps, *found.yaw_rate.shape)


@pytest.mark.parametrize("rules", [EVERY_RULE, EVERY_RULE.without("reverse"), EVERY_RULE.without("ramp"),
                                   EVERY_RULE.without("second_phase"), Rules()],
                         ids=["every", "no reverse", "no ramp", "no second phase", "none"])
def test_candidates_said_to_begin_alike_do_so(rules):
    found, _, options = commands(rules, 0.5, 0.3)
    begins = begins_of(options)
    v, yaw_rate = (np.concatenate([values[begin:end] for begin, end in runs])
                   for values, runs in ((found.v, begins.v), (found.yaw_rate, begins.yaw_rate)))
    np.testing.assert_array_equal(found.v, v)
    np.testing.assert_array_equal(found.yaw_rate, yaw_rate)
    distinct = found.v[: begins.v[0][1], None] + 10 * found.yaw_rate[None, : begins.yaw_rate[0][1]]
    np.testing.assert_array_equal(begins.each(jnp.asarray(distinct)), found.v[:, None] + 10 * found.yaw_rate[None, :])
    if rules == EVERY_RULE:  # 6 speeds and reverse, 9 yaw rates, of 9 and 25
        assert distinct.shape == (7, 9)


def test_extended_candidates_by_hand():
    found, constants, options = commands(EVERY_RULE, 0.5, 0.0)
    held = options.dwa.v_samples
    # Held: from 0 to full speed; then full speed and halt, halt and full speed, and backwards, in some order.
    assert found.v.shape == (held + 3,)
    last = {round(float(speed), 4) for speed in found.v_ahead[-1]}
    assert {0.0, constants.robot.v_max, constants.robot.v_min} <= last
    np.testing.assert_array_equal(np.unique(np.sign(np.round(found.v_ahead[-1], 6))), [-1, 0, 1])
    # A yaw rate held; each but 0 also followed by straight on, and by its opposite.
    turns = options.dwa.yaw_rate_samples
    assert found.yaw_rate.shape == (3 * turns - 2,)
    ends = np.round(found.yaw_rate_ahead[-1], 4)
    assert (ends == 0).sum() == 1 + (turns - 1)
    np.testing.assert_allclose(sorted(ends), -np.array(sorted(ends))[::-1])


def test_brake_is_always_among_the_extended_candidates():
    # As hard as can be towards rest, in both velocities: what makes an admissible command lead to another one.
    for v, yaw_rate in ((0.9, 1.4), (0.1, -0.2), (-0.3, 0.7), (0.0, 0.0)):
        found, _, _ = commands(EVERY_RULE, v, yaw_rate)
        slower, straighter = braking(v, yaw_rate, REACH, YAW_REACH, 2)
        assert np.abs(found.v - slower[1]).min() < 1e-6
        assert np.abs(found.yaw_rate - straighter[1]).min() < 1e-6


def test_window_profiles_hold_the_window():
    v, yaw_rate = jnp.float32([0.2, 0.4]), jnp.float32([-0.3, 0.0, 0.3])
    found = window_profiles(v, yaw_rate, 4, 2, False)
    np.testing.assert_array_equal(found.v, v)
    np.testing.assert_array_equal(found.yaw_rate, yaw_rate)
    np.testing.assert_array_equal(found.v_ahead, np.broadcast_to(v, (4, 2)))
    np.testing.assert_array_equal(found.yaw_rate_ahead, np.broadcast_to(yaw_rate, (4, 3)))
