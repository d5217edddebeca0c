"""Which candidates the robot may take: the paper's rule, and the rule that it can still stop."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from adwa_jax.constants import Behaviour
from adwa_jax.grid import DistanceField
from adwa_jax.obstacles import NOWHERE, Sensed
from adwa_jax.prediction import mover_clearance, static_clearance
from adwa_jax.profiles import Profiles, halting_profiles
from adwa_jax.rollout import Points, RobotState, points
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
                behaviour: Behaviour, steps: int, growing_margin: bool, room: jax.Array) -> Halt:
    """Whether the robot can still stop clear of everything after one step of each command (`rules.stopping`).

    The braking trajectory keeps more than `room`, [] [m], from statics. What is admissible leaves an admissible command
    for the next step: to go on braking. `steps` control steps are followed.
    """
    halting = halting_profiles(profiles.v, profiles.yaw_rate, robot, behaviour.dt, steps)
    ahead = points(state.heading, halting.yaw_rate_ahead, behaviour.dt)

    def body_fun(carry: tuple, row: tuple[Points, jax.Array, jax.Array]) -> tuple[tuple, None]:
        x, y, static, moving = carry
        at, v, count = row
        x, y = x + v[:, None] * at.move_x[None, :], y + v[:, None] * at.move_y[None, :]
        cosine, sine, time = at.cosine[None, :], at.sine[None, :], count * behaviour.dt
        margin = behaviour.mover_margin + behaviour.mover_growth * time if growing_margin else 0.0
        static = jnp.minimum(static, static_clearance(field, sensed, robot, x, y, cosine, sine))
        moving = jnp.minimum(moving, mover_clearance(sensed, robot, x, y, cosine, sine, time) - margin)
        return (x, y, static, moving), None

    shape = (profiles.v.shape[0], profiles.yaw_rate.shape[0])
    nowhere = jnp.full(shape, NOWHERE, jnp.float32)
    rows = (ahead, halting.v_ahead, jnp.arange(1, steps + 1, dtype=jnp.float32))
    begin = (jnp.broadcast_to(state.x, shape), jnp.broadcast_to(state.y, shape), nowhere, nowhere)
    (_, _, static, moving), _ = lax.scan(body_fun, begin, rows)
    return Halt(static > room, static, moving)
