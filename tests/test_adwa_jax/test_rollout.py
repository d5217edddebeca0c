"""Trajectory prediction (eq. 7) against hand-computed arcs and double precision."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adwa_jax.rollout import Pose, cosine_sine, euler_step, points, rollout
from tests.reference import dwa as reference
from tests.test_adwa_jax.worlds import many_examples

STEPS = 8
predict = jax.jit(rollout, static_argnames="steps")


def pose(x, y, heading):
    return Pose(jnp.float32(x), jnp.float32(y), jnp.float32(heading))


def predicted(start, v, yaw_rate, dt):
    """[K, V, N, 3] poses."""
    poses = predict(pose(*start), jnp.float32(v), jnp.float32(yaw_rate), jnp.float32(dt), steps=STEPS)
    return np.stack(poses, axis=-1)


def test_straight_line():
    poses = predicted((1.0, 2.0, math.pi / 2), [0.5], [0.0], 0.1)[:, 0, 0]
    np.testing.assert_allclose(poses[:, 0], 1.0, atol=1e-6)
    np.testing.assert_allclose(poses[:, 1], 2.0 + 0.05 * np.arange(1, 9), rtol=1e-6)
    np.testing.assert_allclose(poses[:, 2], math.pi / 2, rtol=1e-6)


def test_quarter_turns_walk_round_a_square():
    # 90° a step: Euler moves first and turns after, so four steps of 1 m come back to the start.
    poses = predicted((0.0, 0.0, 0.0), [2.0], [math.pi], 0.5)[:, 0, 0]
    np.testing.assert_allclose(poses[:4, :2], [(1, 0), (1, 1), (0, 1), (0, 0)], atol=1e-6)
    np.testing.assert_allclose(poses[:4, 2], np.arange(1, 5) * math.pi / 2, rtol=1e-6)


def test_chords_of_a_right_hand_arc():
    # -60° a step from heading 60°: directions 60°, 0°, -60°, then -120°, ...: a hexagon's corners.
    poses = predicted((0.0, 0.0, math.pi / 3), [1.0], [-math.pi / 3], 1.0)[:, 0, 0]
    high = math.sqrt(3) / 2
    corners = [(0.5, high), (1.5, high), (2, 0), (1.5, -high), (0.5, -high), (0, 0)]
    np.testing.assert_allclose(poses[:6, :2], corners, atol=2e-6)


def test_standing_still_and_reversing():
    poses = predicted((1.0, 1.0, 0.0), [0.0, -1.0], [0.0, 1.0], 0.1)
    np.testing.assert_allclose(poses[:, 0, :, :2], 1.0)
    np.testing.assert_allclose(poses[-1, 1, 0], (0.2, 1.0, 0.0), atol=1e-6)
    np.testing.assert_allclose(poses[-1, 0, 1, 2], 0.8, rtol=1e-6)


speeds = st.floats(-1, 2, width=32)


@many_examples
@given(st.tuples(*[st.floats(-20, 20, width=32)] * 3), st.tuples(speeds, speeds), st.tuples(speeds, speeds, speeds))
def test_every_candidate_equals_double_precision(start, v, yaw_rate):
    poses = predicted(start, v, yaw_rate, 0.25)
    for i, each_v in enumerate(v):
        for j, each_yaw in enumerate(yaw_rate):
            expected = reference.rollout(start, each_v, each_yaw, 0.25, STEPS)
            np.testing.assert_allclose(poses[:, i, j], expected, atol=3e-5)


def test_prediction_is_the_repeated_step():
    start, v, yaw_rate, dt = pose(3.0, -1.0, 0.7), jnp.float32(0.8), jnp.float32(-0.9), jnp.float32(0.1)
    step = jax.jit(euler_step)
    poses = predicted((3.0, -1.0, 0.7), [0.8], [-0.9], 0.1)[:, 0, 0]
    for expected in poses:
        start = step(start, v, yaw_rate, dt)
        np.testing.assert_allclose(np.stack(start), expected, atol=2e-6)


def test_vmap_over_poses_equals_a_loop():
    starts = Pose(*jnp.float32([[0, 1, 2], [5, 4, 3], [0, 2, -1]]))
    v, yaw_rate = jnp.float32([0.5, 1.0]), jnp.float32([-1.0, 0.0, 1.0])
    together = jax.jit(jax.vmap(lambda start: rollout(start, v, yaw_rate, jnp.float32(0.1), STEPS)))(starts)
    for k in range(3):
        alone = predict(Pose(*(leaf[k] for leaf in starts)), v, yaw_rate, jnp.float32(0.1), steps=STEPS)
        for lane, single in zip(together, alone, strict=True):
            np.testing.assert_allclose(lane[k], single, atol=1e-6)


def test_gradients_by_hand():
    def end_x(v, yaw_rate):
        return rollout(pose(0, 0, 0), v[None], yaw_rate[None], jnp.float32(0.5), 2).x[-1, 0, 0]

    # x = v/2 + v/2 · cos(yaw/2): ∂x/∂v = 1/2 + cos(0.4)/2, ∂x/∂yaw = -v/4 · sin(0.4)
    slopes = jax.jit(jax.grad(end_x, argnums=(0, 1)))(jnp.float32(1.0), jnp.float32(0.8))
    assert float(slopes[0]) == pytest.approx(0.5 + 0.5 * math.cos(0.4), rel=1e-5)
    assert float(slopes[1]) == pytest.approx(-0.25 * math.sin(0.4), rel=1e-5)


follow = jax.jit(points, static_argnames="stride")
profile = st.lists(st.floats(-1.5, 1.5), min_size=STEPS, max_size=STEPS)


@many_examples
@given(st.floats(-4, 4), profile)
def test_points_of_a_yaw_rate_profile_are_euler_steps(heading, yaw_rates):
    found = follow(jnp.float32(heading), jnp.float32(yaw_rates)[:, None], jnp.float32(0.1))
    x = y = 0.0
    for k, yaw_rate in enumerate(yaw_rates):
        ((dx, dy, heading),) = reference.rollout((0.0, 0.0, heading), 1.0, yaw_rate, 0.1, 1)
        x, y = x + dx, y + dy
        np.testing.assert_allclose([found.move_x[k, 0], found.move_y[k, 0]], [dx, dy], atol=2e-6)
        np.testing.assert_allclose([found.cosine[k, 0], found.sine[k, 0]], [math.cos(heading), math.sin(heading)],
                                   atol=1e-5)
    np.testing.assert_allclose([found.move_x.sum(), found.move_y.sum()], [x, y], atol=1e-5)


@many_examples
@given(st.floats(-4, 4), profile)
def test_double_steps_are_two_euler_steps_but_for_the_bend_between_them(heading, yaw_rates):
    found = follow(jnp.float32(heading), jnp.float32(yaw_rates)[:, None], jnp.float32(0.1), stride=2)
    off = 0.0
    for k, yaw_rate in enumerate(yaw_rates):
        *_, (x, y, heading) = reference.rollout((0.0, 0.0, heading), 1.0, yaw_rate, 0.1, 2)
        # Two steps of 0.1 at an angle a to each other reach 0.2 cos(a / 2), in the direction of a single one of 0.2.
        bend = 0.2 * (1 - math.cos(yaw_rate * 0.1 / 2))
        off = max(off, math.dist((x, y), (found.move_x[k, 0], found.move_y[k, 0])) - bend)
        np.testing.assert_allclose([found.cosine[k, 0], found.sine[k, 0]], [math.cos(heading), math.sin(heading)],
                                   atol=1e-5)
    assert off < 2e-6


def test_cosine_and_sine_of_headings_of_some_turns():
    angle = np.concatenate([np.linspace(-20.0, 20.0, 4001), np.arange(-6, 7) * np.pi / 2]).astype(np.float32)
    cosine, sine = jax.jit(cosine_sine)(angle)
    np.testing.assert_allclose(cosine, np.cos(angle.astype(float)), atol=1.5e-6)  # as exact as the angles' own steps
    np.testing.assert_allclose(sine, np.sin(angle.astype(float)), atol=1.5e-6)
    near = np.abs(angle) < 3.1
    np.testing.assert_allclose(cosine[near], np.cos(angle[near].astype(float)), atol=5e-7)
    np.testing.assert_allclose(sine[near], np.sin(angle[near].astype(float)), atol=5e-7)
    slopes = jax.vmap(jax.grad(lambda angle: sum(cosine_sine(angle))))(jnp.asarray(angle))
    np.testing.assert_allclose(slopes, np.cos(angle.astype(float)) - np.sin(angle.astype(float)), atol=1e-5)
