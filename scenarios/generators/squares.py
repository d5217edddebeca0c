"""Unknown squares that never cut the start off from the goal."""

import numpy as np

from adwa_jax.scenario import UnknownSquares
from scenarios.generators.assembly import Point, centre, squares_of
from scenarios.generators.connectivity import Cell, components, footprint, joined
from scenarios.generators.draws import Draws
from scenarios.generators.task_spec import TaskSpec

TRIES_PER_SQUARE = 8
"""Cells looked at for each square before the map counts as full."""


def place_squares(draws: Draws, occupied: np.ndarray, blocked: np.ndarray, start: Cell, goal: Cell,
                  spec: TaskSpec, resolution: float, origin: Point = (0.0, 0.0)) -> UnknownSquares:
    """Up to `spec.squares` unknown squares, each centred on a free cell of its own.

    With every cell that a square overlaps taken as occupied, start and goal stay connected for the robot. No
    centre lies within `spec.square_distance` of start or goal, along both x and y. Consumes `draws`.

    occupied, blocked: [H, W] bool, the known map and the cells that it denies the robot; start and goal are
    connected.
    """
    if spec.squares == 0:
        return squares_of([], spec.square_half_width)
    free = np.flatnonzero(_allowed(occupied, start, goal, spec.square_distance / resolution))
    shape = footprint(resolution, spec.robot_radius, spec.square_half_width)
    taken, chosen = blocked, []
    for _ in range(TRIES_PER_SQUARE * spec.squares if free.size else 0):
        cell = divmod(int(free[draws.index(free.size)]), occupied.shape[1])
        with_square = _with_square(taken, cell, shape)
        if cell not in chosen and _keeps_joined(taken, with_square, cell, shape, start, goal):
            taken, chosen = with_square, [*chosen, cell]
        if len(chosen) == spec.squares:
            break
    return squares_of([centre(cell, resolution, origin) for cell in chosen], spec.square_half_width)


def _allowed(occupied: np.ndarray, start: Cell, goal: Cell, distance_cells: float) -> np.ndarray:
    """[H, W] bool: free cells far enough from start and goal."""
    allowed = ~occupied
    reach = int(distance_cells + 1e-6)
    for row, column in (start, goal):
        allowed[max(0, row - reach) : row + reach + 1, max(0, column - reach) : column + reach + 1] = False
    return allowed


def _with_square(blocked: np.ndarray, cell: Cell, shape: np.ndarray) -> np.ndarray:
    """A copy of the blocked cells with those of one more square; shape [N, 2]: its offsets."""
    rows, columns = (shape + cell).T
    inside = (rows >= 0) & (rows < blocked.shape[0]) & (columns >= 0) & (columns < blocked.shape[1])
    with_square = blocked.copy()
    with_square[rows[inside], columns[inside]] = True
    return with_square


def _keeps_joined(before: np.ndarray, after: np.ndarray, cell: Cell, shape: np.ndarray, start: Cell,
                  goal: Cell) -> bool:
    """Whether start and goal, connected before the square, are connected after it.

    They are if the cells around the square are connected with each other near by, for a path through the
    square can then go round it: on large maps that saves looking at the whole map.
    """
    reach = 2 * int(shape.max()) + 2
    near = tuple(slice(max(0, index - reach), index + reach + 1) for index in cell)
    lost, left = after[near] & ~before[near], ~after[near]
    if after[start] or after[goal]:
        return False
    labels = np.unique(components(left)[_beside(lost) & left])
    return labels.size <= 1 or joined(after, start, goal)


def _beside(cells: np.ndarray) -> np.ndarray:
    """[h, w] bool: cells with an orthogonal neighbour among the given ones."""
    beside = np.zeros_like(cells)
    beside[1:] |= cells[:-1]
    beside[:-1] |= cells[1:]
    beside[:, 1:] |= cells[:, :-1]
    beside[:, :-1] |= cells[:, 1:]
    return beside
