"""Candidate generators: what velocities a candidate commands over the predicted time.

Candidates are pairs of one of V speed profiles and one of N yaw-rate profiles, so that the predicted points share
headings along V and speeds along N. Dimension letters: V, N; K predicted points, `stride` control steps apart.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from adwa_jax.grid import Scalar
from adwa_jax.window import RobotLimits


class Profiles(NamedTuple):
    """Velocities commanded, and reached over time."""

    v: jax.Array  # [V] float32, commanded for the next control step [m/s]
    yaw_rate: jax.Array  # [N] float32 [rad/s]
    v_ahead: jax.Array  # [K, V] float32, during each predicted step [m/s]
    yaw_rate_ahead: jax.Array  # [K, N] float32 [rad/s]


class Targets(NamedTuple):
    """Velocities to approach: one before the turning step, one from then on."""

    first: jax.Array  # [A] float32
    second: jax.Array  # [A] float32


def constant_profiles(v: jax.Array, yaw_rate: jax.Array, steps: int) -> Profiles:
    """The window's velocities (eq. 6), held over `steps` predicted steps. v: [V], yaw_rate: [N]."""
    return Profiles(v, yaw_rate, jnp.broadcast_to(v, (steps, *v.shape)),
                    jnp.broadcast_to(yaw_rate, (steps, *yaw_rate.shape)))


def two_phase_profiles(v: jax.Array, yaw_rate: jax.Array, speeds: Targets, turns: Targets, robot: RobotLimits,
                       dt: Scalar, steps: int, stride: int, turn_step: int) -> Profiles:
    """Targets approached from the present velocities within the acceleration limits (`rules.ramp`).

    v [m/s], yaw_rate [rad/s], dt [s]: []; speeds of V targets, turns of N.
    """
    return Profiles(
        v=approached(v, speeds.first, robot.acceleration * dt),
        yaw_rate=approached(yaw_rate, turns.first, robot.yaw_acceleration * dt),
        v_ahead=_ramp(v, speeds, robot.acceleration * dt, steps, stride, turn_step),
        yaw_rate_ahead=_ramp(yaw_rate, turns, robot.yaw_acceleration * dt, steps, stride, turn_step),
    )


def speed_targets(robot: RobotLimits, samples: int, second_phase: bool, reverse: bool) -> Targets:
    """Speeds [m/s]: `samples` from 0 to v_max, held; with a second phase also full speed then halt, and halt then full
    speed; with `reverse` also v_min, held.
    """
    share = jnp.arange(samples, dtype=jnp.float32) / (samples - 1)
    full, halt, back = (jnp.full((1,), speed, jnp.float32) for speed in (robot.v_max, 0.0, robot.v_min))
    first, second = [share * robot.v_max], [share * robot.v_max]
    if second_phase:
        first, second = [*first, full, halt], [*second, halt, full]
    if reverse:
        first, second = [*first, back], [*second, back]
    return Targets(jnp.concatenate(first), jnp.concatenate(second))


def turn_targets(robot: RobotLimits, samples: int, second_phase: bool) -> Targets:
    """Yaw rates [rad/s]: `samples` (odd: one is 0) over the whole range, held; with a second phase each but 0 also
    followed by straight on, and by the other way.
    """
    half = samples // 2
    share = jnp.arange(-half, half + 1, dtype=jnp.float32) / half
    held = share * robot.yaw_rate_max
    if not second_phase:
        return Targets(held, held)
    turning = jnp.concatenate([held[:half], held[half + 1 :]])
    return Targets(jnp.concatenate([held, turning, turning]),
                   jnp.concatenate([held, jnp.zeros_like(turning), -turning]))


def halting_profiles(v: jax.Array, yaw_rate: jax.Array, robot: RobotLimits, dt: Scalar, steps: int) -> Profiles:
    """One control step of each command, then braking to a halt within the acceleration limits. v: [V], yaw_rate: [N]."""
    later = jnp.arange(steps, dtype=jnp.float32)[:, None] * dt
    v_row, yaw_row = v[None, :], yaw_rate[None, :]
    return Profiles(v, yaw_rate, approached(v_row, jnp.zeros_like(v_row), robot.acceleration * later),
                    approached(yaw_row, jnp.zeros_like(yaw_row), robot.yaw_acceleration * later))


def approached(value: jax.Array, target: jax.Array, reach: Scalar) -> jax.Array:
    """The value moved towards the target by at most `reach`."""
    return value + jnp.clip(target - value, -reach, reach)


def _ramp(value: jax.Array, targets: Targets, reach: jax.Array, steps: int, stride: int, turn_step: int) -> jax.Array:
    """[K, A]: the mean velocity during each predicted step; reach: [] what one control step can change."""
    step = jnp.arange(1, steps + 1, dtype=jnp.float32)[:, None]
    lag = (stride - 1) / 2  # a predicted step stands for `stride` control steps, on average that much earlier
    before, after = targets.first[None, :], targets.second[None, :]
    first = approached(value, before, reach * (step * stride - lag))
    turned = approached(value, before, reach * (turn_step * stride))
    second = approached(turned, after, jnp.maximum(reach * ((step - turn_step) * stride - lag), 0.0))
    return jnp.where(step <= turn_step, first, second)
