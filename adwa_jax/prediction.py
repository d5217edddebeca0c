"""What becomes of each candidate: where it gets to, how near to obstacles, and when it meets a mover.

Dimension letters: V, N candidates, C = V·N in one row; K predicted points; D discs of the robot.
"""

from typing import Any, NamedTuple

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


class Leg(NamedTuple):
    """Candidates after some of their steps; [V, N] float32."""

    x: jax.Array  # [m]
    y: jax.Array  # [m]
    static: jax.Array  # least clearance to statics until then, from the robot's outline [m]


class Met(NamedTuple):
    """[V, N] float32: as in `Prediction`."""

    moving: jax.Array
    contact_time: jax.Array


class _Carry(NamedTuple):
    """What costs most is worked out for all candidates in one row, which fills the machine's vectors."""

    x: jax.Array  # [C]
    y: jax.Array  # [C]
    next_x: jax.Array  # [V, N] after the next step, if nothing is in the way
    next_y: jax.Array  # [V, N]
    static: jax.Array  # [C]


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
    steps, half = profiles.v_ahead.shape[0], max(horizon // 2, 1)
    legs, met = follow(state, profiles, stride, (half, horizon, steps), field, sensed, robot, behaviour, growing_margin,
                       jnp.float32(-jnp.inf) if room is None else room)
    middle, end, _ = legs
    headings = state.heading + jnp.cumsum(profiles.yaw_rate_ahead[:horizon] * (behaviour.dt * stride), axis=0)
    return Prediction(headings, (middle.x, middle.y), Pose(end.x, end.y, headings[-1][None, :]), end.static,
                      met.moving, met.contact_time)


def follow(state: RobotState, profiles: Profiles, stride: int, ends: tuple[int, ...], field: DistanceField,
           sensed: Sensed, robot: RobotLimits, behaviour: Behaviour, growing_margin: bool,
           room: jax.Array) -> tuple[list[Leg], Met]:
    """The candidates after so many steps as each of `ends` says, the last of them all; and the movers they meet.

    The rest as for `predict`.
    """
    shape = profiles.v_ahead.shape[1], profiles.yaw_rate_ahead.shape[1]
    times = jnp.arange(1, ends[-1] + 1, dtype=jnp.float32) * (behaviour.dt * stride)
    ahead = points(state.heading, profiles.yaw_rate_ahead, behaviour.dt, stride), profiles.v_ahead

    def moved(x: jax.Array, y: jax.Array, at: Points, v: jax.Array) -> tuple[jax.Array, jax.Array]:
        return (x.reshape(shape) + v[:, None] * at.move_x[None, :], y.reshape(shape) + v[:, None] * at.move_y[None, :])

    def body_fun(carry: _Carry, row: tuple[tuple, tuple, jax.Array]) -> tuple[_Carry, jax.Array]:
        (at, _), following, time = row
        cosine, sine = (jnp.tile(part, shape[0]) for part in (at.cosine, at.sine))
        # Worked out where it is looked up, instead of carried, the next point would cost as much as the look-up.
        x, y = carry.next_x.reshape(-1), carry.next_y.reshape(-1)
        static = lesser(static_clearance(field, sensed, robot, x, y, cosine, sine), carry.static)
        free = static > room
        x, y = jnp.where(free, x, carry.x), jnp.where(free, y, carry.y)
        margin = behaviour.mover_margin + behaviour.mover_growth * time if growing_margin else 0.0
        moving = mover_clearance(sensed, robot, x, y, cosine, sine, time) - margin
        return _Carry(x, y, *moved(x, y, *following), static), moving

    x, y, static = (jnp.broadcast_to(value, shape[0] * shape[1]) for value in (state.x, state.y, jnp.float32(NOWHERE)))
    carry = _Carry(x, y, *moved(x, y, *jax.tree.map(lambda rows: rows[0], ahead)), static)
    rows = ahead, jax.tree.map(lambda rows: jnp.concatenate([rows[1:], rows[-1:]]), ahead), times
    legs, clearances = [], []
    for first, last in zip((0, *ends), ends, strict=False):
        carry, moving = lax.scan(body_fun, carry, _between(rows, first, last))
        legs.append(Leg(*(value.reshape(shape) for value in (carry.x, carry.y, carry.static))))
        clearances += list(moving)
    return legs, _met(clearances, times, shape)


def _between(rows: Any, first: int, last: int) -> Any:
    return jax.tree.map(lambda leaf: leaf[first:last], rows)


def _met(clearances: list[jax.Array], times: jax.Array, shape: tuple[int, int]) -> Met:
    """Of the clearances [C] after each step."""
    least, contact_time = clearances[-1], times[-1]
    for clearance, time in zip(clearances[::-1], times[::-1], strict=True):
        least = lesser(clearance, least)
        contact_time = jnp.where(clearance < 0, time, contact_time)
    return Met(least.reshape(shape), contact_time.reshape(shape))


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
