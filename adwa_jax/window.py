"""The velocities the robot can reach in one control step (eq. 6)."""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp

from adwa_jax.checks import require, require_numbers
from adwa_jax.grid import Scalar
from adwa_jax.native import whole


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["radius", "v_min", "v_max", "yaw_rate_max", "acceleration", "yaw_acceleration", "brake", "yaw_brake",
                 "disc_offsets"],
    meta_fields=[],
)
@dataclass(frozen=True)
class RobotLimits:
    """A robot's size and limits: one disc, or several along its x axis that cover it (`footprint`). Traced."""

    radius: Scalar  # of each disc [m]
    v_min: Scalar  # [m/s]; negative: may reverse
    v_max: Scalar  # [m/s]
    yaw_rate_max: Scalar  # [rad/s], both ways
    acceleration: Scalar  # [m/s²], bounds the window
    yaw_acceleration: Scalar  # [rad/s²]
    brake: Scalar  # [m/s²], what admissibility counts on
    yaw_brake: Scalar  # [rad/s²]
    disc_offsets: tuple[Scalar, ...] = (0.0,)  # of the discs' centres, ahead of the robot's centre [m]; D of them

    def __post_init__(self) -> None:
        """Refuse limits no robot can have; traced values pass unseen."""
        if not require_numbers(self, least=-100.0):
            return
        require(self.radius >= 0, "radius", float(self.radius), "must be ≥ 0", "set it in metres")
        for name in ("v_max", "yaw_rate_max", "acceleration", "yaw_acceleration", "brake", "yaw_brake"):
            value = getattr(self, name)
            require(value > 0, name, float(value), "must be positive", "set it in SI units")
        require(len(self.disc_offsets) > 1 or self.disc_offsets == (0.0,), "disc_offsets", self.disc_offsets,
                "a single disc is centred on the robot", "set it to (0.0,)")
        require(self.v_min <= self.v_max, "v_min", float(self.v_min), f"must not exceed v_max = {self.v_max:g}",
                "lower it")


def velocity_window(v: jax.Array, yaw_rate: jax.Array, robot: RobotLimits, dt: Scalar, v_samples: int,
                    yaw_rate_samples: int) -> tuple[jax.Array, jax.Array]:
    """[V] speeds and [N] yaw rates: [v ± a·dt] ∩ [v_min, v_max] and likewise the yaw rate, evenly, ends included.

    Where the limits leave nothing (the robot is faster than v_max allows), the reachable value nearest to them is all.
    Unbatched. v [m/s], yaw_rate [rad/s], dt [s]: [] float32.
    """
    v_reach, yaw_reach = robot.acceleration * dt, robot.yaw_acceleration * dt
    speeds = _samples(v, v_reach, robot.v_min, robot.v_max, v_samples)
    yaw_rates = _samples(yaw_rate, yaw_reach, -robot.yaw_rate_max, robot.yaw_rate_max, yaw_rate_samples)
    return speeds, yaw_rates


def _samples(value: jax.Array, reach: Scalar, least: Scalar, most: Scalar,
             count: int) -> jax.Array:
    # A robot already beyond its limits gets the one value that brings it nearest to them.
    low = jnp.clip(least, value - reach, value + reach)
    high = jnp.clip(most, value - reach, value + reach)
    # As changes of the present value, each of which is rounded once: speeds are sums of hundreds of them.
    down, up = jnp.clip(least - value, -reach, reach), jnp.clip(most - value, -reach, reach)
    share = jnp.arange(count, dtype=jnp.float32) / max(count - 1, 1)
    change = whole(lambda: down * (1.0 - share) + up * share)  # once: a command is one of its samples to the last bit
    return jnp.clip(value + change, low, high)
