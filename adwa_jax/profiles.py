"""Candidate generators: what velocities a candidate commands over the predicted time.

Candidates are pairs of one of V speed profiles and one of N yaw-rate profiles, so that the predicted points share
headings along V and speeds along N. Dimension letters: V, N; K predicted points, `stride` control steps apart.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from adwa_jax.grid import Scalar
from adwa_jax.window import RobotLimits

Runs = tuple[tuple[int, int], ...]


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


class Begins(NamedTuple):
    """Which candidates begin with the same command. The first of V and of N are distinct; runs (begin, end) of them,
    one after another, are the commands of all, and the first run is the distinct ones themselves.
    """

    v: Runs
    yaw_rate: Runs

    def each(self, values: jax.Array) -> jax.Array:
        """[V, N] values of all candidates from those of the distinct commands."""
        for axis, runs in enumerate(self):
            values = jnp.concatenate([lax.slice_in_dim(values, *run, axis=axis) for run in runs], axis=axis)
        return values


def window_profiles(v: jax.Array, yaw_rate: jax.Array, steps: int, turn_step: int, second_phase: bool) -> Profiles:
    """The window's velocities (eq. 6), held over `steps` predicted steps, changed at once. v: [V], yaw_rate: [N]."""
    speeds = speed_targets(v, jnp.clip(0.0, v[0], v[-1]), v[-1], second_phase)
    turns = turn_targets(yaw_rate, second_phase)
    early = (jnp.arange(steps) < turn_step)[:, None]
    return Profiles(speeds.first, turns.first, jnp.where(early, speeds.first[None, :], speeds.second[None, :]),
                    jnp.where(early, turns.first[None, :], turns.second[None, :]))


def ramped_profiles(v: jax.Array, yaw_rate: jax.Array, speeds: Targets, turns: Targets, robot: RobotLimits,
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


def speeds_over_range(robot: RobotLimits, samples: int, reverse: bool) -> jax.Array:
    """Speeds [m/s]: `samples` from 0 to v_max; with `reverse` also v_min, as the last."""
    share = jnp.arange(samples, dtype=jnp.float32) / (samples - 1)
    back = [jnp.full((1,), robot.v_min, jnp.float32)] if reverse else []
    return jnp.concatenate([share * robot.v_max, *back])


def yaw_rates_over_range(robot: RobotLimits, samples: int) -> jax.Array:
    """[N] yaw rates [rad/s] over the whole range; an odd number of `samples` makes the middle one 0."""
    share = jnp.arange(samples, dtype=jnp.float32) * (2.0 / (samples - 1)) - 1.0
    return share * robot.yaw_rate_max


def speed_targets(held: jax.Array, halt: jax.Array, full: jax.Array, second_phase: bool) -> Targets:
    """Speeds [A] held; with a second phase also `full` speed, [], then `halt`, [], and the other way round. [m/s]."""
    if not second_phase:
        return Targets(held, held)
    full_halt = jnp.stack([full, halt])
    return Targets(jnp.concatenate([held, full_halt]), jnp.concatenate([held, full_halt[::-1]]))


def turn_targets(held: jax.Array, second_phase: bool) -> Targets:
    """Yaw rates [A] held; with a second phase each but the middle one also followed by straight on, and by the other
    way. [rad/s].
    """
    if not second_phase:
        return Targets(held, held)
    half = held.shape[0] // 2
    turning = jnp.concatenate([held[:half], held[half + 1 :]])
    return Targets(jnp.concatenate([held, turning, turning]),
                   jnp.concatenate([held, jnp.zeros_like(turning), -turning]))


def turns_begin(held: int) -> Runs:
    """Which of so many yaw rates held those of `turn_targets` with a second phase begin with."""
    half = held // 2
    return ((0, held), *((0, half), (half + 1, held)) * 2)


def halting_profiles(v: jax.Array, yaw_rate: jax.Array, robot: RobotLimits, dt: Scalar, steps: int) -> Profiles:
    """One control step of each command, [V] and [N], then braking to a halt within the acceleration limits."""
    later = jnp.arange(steps, dtype=jnp.float32)[:, None] * dt
    v_row, yaw_row = v[None, :], yaw_rate[None, :]
    return Profiles(v, yaw_rate, approached(v_row, jnp.zeros_like(v_row), robot.acceleration * later),
                    approached(yaw_row, jnp.zeros_like(yaw_row), robot.yaw_acceleration * later))


def approached(value: jax.Array, target: jax.Array, reach: Scalar) -> jax.Array:
    """The value moved towards the target by at most `reach`."""
    return value + jnp.clip(target - value, -reach, reach)


def _ramp(value: jax.Array, targets: Targets, reach: Scalar, steps: int, stride: int, turn_step: int) -> jax.Array:
    """[K, A]: the mean velocity during each predicted step; reach: [] what one control step can change."""
    step = jnp.arange(1, steps + 1, dtype=jnp.float32)[:, None]
    lag = (stride - 1) / 2  # a predicted step stands for `stride` control steps, on average that much earlier
    before, after = targets.first[None, :], targets.second[None, :]
    first = approached(value, before, reach * (step * stride - lag))
    turned = approached(value, before, reach * (turn_step * stride))
    second = approached(turned, after, jnp.maximum(reach * ((step - turn_step) * stride - lag), 0.0))
    return jnp.where(step <= turn_step, first, second)
