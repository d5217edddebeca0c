"""Turning points and key points of a grid path, and the exact test of a segment against occupied squares (§2.2.2).

Points are in cells here: the centre of cell (r, c) is x = c + 0.5, y = r + 0.5.
"""

from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

KeyPointRule = Literal["anchor", "literal"]


class KeyPoints(NamedTuple):
    """The path reduced to start, key points and goal."""

    cells: jax.Array  # [P, 2] int32 (row, col); beyond `count` the last repeats
    count: jax.Array  # [] int32; 0 without a path


def turning_points(path: jax.Array, path_cells: jax.Array) -> jax.Array:
    """[P] bool: first, last, and every cell where the triangle with its two neighbours has non-zero area (§2.2.2 A).

    Unbatched. path: [P, 2] int32 (row, col), of which the first `path_cells` count.
    """
    index = jnp.arange(path.shape[0], dtype=jnp.int32)
    before = path - jnp.roll(path, 1, axis=0)
    after = jnp.roll(path, -1, axis=0) - path
    twice_area = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    end = (index == 0) | (index == path_cells - 1)
    return (end | (twice_area != 0)) & (index < path_cells)


def key_points(occupied: jax.Array, path: jax.Array, path_cells: jax.Array, margin: jax.Array,
               rule: KeyPointRule) -> KeyPoints:
    """Turning points without those whose neighbours see each other (§2.2.2 B).

    Walking the turning points in order, one is dropped if and only if the segment from the last *kept* point (`anchor`)
    or from the turning point before it (`literal`, word for word) to the next turning point is free. Under `anchor` and
    corner rule `never`, every segment of the result is free for margins < 0.5 cell; `literal` can drop two neighbours
    whose shortcut was never tested.

    Unbatched. occupied: [H, W] bool; margin: [] float32, cells.
    """
    turning = turning_points(path, path_cells)
    (place,) = jnp.nonzero(turning, size=path.shape[0], fill_value=path.shape[0] - 1)
    points = path[place]
    turns = jnp.sum(turning, dtype=jnp.int32)

    def body_fun(index: jax.Array, kept: KeyPoints) -> KeyPoints:
        origin = kept.cells[kept.count - 1] if rule == "anchor" else points[index - 1]
        redundant = segment_free(occupied, centre(origin), centre(points[index + 1]), margin)
        written = kept.cells.at[kept.count].set(points[index])  # a redundant one is written over
        return KeyPoints(written, kept.count + (~redundant).astype(jnp.int32))

    first = KeyPoints(jnp.broadcast_to(points[0], points.shape).astype(jnp.int32), jnp.minimum(turns, 1))
    kept = lax.fori_loop(1, turns - 1, body_fun, first)
    last = points[jnp.maximum(turns - 1, 0)]
    beyond = jnp.arange(points.shape[0]) >= kept.count
    cells = jnp.where(beyond[:, None], last[None, :], kept.cells)
    return KeyPoints(cells, kept.count + (turns > 1).astype(jnp.int32))


def segment_free(occupied: jax.Array, a: jax.Array, b: jax.Array, margin: jax.Array) -> jax.Array:
    """[] bool: whether all that is occupied is farther than `margin` ≥ 0 from the segment ab; touching is not free.

    Only the cells in a band about the segment are looked at: along its longer axis one line of cells after another,
    across it as many as the margin can reach. Separating axes decide whether square and segment meet; otherwise the
    least distance is from an end of the segment to the square or from a corner of the square to the segment. Exact for
    ends at cell centres: their products are whole quarters below 2²⁴, float32's whole numbers, up to 1024 × 1024 cells.

    Unbatched. occupied: [H, W] bool; a, b: [2] float32 (x, y) in cells; margin: [] float32, cells.
    """
    occupied = jnp.asarray(occupied)
    steep = jnp.abs(b[1] - a[1]) > jnp.abs(b[0] - a[0])
    along = jnp.arange(max(occupied.shape), dtype=jnp.int32)
    run, rise = jnp.where(steep, (b - a)[::-1], b - a)
    start, height = jnp.where(steep, a[::-1], a)
    slope = jnp.where(run == 0, 0.0, rise / jnp.where(run == 0, 1.0, run))
    middle = jnp.floor(height + slope * (along.astype(jnp.float32) + 0.5 - start)).astype(jnp.int32)
    half_band = jnp.ceil(2.0 * margin).astype(jnp.int32) + 3

    def body_fun(offset: jax.Array, free: jax.Array) -> jax.Array:
        across = middle + offset - half_band
        row, column = jnp.where(steep, along, across), jnp.where(steep, across, along)
        taken = occupied.at[row, column].get(mode="fill", fill_value=False) & (row >= 0) & (column >= 0)
        low_x, low_y = column.astype(jnp.float32), row.astype(jnp.float32)
        apart = _separated(low_x, low_y, a, b) & (_distance_apart(low_x, low_y, a, b) > margin)
        return free & jnp.all(apart | ~taken)

    return lax.fori_loop(0, 2 * half_band + 1, body_fun, _to_border(occupied.shape, a, b) > margin)


def centre(cell: jax.Array) -> jax.Array:
    """[2] float32 (x, y) of the centre of a cell [2] int32 (row, col), in cells."""
    return cell[::-1].astype(jnp.float32) + 0.5


def polyline_length(points: jax.Array, count: jax.Array) -> jax.Array:
    """[] float32: length of the polyline through the first `count` of points [P, 2]; unit of the points."""
    steps = points[1:] - points[:-1]
    used = jnp.arange(1, points.shape[0]) < count
    return jnp.sum(jnp.where(used, jnp.sqrt(jnp.sum(steps * steps, axis=1)), 0.0))


def _to_border(shape: tuple[int, ...], a: jax.Array, b: jax.Array) -> jax.Array:
    """[] least distance from the segment to the border, beyond which all is occupied: that of one of its ends."""
    size = jnp.array(shape[::-1], jnp.float32)
    return jnp.min(jnp.minimum(jnp.minimum(a, b), size - jnp.maximum(a, b)))


def _separated(low_x: jax.Array, low_y: jax.Array, a: jax.Array, b: jax.Array) -> jax.Array:
    """[...] bool: an axis (x, y or the segment's normal) separates the closed unit squares from the segment."""
    box = (jnp.maximum(a[0], b[0]) < low_x) | (jnp.minimum(a[0], b[0]) > low_x + 1.0)
    box |= (jnp.maximum(a[1], b[1]) < low_y) | (jnp.minimum(a[1], b[1]) > low_y + 1.0)
    corners = [_cross(a, b, low_x + i, low_y + j) for i in (0.0, 1.0) for j in (0.0, 1.0)]
    least = jnp.minimum(jnp.minimum(corners[0], corners[1]), jnp.minimum(corners[2], corners[3]))
    most = jnp.maximum(jnp.maximum(corners[0], corners[1]), jnp.maximum(corners[2], corners[3]))
    return box | (least > 0) | (most < 0)


def _distance_apart(low_x: jax.Array, low_y: jax.Array, a: jax.Array, b: jax.Array) -> jax.Array:
    """[...] distance between the segment and squares that do not meet."""
    ends = jnp.minimum(_point_to_square(a, low_x, low_y), _point_to_square(b, low_x, low_y))
    distances = [_point_to_segment(a, b, low_x + i, low_y + j) for i in (0.0, 1.0) for j in (0.0, 1.0)]
    corners = jnp.minimum(jnp.minimum(distances[0], distances[1]), jnp.minimum(distances[2], distances[3]))
    return jnp.minimum(ends, corners)


def _cross(a: jax.Array, b: jax.Array, x: jax.Array, y: jax.Array) -> jax.Array:
    """Twice the signed area of the triangle a, b, (x, y)."""
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])


def _point_to_square(point: jax.Array, low_x: jax.Array, low_y: jax.Array) -> jax.Array:
    dx = jnp.maximum(0.0, jnp.maximum(low_x - point[0], point[0] - low_x - 1.0))
    dy = jnp.maximum(0.0, jnp.maximum(low_y - point[1], point[1] - low_y - 1.0))
    return jnp.sqrt(dx * dx + dy * dy)


def _point_to_segment(a: jax.Array, b: jax.Array, x: jax.Array, y: jax.Array) -> jax.Array:
    """Distance from points (x, y) to the segment ab: to its line where the foot lies on it, else to the nearer end."""
    along = (x - a[0]) * (b[0] - a[0]) + (y - a[1]) * (b[1] - a[1])
    squared_length = jnp.sum((b - a) * (b - a))
    to_line = jnp.abs(_cross(a, b, x, y)) / jnp.sqrt(jnp.maximum(squared_length, 1e-12))
    to_a = jnp.sqrt((x - a[0]) * (x - a[0]) + (y - a[1]) * (y - a[1]))
    to_b = jnp.sqrt((x - b[0]) * (x - b[0]) + (y - b[1]) * (y - b[1]))
    on_segment = (along > 0) & (along < squared_length)
    return jnp.where(on_segment, to_line, jnp.minimum(to_a, to_b))
