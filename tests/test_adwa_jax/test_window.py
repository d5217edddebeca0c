"""The velocity window (eq. 6)."""

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adwa_jax.window import RobotLimits, velocity_window
from tests.reference import dwa as reference
from tests.test_adwa_jax.worlds import many_examples

LIMITS = {"radius": 0.25, "v_min": -0.25, "v_max": 1.0, "yaw_rate_max": 1.5, "acceleration": 2.0,
          "yaw_acceleration": 6.0, "brake": 2.0, "yaw_brake": 6.0}
ROBOT = RobotLimits(**LIMITS)
window = jax.jit(velocity_window, static_argnames=("v_samples", "yaw_rate_samples"))


def samples(v, yaw_rate, dt=0.1):
    return window(jnp.float32(v), jnp.float32(yaw_rate), ROBOT, jnp.float32(dt), v_samples=5, yaw_rate_samples=7)


def test_window_inside_the_limits_by_hand():
    v, yaw_rate = samples(0.5, 0.0)
    np.testing.assert_allclose(v, [0.3, 0.4, 0.5, 0.6, 0.7], rtol=1e-6)
    np.testing.assert_allclose(yaw_rate, [-0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6], atol=1e-7)


def test_window_is_cut_at_the_limits_and_its_ends_are_exact():
    v, yaw_rate = samples(0.95, -1.25)
    assert (float(v[-1]), float(yaw_rate[0])) == (1.0, -1.5)
    np.testing.assert_allclose(v[0], 0.75, rtol=1e-6)
    np.testing.assert_allclose(yaw_rate[-1], -0.65, rtol=1e-6)
    assert float(samples(-0.25, 0.0)[0][0]) == -0.25


def test_robot_beyond_its_limits_gets_the_nearest_it_can_reach():
    v, yaw_rate = samples(2.0, 9.0)
    np.testing.assert_allclose(v, np.full(5, 1.8), rtol=1e-6)
    np.testing.assert_allclose(yaw_rate, np.full(7, 8.4), rtol=1e-6)


@many_examples
@given(st.floats(-0.5, 1.5), st.floats(-2.5, 2.5), st.floats(0.01, 0.5))
def test_window_equals_double_precision(v, yaw_rate, dt):
    speeds, yaw_rates = samples(v, yaw_rate, dt)
    np.testing.assert_allclose(speeds, reference.samples(v, 2.0 * dt, -0.25, 1.0, 5), atol=1e-6)
    np.testing.assert_allclose(yaw_rates, reference.samples(yaw_rate, 6.0 * dt, -1.5, 1.5, 7), atol=2e-6)
    assert (np.diff(speeds) >= 0).all()


def test_limits_are_traced_and_vmap_equals_a_loop():
    @jax.jit
    @chex.assert_max_traces(n=1)
    def traced(v, robot):
        return velocity_window(v, jnp.float32(0), robot, jnp.float32(0.1), 3, 3)[0]

    for v_max in (0.5, 0.75, 2.0):
        traced(jnp.float32(0.4), RobotLimits(**(LIMITS | {"v_max": v_max})))
    starts = jnp.float32([-0.25, 0.0, 0.5, 1.0])
    together = jax.vmap(traced, (0, None))(starts, ROBOT)
    for k, start in enumerate(starts):
        np.testing.assert_array_equal(together[k], traced(start, ROBOT))


@pytest.mark.parametrize("changed", [
    {"radius": -0.1},
    {"v_min": 1.5},
    {"v_max": -1.0},
    {"acceleration": 0.0},
    {"yaw_rate_max": float("nan")},
    {"brake": float("inf")},
])
def test_impossible_robots_are_refused(changed):
    with pytest.raises(ValueError, match=next(iter(changed))):
        RobotLimits(**(LIMITS | changed))
