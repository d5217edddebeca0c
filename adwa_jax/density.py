"""Obstacle density of the rectangle between a cell and the goal, and of the whole map (eqs. 2 and 3)."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from adwa_jax.grid import Grid


class Density(NamedTuple):
    """Counts whose ratios are the densities: P = obstacles / cells (eq. 2), Q = map_obstacles / map_cells (eq. 3)."""

    obstacles: jax.Array  # [H, W] float32, N: occupied cells in the rectangle spanned by the cell and the goal
    cells: jax.Array  # [H, W] float32, M: cells of that rectangle, both corners included
    map_obstacles: jax.Array  # [] float32, T
    map_cells: jax.Array  # [] float32, S


def obstacle_density(grid: Grid, goal_cell: jax.Array) -> Density:
    """N and M for every reference cell, T and S for the map, by one integral image: O(1) a cell.

    Padding is left out of every count. Unbatched. goal_cell: [2] int32 (row, col), on the map.
    """
    integral = integral_image(grid)
    rows, columns = grid.occupied.shape
    row = jnp.arange(rows, dtype=jnp.int32)[:, None]
    column = jnp.arange(columns, dtype=jnp.int32)[None, :]
    top, bottom = jnp.minimum(row, goal_cell[0]), jnp.maximum(row, goal_cell[0]) + 1
    left, right = jnp.minimum(column, goal_cell[1]), jnp.maximum(column, goal_cell[1]) + 1
    obstacles = (integral[bottom, right] - integral[top, right] - integral[bottom, left] + integral[top, left])
    return Density(
        obstacles=obstacles.astype(jnp.float32),
        cells=((bottom - top) * (right - left)).astype(jnp.float32),
        map_obstacles=integral[-1, -1].astype(jnp.float32),
        map_cells=(grid.height * grid.width).astype(jnp.float32),
    )


def integral_image(grid: Grid) -> jax.Array:
    """[H + 1, W + 1] int32: entry (r, c) counts the occupied cells of the map in rows < r and columns < c."""
    rows, columns = grid.occupied.shape
    on_map = (jnp.arange(rows)[:, None] < grid.height) & (jnp.arange(columns)[None, :] < grid.width)
    counted = (grid.occupied & on_map).astype(jnp.int32)
    return jnp.pad(jnp.cumsum(jnp.cumsum(counted, axis=0), axis=1), ((1, 0), (1, 0)))
