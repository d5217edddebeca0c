"""Unknown obstacles: where the movers are, what the robot senses of them, and how far they will be (§4 D)."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from adwa_jax.grid import Scalar, lesser
from adwa_jax.scenario import Movers, UnknownSquares

NOWHERE = 1e6  # distance [m] reported to what is absent; finite, so that no arithmetic on it makes a NaN
UNROLLED = 16  # obstacles up to this many are unrolled into one fused expression
BLOCK = 4  # obstacles looked at side by side where only those sensed are looked at


class MoverStates(NamedTuple):
    """The movers at one time."""

    position: jax.Array  # [M, 2] float32 [m]
    velocity: jax.Array  # [M, 2] float32 [m/s]
    present: jax.Array  # [M] bool


class Sensed(NamedTuple):
    """What the robot knows of the unknown obstacles."""

    square_centre: jax.Array  # [S, 2] float32 [m]
    square_half_width: jax.Array  # [S] float32 [m]
    square_known: jax.Array  # [S] bool, sensed now or before
    position: jax.Array  # [M, 2] float32 [m]
    velocity: jax.Array  # [M, 2] float32 [m/s]
    radius: jax.Array  # [M] float32 [m]
    seen: jax.Array  # [M] bool, in range now
    square_rounding: jax.Array  # [S] float32 [m]
    border: jax.Array | None = None  # [2, 2] low and high corner [m] between which movers are predicted to turn back
    # Those sensed come first (`sensed_first`), and are no more than so many, [] int32. None: any may be.
    square_count: jax.Array | None = None
    mover_count: jax.Array | None = None


def movers_at(movers: Movers, time: jax.Array) -> MoverStates:
    """Positions and velocities at `time` [s]: mirrored at the box, or along the track. Unbatched."""
    free = _mirrored(movers, time)
    if movers.track.shape[1] < 2:
        return free
    tracked = jax.vmap(_along_track, in_axes=(0, 0, 0, None))(movers.track, movers.track_length, movers.period, time)
    has_track = (movers.track_length > 1)[:, None]
    return MoverStates(
        position=jnp.where(has_track, tracked.position, free.position),
        velocity=jnp.where(has_track, tracked.velocity, free.velocity),
        present=movers.valid & (tracked.present | ~has_track[:, 0]),
    )


def _turned_back(centres: jax.Array, now: jax.Array, radius: jax.Array, border: jax.Array) -> jax.Array:
    """Centres [M, 2] mirrored once where their discs would cross the border; discs that cross it now go on."""
    low, high = border[:1] + radius[:, None], border[1:] - radius[:, None]
    back = jnp.where(centres < low, 2.0 * low - centres, jnp.where(centres > high, 2.0 * high - centres, centres))
    return jnp.where((now >= low) & (now <= high), back, centres)


def _mirrored(movers: Movers, time: jax.Array) -> MoverStates:
    """Constant velocity with reflection: a straight line folded into the box [low, high]."""
    span = jnp.maximum(movers.high - movers.low, 1e-6)
    unfolded = movers.position - movers.low + movers.velocity * time
    phase = unfolded - 2.0 * span * jnp.floor(unfolded / (2.0 * span))
    back = phase > span
    return MoverStates(
        position=movers.low + jnp.where(back, 2.0 * span - phase, phase),
        velocity=jnp.where(back, -movers.velocity, movers.velocity),
        present=movers.valid,
    )


def _along_track(track: jax.Array, length: jax.Array, period: jax.Array, time: jax.Array) -> MoverStates:
    """One mover between its track points: track [J, 3] rows (t, x, y), `length` in use."""
    repeats = period > 0
    cycle = jnp.where(repeats, period, 1.0)
    time = jnp.where(repeats, time - cycle * jnp.floor(time / cycle), time)
    used = jnp.arange(track.shape[0], dtype=jnp.int32) < length
    index = jnp.clip(jnp.sum(used & (track[:, 0] <= time), dtype=jnp.int32) - 1, 0, jnp.maximum(length - 2, 0))
    begin, end = track[index], track[index + 1]
    lasting = jnp.maximum(end[0] - begin[0], 1e-6)
    velocity = (end[1:] - begin[1:]) / lasting
    within = jnp.clip(time - begin[0], 0.0, lasting)
    present = repeats | ((time >= track[0, 0]) & (time <= track[jnp.maximum(length - 1, 0), 0]))
    return MoverStates(begin[1:] + velocity * within, velocity, present)


def sense(squares: UnknownSquares, known: jax.Array, movers: Movers, states: MoverStates, position: jax.Array,
          sensor_range: Scalar) -> Sensed:
    """Squares within range become known and stay so; movers are seen while in range (§4 D a, b).

    Range is measured to the obstacle's outline. Unbatched. known: [S] bool; position: [2] [m]; sensor_range: [] [m].
    """
    to_square = _distance_to_square(position[0], position[1], squares.centre.T, squares.half_width,
                                    squares.rounding)
    offset = states.position - position[None, :]
    to_mover = jnp.sqrt(offset[:, 0] * offset[:, 0] + offset[:, 1] * offset[:, 1]) - movers.radius
    return Sensed(
        square_centre=squares.centre,
        square_half_width=squares.half_width,
        square_known=known | (squares.valid & (to_square <= sensor_range)),
        position=states.position,
        velocity=states.velocity,
        radius=movers.radius,
        seen=states.present & (to_mover <= sensor_range),
        square_rounding=squares.rounding,
    )


def sensed_first(sensed: Sensed) -> Sensed:
    """The same obstacles, squares and movers each in an order in which those sensed come first. Unbatched.

    What is looked at a million times need then not be all, but as many as are sensed: see `Sensed.square_count`.
    """
    squares = _in_front(sensed.square_known, sensed.square_centre, sensed.square_half_width, sensed.square_rounding)
    movers = _in_front(sensed.seen, sensed.position, sensed.velocity, sensed.radius)
    centre, half_width, rounding = squares
    position, velocity, radius = movers
    return Sensed(centre, half_width, _first_of(sensed.square_known), position, velocity, radius,
                  _first_of(sensed.seen), rounding, sensed.border)


def _first_of(sensed: jax.Array) -> jax.Array:
    return jnp.arange(sensed.shape[0]) < jnp.sum(sensed)


def _in_front(sensed: jax.Array, *fields: jax.Array) -> list[jax.Array]:
    """Rows of each field that are sensed, then rows of 0."""
    if not sensed.size:
        return list(fields)
    row = jnp.arange(sensed.shape[0], dtype=jnp.int32)
    place = jnp.sum(sensed[None, :] & (row[None, :] < row[:, None]), axis=1, dtype=jnp.int32)
    goes_to = sensed[None, :] & (place[None, :] == row[:, None])  # [to, from]
    origin, filled = jnp.sum(jnp.where(goes_to, row[None, :], 0), axis=1), _first_of(sensed)

    def moved(field: jax.Array) -> jax.Array:
        return jnp.where(filled.reshape((-1,) + (1,) * (field.ndim - 1)), field[origin], 0.0)

    return [moved(field) for field in fields]


def clearance_to_squares(sensed: Sensed, x: jax.Array, y: jax.Array) -> jax.Array:
    """Least distance [m] from points to known squares, `NOWHERE` without any. x, y: any equal shapes.

    Within a rounded square it is negative, down to -rounding; within a sharp one 0.
    """

    def distance(index: jax.Array | int) -> jax.Array:
        apart = _distance_to_square(x, y, sensed.square_centre[index], sensed.square_half_width[index],
                                    sensed.square_rounding[index])
        return jnp.where(sensed.square_known[index], apart, NOWHERE)

    return _least(distance, sensed.square_known.shape[0], sensed.square_count, jnp.full_like(x, NOWHERE))


def clearance_to_movers(sensed: Sensed, x: jax.Array, y: jax.Array, ahead: jax.Array) -> jax.Array:
    """Least distance [m] from points to seen movers `ahead` [s] from now, each going on at constant velocity (§4 D b).

    With a border, as if mirrored there. Negative inside a mover; `NOWHERE` without any. x, y: any equal shapes;
    ahead: [].
    """
    centres = predicted_centres(sensed, ahead)

    def distance(index: jax.Array | int) -> jax.Array:
        centre = centres[index]
        apart = _norm(x - centre[0], y - centre[1]) - sensed.radius[index]
        return jnp.where(sensed.seen[index], apart, NOWHERE)

    return _least(distance, sensed.seen.shape[0], sensed.mover_count, jnp.full_like(x, NOWHERE))


def predicted_centres(sensed: Sensed, ahead: jax.Array) -> jax.Array:
    """[M, 2] where the movers are expected `ahead` [s] from now, [] (§4 D b)."""
    centres = sensed.position + sensed.velocity * ahead
    if sensed.border is None:
        return centres
    return _turned_back(centres, sensed.position, sensed.radius, sensed.border)


def over_blocks(body: Callable[[jax.Array, jax.Array], jax.Array], size: int, count: jax.Array | None,
                start: jax.Array) -> jax.Array:
    """Fold `body` over the indices [BLOCK] int32 of block after block of `size` obstacles, or of the first `count`.

    A last block that is not full repeats the last obstacle.
    """
    if size == 0:
        return start

    def body_fun(block: jax.Array, value: jax.Array) -> jax.Array:
        return body(jnp.minimum(block * BLOCK + jnp.arange(BLOCK, dtype=jnp.int32), size - 1), value)

    blocks = -(-(size if count is None else count) // BLOCK)
    return lax.fori_loop(0, blocks, body_fun, start)


def _least(distance: Callable[[jax.Array | int], jax.Array], size: int, count: jax.Array | None,
           start: jax.Array) -> jax.Array:
    if count is None and size <= UNROLLED:
        return _least_of(distance, range(size), start)
    return over_blocks(lambda indices, least: _least_of(distance, indices, least), size, count, start)


def _least_of(distance: Callable[[jax.Array | int], jax.Array], indices: Iterable[jax.Array | int],
              least: jax.Array) -> jax.Array:
    for index in indices:
        least = lesser(distance(index), least)
    return least


def _distance_to_square(x: jax.Array, y: jax.Array, centre: jax.Array, half_width: jax.Array,
                        rounding: jax.Array) -> jax.Array:
    dx = jnp.maximum(jnp.abs(x - centre[0]) - half_width, 0.0)
    dy = jnp.maximum(jnp.abs(y - centre[1]) - half_width, 0.0)
    return _norm(dx, dy) - rounding


def _norm(dx: jax.Array, dy: jax.Array) -> jax.Array:
    """√(dx² + dy²) with gradient 0, not NaN, at the origin."""
    squared = dx * dx + dy * dy
    positive = squared > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, squared, 1.0)), 0.0)
