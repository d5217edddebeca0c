"""What becomes of each candidate: where it gets to, how near to obstacles, and when it meets a mover.

Dimension letters: V, N candidates; K predicted points; D discs of the robot.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from adwa_jax.constants import Behaviour
from adwa_jax.footprint import over_discs
from adwa_jax.grid import DistanceField, Scalar, clearance_at
from adwa_jax.obstacles import NOWHERE, Sensed, clearance_to_movers, clearance_to_squares
from adwa_jax.profiles import Profiles
from adwa_jax.rollout import Arcs, Points, Pose, RobotState, points
from adwa_jax.window import RobotLimits


class Prediction(NamedTuple):
    """[V, N] float32 each, but for the headings."""

    headings: jax.Array  # [K, N] after each step of the horizon [rad]
    middle: tuple[jax.Array, jax.Array]  # x, y after half the horizon
    end: Pose  # after the horizon, or where the robot would have touched a static obstacle
    static: jax.Array  # least clearance to statics over the horizon, from the robot's outline [m]
    moving: jax.Array  # least clearance to predicted movers while they are watched, less their margin [m]
    contact_time: jax.Array  # until that clearance falls below 0; the whole watch if it never does [s]


class _Carry(NamedTuple):
    x: jax.Array
    y: jax.Array
    static: jax.Array
    moving: jax.Array
    contact_time: jax.Array


def candidate_clearance(state: RobotState, v: jax.Array, arc: Arcs, field: DistanceField, sensed: Sensed,
                        dt: Scalar) -> jax.Array:
    """[V, N]: least distance [m] of each candidate's K points to known squares, sensed squares and predicted movers.

    Measured from the robot's centre. Points are taken one step at a time: a scan that carries the minima moves fewer
    bytes than one [K, V, N] expression.
    """

    def body_fun(least: jax.Array, point: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, None]:
        reach_x, reach_y, count = point
        x = state.x + v[:, None] * reach_x[None, :]
        y = state.y + v[:, None] * reach_y[None, :]
        static = jnp.minimum(clearance_at(field, x, y), clearance_to_squares(sensed, x, y))
        moving = clearance_to_movers(sensed, x, y, count * dt)
        return jnp.minimum(least, jnp.minimum(static, moving)), None

    count = jnp.arange(1, arc.reach_x.shape[0] + 1, dtype=jnp.float32)
    start = jnp.full((v.shape[0], arc.reach_x.shape[1]), NOWHERE, jnp.float32)
    least, _ = lax.scan(body_fun, start, (arc.reach_x, arc.reach_y, count))
    return least


def predict(state: RobotState, profiles: Profiles, horizon: int, stride: int, field: DistanceField, sensed: Sensed,
            robot: RobotLimits, behaviour: Behaviour, growing_margin: bool, room: jax.Array | None) -> Prediction:
    """Follow every candidate over its K steps, of which the first `horizon` count for its end and static clearance.

    With `room`, [] [m], a candidate stays where it would come nearer than that to a static obstacle; else it drives on
    through it. With `growing_margin` movers are `mover_margin` + `mover_growth` · time larger.
    """
    ahead = points(state.heading, profiles.yaw_rate_ahead, behaviour.dt, stride)
    step = behaviour.dt * stride

    def body_fun(carry: _Carry, row: tuple[Points, jax.Array, jax.Array]) -> tuple[_Carry, tuple]:
        at, v, count = row
        x, y = carry.x + v[:, None] * at.move_x[None, :], carry.y + v[:, None] * at.move_y[None, :]
        here = static_clearance(field, sensed, robot, x, y, at.cosine[None, :], at.sine[None, :])
        static = jnp.minimum(carry.static, here)
        if room is not None:
            free = static > room
            x, y = jnp.where(free, x, carry.x), jnp.where(free, y, carry.y)
        time = count * step
        margin = behaviour.mover_margin + behaviour.mover_growth * time if growing_margin else 0.0
        moving = mover_clearance(sensed, robot, x, y, at.cosine[None, :], at.sine[None, :], time) - margin
        touched = (moving < 0) & (carry.moving >= 0)
        carry = _Carry(x, y, static, jnp.minimum(carry.moving, moving), jnp.where(touched, time, carry.contact_time))
        return carry, (x, y, static)

    steps, v_count = profiles.v_ahead.shape
    shape = (v_count, profiles.yaw_rate_ahead.shape[1])
    rows = (ahead, profiles.v_ahead, jnp.arange(1, steps + 1, dtype=jnp.float32))
    whole = jnp.float32(steps) * step
    begin = _Carry(jnp.broadcast_to(state.x, shape), jnp.broadcast_to(state.y, shape),
                   jnp.full(shape, NOWHERE, jnp.float32), jnp.full(shape, NOWHERE, jnp.float32),
                   jnp.broadcast_to(whole, shape))  # fmt: skip
    last, (x, y, static) = lax.scan(body_fun, begin, rows)
    headings = state.heading + jnp.cumsum(profiles.yaw_rate_ahead[:horizon] * step, axis=0)
    end = Pose(x[horizon - 1], y[horizon - 1], jnp.broadcast_to(headings[-1][None, :], shape))
    half = max(horizon // 2, 1) - 1
    return Prediction(headings, (x[half], y[half]), end, static[horizon - 1], last.moving, last.contact_time)


def static_clearance(field: DistanceField, sensed: Sensed, robot: RobotLimits, x: jax.Array, y: jax.Array,
                     cosine: jax.Array, sine: jax.Array) -> jax.Array:
    """Least clearance [m] of the robot's discs to known squares and sensed squares, as a lower bound.

    Shapes of x, y and of the heading's cosine and sine fit.
    """
    def centred(x: jax.Array, y: jax.Array) -> jax.Array:
        return jnp.minimum(clearance_at(field, x, y), clearance_to_squares(sensed, x, y))

    return over_discs(centred, robot, x, y, cosine, sine)


def clearance_now(state: RobotState, field: DistanceField, sensed: Sensed, robot: RobotLimits) -> jax.Array:
    """[] clearance to statics where the robot is [m]."""
    x, y, heading = (value.reshape(1, 1) for value in (state.x, state.y, state.heading))
    return static_clearance(field, sensed, robot, x, y, jnp.cos(heading), jnp.sin(heading))[0, 0]


def mover_clearance(sensed: Sensed, robot: RobotLimits, x: jax.Array, y: jax.Array, cosine: jax.Array,
                    sine: jax.Array, ahead: jax.Array) -> jax.Array:
    """Least distance [m] from the robot's discs to the movers as predicted `ahead` [s] from now."""
    return over_discs(lambda x, y: clearance_to_movers(sensed, x, y, ahead), robot, x, y, cosine, sine)
