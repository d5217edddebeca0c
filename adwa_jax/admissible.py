"""Which candidates the robot may take: the paper's rule, and the rule that it can still stop."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from adwa_jax.constants import Behaviour
from adwa_jax.grid import DistanceField
from adwa_jax.obstacles import Sensed
from adwa_jax.prediction import follow
from adwa_jax.profiles import Begins, Profiles, halting_profiles
from adwa_jax.rollout import RobotState
from adwa_jax.window import RobotLimits


class Halt(NamedTuple):
    """[V, N]: what the robot meets when it takes one step of a command and then brakes to a halt."""

    clear_of_statics: jax.Array  # bool
    static: jax.Array  # float32, least clearance to statics [m]
    moving: jax.Array  # float32, least clearance to predicted movers, less their margin [m]


def is_admissible(clearance: jax.Array, v: jax.Array, yaw_rate: jax.Array, robot: RobotLimits) -> jax.Array:
    """[V, N] bool: clearance > 0, |v| ≤ √(2·clearance·brake) and |yaw rate| ≤ √(2·clearance·yaw_brake) (§3).

    The robot can stop within the room it has; in reverse too.
    """
    room = 2.0 * jnp.maximum(clearance, 0.0)
    stops = (v * v)[:, None] <= room * robot.brake
    stops &= (yaw_rate * yaw_rate)[None, :] <= room * robot.yaw_brake
    return (clearance > 0) & stops


def room_to_stop(clearance: jax.Array, v: jax.Array, yaw_rate: jax.Array, robot: RobotLimits) -> jax.Array:
    """[V, N] clearance less what it takes to stop [m]: the same rule as a length, below 0 where it is broken."""
    braking = (v * v)[:, None] / (2.0 * robot.brake)
    return clearance - jnp.maximum(braking, (yaw_rate * yaw_rate)[None, :] / (2.0 * robot.yaw_brake))


def halts_clear(state: RobotState, profiles: Profiles, field: DistanceField, sensed: Sensed, robot: RobotLimits,
                behaviour: Behaviour, steps: int, growing_margin: bool, room: jax.Array,
                begins: Begins | None = None) -> Halt:
    """Whether the robot can still stop clear of everything after one step of each command (`rules.stopping`).

    The braking trajectory keeps more than `room`, [] [m], from statics. What is admissible leaves an admissible command
    for the next step: to go on braking. `steps` control steps are followed. What candidates that begin alike meet is
    worked out once; without `begins` none are alike.
    """
    begins = begins or Begins(((0, profiles.v.shape[0]),), ((0, profiles.yaw_rate.shape[0]),))
    v, yaw_rate = profiles.v[: begins.v[0][1]], profiles.yaw_rate[: begins.yaw_rate[0][1]]
    halting = halting_profiles(v, yaw_rate, robot, behaviour.dt, steps)
    through = jnp.float32(-jnp.inf)  # it is judged by the whole way
    (leg,), met = follow(state, halting, 1, (steps,), field, sensed, robot, behaviour, growing_margin, through)
    static, moving = begins.each(leg.static), begins.each(met.moving)
    return Halt(static > room, static, moving)
