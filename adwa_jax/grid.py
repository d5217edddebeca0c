"""Occupancy grids and their exact Euclidean distance fields.

Frame: cell (row r, col c) is the closed square [c, c+1] × [r, r+1] times `resolution`, shifted by `origin`.
Columns run along x, rows along y; everything outside the map counts as occupied.
Dimension letters: H, W rows and columns of the (padded) map; s subdivision of a cell by the distance field.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jax import lax

Scalar = jax.Array | float  # [] float32, traced, or a plain number

# Largest value by which bilinear interpolation exceeds the true distance, in units of the lattice spacing:
# at the convex corner of a square the interpolant is (2 - √2)·t·(1 - t) too large on the diagonal, t in [0, 1].
# Flat sides are exact, because the sides of cells are lattice lines, and the distance to a union of squares is the
# least of the distances to each, so the bound for one square holds for all. Rounded up for float32.
BILINEAR_EXCESS = 0.1465


@partial(jax.tree_util.register_dataclass, data_fields=["occupied", "height", "width", "resolution", "origin"],
         meta_fields=[])
@dataclass(frozen=True)
class Grid:
    """A rectangular occupancy map, possibly padded: cells beyond `height` × `width` are occupied.

    Unbatched; `vmap` adds leading axes.
    """

    occupied: jax.Array  # [H, W] bool; padding is True
    height: jax.Array  # [] int32, rows of the map itself, ≤ H
    width: jax.Array  # [] int32, columns of the map itself, ≤ W
    resolution: jax.Array  # [] float32, side of a cell [m]
    origin: jax.Array  # [2] float32, x, y of the outer corner of cell (0, 0) [m]


@partial(jax.tree_util.register_dataclass, data_fields=["distance", "spacing", "origin"], meta_fields=[])
@dataclass(frozen=True)
class DistanceField:
    """Distance to the nearest occupied square, sampled at the corners of a lattice."""

    distance: jax.Array  # [H·s + 1, W·s + 1] float32 [m]; exact at the lattice points
    spacing: jax.Array  # [] float32, lattice spacing [m]
    origin: jax.Array  # [2] float32, x, y of lattice point (0, 0) [m]


def distance_field(grid: Grid, subdivision: int = 4) -> DistanceField:
    """Exact Euclidean distance from each lattice point to the nearest occupied square or the map's border.

    The lattice divides each cell into `subdivision` × `subdivision` parts and holds the corners of the cells, so the
    nearest point of a square to a lattice point is itself a lattice point and squared distances are whole numbers.
    """
    touched = occupied_lattice(grid.occupied, subdivision)
    spacing = grid.resolution / subdivision
    distance = jnp.sqrt(squared_distance(touched).astype(jnp.float32)) * spacing
    return DistanceField(distance=distance, spacing=spacing, origin=grid.origin)


def clearance_at(field: DistanceField, x: jax.Array, y: jax.Array) -> jax.Array:
    """Lower bound [m] of the distance from points (x, y) to occupied squares: bilinear value less its worst excess.

    At most `BILINEAR_EXCESS`·spacing above the truth before the subtraction, so a point judged clear is clear; never
    more than spacing·√½ + `BILINEAR_EXCESS`·spacing below it. Points off the map give the value at its border, ≤ 0.
    x, y: equal shapes, [m].
    """
    return bilinear(field, x, y) - BILINEAR_EXCESS * field.spacing


def bilinear(field: DistanceField, x: jax.Array, y: jax.Array) -> jax.Array:
    """Bilinear interpolation of the field at points (x, y) [m], clamped to its hull."""
    rows, columns = field.distance.shape
    steps = 1.0 / field.spacing
    u = _within((x - field.origin[0]) * steps, columns - 1)
    v = _within((y - field.origin[1]) * steps, rows - 1)
    # Unsigned: the compiler then sees that no place is below 0, and works out one address for the four values.
    column = jnp.minimum(u.astype(jnp.uint32), jnp.uint32(columns - 2))
    row = jnp.minimum(v.astype(jnp.uint32), jnp.uint32(rows - 2))
    right, above = u - column.astype(jnp.float32), v - row.astype(jnp.float32)
    left, below = 1.0 - right, 1.0 - above
    flat = field.distance.reshape(-1)
    index = row * jnp.uint32(columns) + column

    def value(ahead: int) -> jax.Array:
        place = index + jnp.uint32(ahead)
        return flat.at[place].get(mode="promise_in_bounds", wrap_negative_indices=False)

    # Each value is used once, or the compiler gathers it apart from the rest, at three times the cost.
    return (below * (left * value(0) + right * value(1))
            + above * (left * value(columns) + right * value(columns + 1)))  # fmt: skip


def lesser(a: jax.Array, b: jax.Array) -> jax.Array:
    """The lesser of two numbers, neither a NaN: one instruction, where `minimum` takes three to keep a NaN."""
    return jnp.where(a < b, a, b)


def _within(value: jax.Array, most: int) -> jax.Array:
    return lesser(jnp.where(value > 0.0, value, 0.0), jnp.float32(most))


def inflate(grid: Grid, radius: Scalar) -> jax.Array:
    """[H, W] bool: cells in which a disc of `radius` [m] centred on the cell's centre meets an occupied square.

    Exact; touching counts as meeting, and radius 0 gives the occupied cells themselves. The map's border, beyond which
    all is occupied, inflates too.
    """
    touched = occupied_lattice(grid.occupied, 2)
    half_cells = 2.0 * radius / grid.resolution
    reach = jnp.ceil(half_cells).astype(jnp.int32)
    squared = squared_distance(touched, reach)[1::2, 1::2].astype(jnp.float32)
    return squared <= half_cells * half_cells


def occupied_lattice(occupied: jax.Array, subdivision: int) -> jax.Array:
    """[H·s + 1, W·s + 1] bool: lattice points that lie in or on an occupied square or on the map's border."""
    fine = jnp.repeat(jnp.repeat(occupied, subdivision, axis=0), subdivision, axis=1)
    ringed = jnp.pad(fine, 1, constant_values=True)
    return ringed[:-1, :-1] | ringed[1:, :-1] | ringed[:-1, 1:] | ringed[1:, 1:]


def squared_distance(touched: jax.Array, reach: jax.Array | None = None) -> jax.Array:
    """Exact squared distance, in lattice steps, from each lattice point to the nearest True one.

    With `reach`, [] int32, only distances up to so many steps are exact; farther points get some value above reach².

    Two 1-D passes (Saito and Toriwaki 1994): along rows by counting from either side, then along columns by the least
    of k² + (row distance at ± k)², k growing until no column can improve. Needs a True on the border of every row.

    touched: [h, w] bool. Returns [h, w] int32.
    """
    h, w = touched.shape
    along_row = _distance_along_row(touched)
    far = jnp.int32(max(h, w) ** 2 * 2)
    farthest = jnp.int32(h - 1) if reach is None else jnp.minimum(reach, h - 1)
    padded = jnp.pad(along_row * along_row, ((h, h), (0, 0)), constant_values=far)

    def cond_fun(carry):
        best, k = carry
        return (k <= farthest) & (k * k < jnp.max(best))

    def body_fun(carry):
        best, k = carry
        up = lax.dynamic_slice(padded, (h - k, 0), (h, w))
        down = lax.dynamic_slice(padded, (h + k, 0), (h, w))
        return jnp.minimum(best, jnp.minimum(up, down) + k * k), k + 1

    best, _ = lax.while_loop(cond_fun, body_fun, (along_row * along_row, jnp.int32(1)))
    return best


def _distance_along_row(touched: jax.Array) -> jax.Array:
    """Steps along the row to the nearest True point, [h, w] int32."""
    far = jnp.full(touched.shape[:1], touched.shape[1], jnp.int32)

    def body_fun(steps: jax.Array, column: jax.Array) -> tuple[jax.Array, jax.Array]:
        steps = jnp.where(column, 0, steps + 1)
        return steps, steps

    _, from_left = lax.scan(body_fun, far, touched.T)
    _, from_right = lax.scan(body_fun, far, touched.T, reverse=True)
    return jnp.minimum(from_left, from_right).T


def cell_of(grid: Grid, point: jax.Array) -> jax.Array:
    """[2] int32 (row, col) of the cell that holds a point [2] (x, y) [m]; may lie off the map."""
    scaled = jnp.floor((point - grid.origin) / grid.resolution).astype(jnp.int32)
    return scaled[::-1]


def centre_of(grid: Grid, cell: jax.Array) -> jax.Array:
    """[..., 2] float32 (x, y) [m] of the centres of cells [..., 2] int32 (row, col)."""
    column_row = cell[..., ::-1].astype(jnp.float32) + 0.5
    origin = grid.origin.reshape((1,) * (cell.ndim - 1) + (2,))
    return column_row * grid.resolution + origin


def inside(grid: Grid, cell: jax.Array) -> jax.Array:
    """[] bool: whether a cell [2] (row, col) lies on the map."""
    return (cell[0] >= 0) & (cell[1] >= 0) & (cell[0] < grid.height) & (cell[1] < grid.width)


def distance_to_squares(grid: Grid, point: jax.Array, reach: int) -> jax.Array:
    """Exact distance [m] from a point [2] to the nearest occupied square among the (2·reach + 1)² cells around it.

    Off-map cells count as occupied. Distances above `reach`·resolution are reported as infinite: a farther square, not
    looked at, might be nearer.
    """
    scaled = (point - grid.origin) / grid.resolution
    row, column = jnp.floor(scaled[1]).astype(jnp.int32), jnp.floor(scaled[0]).astype(jnp.int32)
    offset = jnp.arange(-reach, reach + 1, dtype=jnp.int32)
    rows, columns = row + offset, column + offset
    dy = _gap(scaled[1], rows)
    dx = _gap(scaled[0], columns)
    off_map = ((rows < 0) | (rows >= grid.height))[:, None] | ((columns < 0) | (columns >= grid.width))[None, :]
    block = grid.occupied.at[rows[:, None], columns[None, :]].get(mode="fill", fill_value=True)
    distance = jnp.sqrt(dy[:, None] * dy[:, None] + dx[None, :] * dx[None, :])
    nearest = lax.reduce(jnp.where(block | off_map, distance, jnp.inf), jnp.float32(jnp.inf), lesser, (0, 1))
    return jnp.where(nearest <= reach, nearest * grid.resolution, jnp.inf)


def _gap(coordinate: jax.Array, index: jax.Array) -> jax.Array:
    """Distance along one axis from a coordinate to the intervals [index, index + 1]."""
    low = index.astype(jnp.float32)
    return jnp.maximum(0.0, jnp.maximum(low - coordinate, coordinate - low - 1.0))
