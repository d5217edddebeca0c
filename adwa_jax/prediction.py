"""What becomes of each candidate: where it gets to, how near to obstacles, and when it meets a mover.

Dimension letters: V, N candidates; K predicted points; D discs of the robot.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from adwa_jax.constants import Behaviour
from adwa_jax.footprint import over_discs
from adwa_jax.grid import BILINEAR_EXCESS, DistanceField, Scalar, bilinear, clearance_at, lesser
from adwa_jax.obstacles import (
    BLOCK,
    NOWHERE,
    Sensed,
    clearance_to_movers,
    clearance_to_squares,
    over_blocks,
    predicted_centres,
)
from adwa_jax.profiles import Profiles
from adwa_jax.rollout import Arcs, Points, Pose, RobotState, points
from adwa_jax.window import RobotLimits

VECTOR = 8  # yaw rates taken at once: candidates of one speed lie side by side in memory


class Prediction(NamedTuple):
    """[V, N] float32 each, but for the headings."""

    headings: jax.Array  # [K, N] after each step of the horizon [rad]
    middle: tuple[jax.Array, jax.Array]  # x, y after half the horizon
    end: Pose  # after the horizon, or where the robot would have touched a static obstacle; heading [1, N]
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
    n_count = arc.reach_x.shape[1]
    arc = _whole_vectors(arc)
    to_known = _to_known(state, v, arc, field)
    to_squares = _to_squares(state, v, arc, sensed, to_known)
    return _to_movers(state, v, arc, sensed, dt, to_squares)[:, :n_count]


def _to_known(state: RobotState, v: jax.Array, arc: Arcs, field: DistanceField) -> jax.Array:
    """[V, N] least clearance to the squares of the map: `clearance_at` of all points."""

    def body_fun(least: jax.Array, reach: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, None]:
        x = state.x + v[:, None] * reach[0][None, :]
        y = state.y + v[:, None] * reach[1][None, :]
        return lesser(least, bilinear(field, x, y)), None

    start = jnp.full(_shape(v, arc), NOWHERE, jnp.float32)
    return lax.scan(body_fun, start, (arc.reach_x, arc.reach_y))[0] - BILINEAR_EXCESS * field.spacing


def _to_squares(state: RobotState, v: jax.Array, arc: Arcs, sensed: Sensed, least: jax.Array) -> jax.Array:
    """[V, N] `least`, or the distance to a known square where that is less.

    Of the distances along a candidate's points only the least needs a root.
    """

    def block(indices: jax.Array, least: jax.Array) -> jax.Array:
        from_centre, half_width = _offset(state, sensed.square_centre[indices]), sensed.square_half_width[indices]

        def body_fun(least: tuple, reach: tuple[jax.Array, jax.Array]) -> tuple[tuple, None]:
            move_x, move_y = v[:, None] * reach[0][None, :], v[:, None] * reach[1][None, :]

            def squared(place: int) -> jax.Array:
                dx = jnp.maximum(jnp.abs(from_centre[place, 0] + move_x) - half_width[place], 0.0)
                dy = jnp.maximum(jnp.abs(from_centre[place, 1] + move_y) - half_width[place], 0.0)
                return dx * dx + dy * dy

            return tuple(lesser(so_far, squared(place)) for place, so_far in enumerate(least)), None

        squared, _ = lax.scan(body_fun, _far(v, arc), (arc.reach_x, arc.reach_y))
        return _least_root(squared, sensed.square_known[indices], sensed.square_rounding[indices], least)

    return over_blocks(block, sensed.square_known.shape[0], sensed.square_count, least)


def _to_movers(state: RobotState, v: jax.Array, arc: Arcs, sensed: Sensed, dt: Scalar,
               least: jax.Array) -> jax.Array:
    """[V, N] `least`, or the distance to a seen mover at the time of a point where that is less."""
    if not sensed.seen.size:
        return least
    times = jnp.arange(1, arc.reach_x.shape[0] + 1, dtype=jnp.float32) * dt
    from_centre = _offset(state, jax.vmap(lambda ahead: predicted_centres(sensed, ahead))(times))  # [K, M, 2]

    def block(indices: jax.Array, least: jax.Array) -> jax.Array:
        def body_fun(least: tuple, row: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[tuple, None]:
            from_centre, reach_x, reach_y = row

            def squared(place: int) -> jax.Array:
                dx = from_centre[place, 0] + v[:, None] * reach_x[None, :]
                dy = from_centre[place, 1] + v[:, None] * reach_y[None, :]
                return dx * dx + dy * dy

            return tuple(lesser(so_far, squared(place)) for place, so_far in enumerate(least)), None

        squared, _ = lax.scan(body_fun, _far(v, arc), (from_centre[:, indices], arc.reach_x, arc.reach_y))
        return _least_root(squared, sensed.seen[indices], sensed.radius[indices], least)

    return over_blocks(block, sensed.seen.shape[0], sensed.mover_count, least)


def _offset(state: RobotState, places: jax.Array) -> jax.Array:
    """The robot's position as seen from places [..., 2]."""
    return jnp.stack([state.x - places[..., 0], state.y - places[..., 1]], axis=-1)


def _far(v: jax.Array, arc: Arcs) -> tuple[jax.Array, ...]:
    """Squared distances to BLOCK obstacles, none of them near."""
    return (jnp.full(_shape(v, arc), NOWHERE * NOWHERE, jnp.float32),) * BLOCK


def _whole_vectors(arc: Arcs) -> Arcs:
    """Yaw rates up to a multiple of `VECTOR`, the last one repeated; as they are where one is over."""
    missing = -arc.reach_x.shape[1] % VECTOR
    if missing > VECTOR - 2:
        return arc
    return Arcs(*(jnp.pad(rows, ((0, 0), (0, missing)), mode="edge") for rows in arc))


def _shape(v: jax.Array, arc: Arcs) -> tuple[int, int]:
    return v.shape[0], arc.reach_x.shape[1]


def _least_root(squared: tuple, counts: jax.Array, radius: jax.Array, least: jax.Array) -> jax.Array:
    """`least`, or the distance less `radius` to one of the obstacles that count. counts, radius: [BLOCK]."""
    for place, square in enumerate(squared):
        least = jnp.where(counts[place], least_root(square, radius[place], least), least)
    return least


def least_root(square: jax.Array, radius: jax.Array, least: jax.Array) -> jax.Array:
    """`least`, or the root of `square` less `radius` where that is less."""
    positive = square > 0  # the root of 0 has no gradient
    return jnp.minimum(least, jnp.where(positive, jnp.sqrt(jnp.where(positive, square, 1.0)), 0.0) - radius)


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
    end = Pose(x[horizon - 1], y[horizon - 1], headings[-1][None, :])
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
