"""Trajectory prediction at constant velocity, forward Euler as printed (eq. 7)."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from adwa_jax.grid import Scalar

# sin(h) = h · Σ SINE[i] · h²ⁱ and cos(h) = Σ COSINE[i] · h²ⁱ for h in [−π/2, π/2]: interpolated at Chebyshev's points
# of h², within 5e-9 and 5e-8.
SINE = (0.999999996, -0.166666579, 0.00833305009, -0.000198090111, 2.60509296e-06)
COSINE = (0.999999953, -0.499999047, 0.0416635722, -0.00138536226, 2.31522567e-05)


class Pose(NamedTuple):
    """Position and heading; arrays of one shape."""

    x: jax.Array  # [m]
    y: jax.Array  # [m]
    heading: jax.Array  # [rad]


class RobotState(NamedTuple):
    """Pose and present velocities, [] float32 each."""

    x: jax.Array  # [m]
    y: jax.Array  # [m]
    heading: jax.Array  # [rad]
    v: jax.Array  # [m/s]
    yaw_rate: jax.Array  # [rad/s]


class Arcs(NamedTuple):
    """The predicted points of all candidates; those of one yaw rate lie on rays: x = x₀ + v · reach_x."""

    reach_x: jax.Array  # [K, N] float32, x covered after k steps at 1 m/s [s]
    reach_y: jax.Array  # [K, N] float32
    heading: jax.Array  # [K, N] float32 [rad]


def euler_step(pose: Pose, v: jax.Array, yaw_rate: jax.Array, dt: Scalar) -> Pose:
    """x + v·cosθ·dt, y + v·sinθ·dt, θ + yaw_rate·dt (eq. 7). Any equal shapes."""
    return Pose(
        x=pose.x + v * jnp.cos(pose.heading) * dt,
        y=pose.y + v * jnp.sin(pose.heading) * dt,
        heading=pose.heading + yaw_rate * dt,
    )


def wrap(angle: jax.Array) -> jax.Array:
    """The same angle in [−π, π) [rad]."""
    return angle - 2.0 * jnp.pi * jnp.floor(angle / (2.0 * jnp.pi) + 0.5)


def arcs(heading: jax.Array, yaw_rate: jax.Array, dt: Scalar, steps: int) -> Arcs:
    """The K = `steps` points after each Euler step (eq. 7) for N yaw rates, per unit of speed.

    Σ v·cosθ·dt = v · Σ cosθ·dt: all speeds share the sums. Headings are turned step by step, which takes one sine and
    cosine a yaw rate. Unbatched. yaw_rate: [N] [rad/s]; heading [rad], dt [s]: [], or [N] as of robots side by side.
    """
    turn_cosine, turn_sine = jnp.cos(yaw_rate * dt), jnp.sin(yaw_rate * dt)

    def body_fun(carry: tuple, _: None) -> tuple[tuple, tuple]:
        x, y, cosine, sine = carry
        x, y = x + cosine * dt, y + sine * dt
        turned = cosine * turn_cosine - sine * turn_sine, sine * turn_cosine + cosine * turn_sine
        return (x, y, *turned), (x, y)

    nothing = jnp.zeros_like(yaw_rate)
    begin = nothing, nothing, jnp.cos(heading) + nothing, jnp.sin(heading) + nothing
    _, (reach_x, reach_y) = lax.scan(body_fun, begin, None, length=steps)
    count = jnp.arange(1, steps + 1, dtype=jnp.float32)[:, None]
    heading, dt = (jnp.broadcast_to(value, yaw_rate.shape)[None, :] for value in (heading, dt))
    return Arcs(reach_x, reach_y, heading + count * yaw_rate[None, :] * dt)


def rollout(pose: Pose, v: jax.Array, yaw_rate: jax.Array, dt: Scalar, steps: int) -> Pose:
    """Predicted poses [K, V, N] of every pair of V speeds and N yaw rates. Unbatched; pose fields []."""
    arc = arcs(pose.heading, yaw_rate, dt, steps)
    shape = (steps, v.shape[0], yaw_rate.shape[0])
    return Pose(
        x=pose.x + v[None, :, None] * arc.reach_x[:, None, :],
        y=pose.y + v[None, :, None] * arc.reach_y[:, None, :],
        heading=jnp.broadcast_to(arc.heading[:, None, :], shape),
    )


class Points(NamedTuple):
    """Predicted poses one step after another; headings are shared by all speeds."""

    move_x: jax.Array  # [K, N] float32, x covered in the step at 1 m/s [s]
    move_y: jax.Array  # [K, N] float32
    cosine: jax.Array  # [K, N] float32, of the heading after the step
    sine: jax.Array  # [K, N] float32


def points(heading: jax.Array, yaw_rate_ahead: jax.Array, dt: Scalar, stride: int = 1) -> Points:
    """Headings over K predicted steps of `stride` control steps each, for N yaw-rate profiles [K, N] [rad/s].

    A step stands for `stride` Euler steps (eq. 7) along their mean heading; with stride 1 it is one. Unbatched.
    """
    turned = jnp.cumsum(yaw_rate_ahead * (stride * dt), axis=0)
    after = heading + turned
    along = after - yaw_rate_ahead * (dt * ((stride + 1) / 2))
    (move_x, move_y), (cosine, sine) = cosine_sine(along), cosine_sine(after)
    return Points(move_x * (stride * dt), move_y * (stride * dt), cosine, sine)


def cosine_sine(angle: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Of angles up to some turns [rad], within 5e-7: a tenth of the library's cost, which suits any angle."""
    half = 0.5 * wrap(angle)  # in [−π/2, π/2], where few terms do
    squared = half * half
    sine, cosine = half * _series(SINE, squared), _series(COSINE, squared)
    return 1.0 - 2.0 * sine * sine, 2.0 * sine * cosine


def _series(coefficients: tuple[float, ...], value: jax.Array) -> jax.Array:
    total = jnp.full_like(value, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        total = total * value + coefficient
    return total
