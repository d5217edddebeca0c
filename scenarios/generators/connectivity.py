"""Which cells of a map a robot can reach, and a corridor for maps in which it can reach none.

A cell is blocked when the robot, centred on it, would touch an occupied square (`adwa_jax.grid.inflate`).
Under the corner rule `never` a diagonal step needs both orthogonal neighbours free, so two cells are
connected iff they are 4-connected. All of this runs on the host in numpy: maps are drawn one at a time, and
every size would compile anew.
Dimension letters: H, W rows and columns of the map; N offsets; E edges between runs.
"""

import numpy as np

from scenarios.generators.draws import Draws

Cell = tuple[int, int]
"""(row, column)."""


def inflated(occupied: np.ndarray, resolution: float, radius: float) -> np.ndarray:
    """[H, W] bool: cells in which a disc of `radius` [m] centred on the cell meets an obstacle or the border.

    Equal to `adwa_jax.grid.inflate`, ties included, without a compilation for every size of map.
    """
    reach = _reach(resolution, radius)
    height, width = occupied.shape
    ringed = np.pad(occupied, reach, constant_values=True)
    blocked = occupied.copy()
    for row, column in footprint(resolution, radius):
        blocked |= ringed[reach + row : reach + row + height, reach + column : reach + column + width]
    return blocked


def footprint(resolution: float, radius: float, half_width: float = 0.0) -> np.ndarray:
    """[N, 2] int (row, column) offsets from a square to the cells it blocks for a disc of `radius` [m].

    The square is centred on a cell and reaches `half_width` [m] to each side; every cell that it overlaps
    counts as occupied as a whole. `half_width` 0: the square is the one cell.
    """
    covered = int(np.ceil(half_width / resolution - 0.5)) if half_width > 0.5 * resolution else 0
    reach = covered + _reach(resolution, radius)
    offset = np.arange(-reach, reach + 1)
    gap = np.maximum(2 * (np.abs(offset) - covered) - 1, 0)
    squared = (gap[:, None] ** 2 + gap[None, :] ** 2).astype(np.float32)
    inside = (np.abs(offset) <= covered)[:, None] & (np.abs(offset) <= covered)[None, :]
    return np.argwhere(inside | (squared > 0) & (squared <= _half_cells(resolution, radius) ** 2)) - reach


def components(free: np.ndarray) -> np.ndarray:
    """[H, W] int32: one label for all cells of a 4-connected component of free cells; -1 elsewhere.

    Runs of free cells along a row are the nodes of a graph, joined where they touch; each run takes the least
    number among the runs that it is joined to, until nothing changes.
    """
    begins = free.copy()
    begins[:, 1:] &= ~free[:, :-1]
    run = np.cumsum(begins.ravel(), dtype=np.int32).reshape(free.shape) - 1
    touching = free[:-1] & free[1:]
    label = _least_labels(run[:-1][touching], run[1:][touching], int(begins.sum()))
    return np.where(free, label[run], np.int32(-1)) if label.size else np.full(free.shape, -1, np.int32)


def _least_labels(below: np.ndarray, above: np.ndarray, count: int) -> np.ndarray:
    """[count] int32: for each of `count` runs the least run joined to it by the edges below[E] - above[E]."""
    label = np.arange(count, dtype=np.int32)
    while True:
        a, b = label[below], label[above]
        apart = a != b
        if not apart.any():
            return label
        below, above, a, b = below[apart], above[apart], a[apart], b[apart]
        np.minimum.at(label, np.maximum(a, b), np.minimum(a, b))
        while (label != label[label]).any():
            label = label[label]


def joined(blocked: np.ndarray, a: Cell, b: Cell) -> bool:
    """Whether cells a and b are both unblocked and connected."""
    if blocked[a] or blocked[b]:
        return False
    label = components(~blocked)
    return bool(label[a] == label[b])


def _half_cells(resolution: float, radius: float) -> np.float32:
    """The radius in half cells, rounded as `adwa_jax.grid.inflate` rounds it."""
    return np.float32(2.0) * np.float32(radius) / np.float32(resolution)


def _reach(resolution: float, radius: float) -> int:
    """Cells by which a disc can at most reach beyond its own."""
    return int((_half_cells(resolution, radius) + np.float32(1.0)) / np.float32(2.0))


def largest_component(blocked: np.ndarray) -> np.ndarray:
    """[N, 2] int (row, column): the largest component of unblocked cells; N = 0 if all are blocked."""
    label = components(~blocked)
    sizes = np.bincount(label[label >= 0], minlength=1)
    return np.argwhere(label == sizes.argmax())


def carved(draws: Draws, occupied: np.ndarray, a: Cell, b: Cell, resolution: float,
           radius: float) -> np.ndarray:
    """A copy of the map in which a random staircase from cell a to cell b is free for a disc of `radius` [m].

    Cells a and b must be far enough from the border for the disc. The staircase's steps, all towards b, come
    in random order, which `draws` decides.
    """
    down, right = abs(b[0] - a[0]), abs(b[1] - a[1])
    is_down = draws.order(down + right) < down
    rows = a[0] + np.sign(b[0] - a[0]) * np.concatenate([[0], np.cumsum(is_down)])
    columns = a[1] + np.sign(b[1] - a[1]) * np.concatenate([[0], np.cumsum(~is_down)])
    free = occupied.copy()
    for row, column in footprint(resolution, radius):
        free[rows + row, columns + column] = False
    return free


def border_cells(resolution: float, radius: float) -> int:
    """How many rows or columns next to the border a disc of `radius` [m] cannot use."""
    return _reach(resolution, radius)
