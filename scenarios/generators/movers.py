"""Moving discs: those that cross the whole map and those that patrol a free lane."""

import math

import numpy as np

from adwa_jax.scenario import Movers
from scenarios.generators.assembly import Point, centre, movers_of
from scenarios.generators.connectivity import Cell, inflated
from scenarios.generators.draws import Draws
from scenarios.generators.task_spec import TaskSpec

LEAST_LANE = 2.0
"""A patrolled lane is at least this long, from turning point to turning point [m]."""
TRIES_PER_MOVER = 16
"""Cells looked at for each patrolling mover before the map counts as having no lane for it."""


def crossing_movers(draws: Draws, occupied: np.ndarray, start: Cell, goal: Cell, spec: TaskSpec,
                    resolution: float) -> Movers:
    """Up to `spec.mover_count` movers on straight lines, mirrored where the disc meets the map's border.

    They start within free cells farther than `spec.mover_distance` from start and goal, pass through known
    obstacles, and keep a speed and a heading drawn from `spec.mover_speed` and the full circle. Consumes
    `draws`.

    occupied: [H, W] bool; the map's origin is (0, 0).
    """
    size = np.array(occupied.shape[::-1]) * resolution
    slack = math.sqrt(0.5) * resolution + math.sqrt(2.0) * spec.mover_radius[1]  # to the cell's side, off the border
    cells = _far_cells(occupied, start, goal, spec, resolution, slack)
    movers = []
    for _ in range(spec.mover_count if len(cells) else 0):
        radius, speed = draws.uniform(*spec.mover_radius), draws.uniform(*spec.mover_speed)
        heading = draws.uniform(0.0, 2.0 * math.pi)
        row, column = divmod(int(cells[draws.index(len(cells))]), occupied.shape[1])
        inside = (np.array([column, row]) + draws.uniforms(2)) * resolution
        low, high = np.full(2, radius), size - radius
        velocity = speed * np.array([math.cos(heading), math.sin(heading)])
        movers.append((radius, np.clip(inside, low, high), velocity, low, high))
    return _collected(movers)


def patrolling_movers(draws: Draws, occupied: np.ndarray, start: Cell, goal: Cell, spec: TaskSpec,
                      resolution: float, origin: Point = (0.0, 0.0)) -> Movers:
    """Up to `spec.mover_count` movers that go to and fro along straight lanes of the known map.

    A lane is a run of cells, along x or y, in each of which the largest mover touches no occupied square; a
    mover keeps to the cells' centres. They start farther than `spec.mover_distance` from start and goal.
    Consumes `draws`.

    occupied: [H, W] bool; origin: the outer corner of cell (0, 0) [m].
    """
    if spec.mover_count == 0:
        return _collected([])
    closed = inflated(occupied, resolution, spec.mover_radius[1])
    cells = _far_cells(closed, start, goal, spec, resolution, slack=0.0)
    movers = []
    for _ in range(TRIES_PER_MOVER * spec.mover_count if len(cells) else 0):
        if len(movers) == spec.mover_count:
            break
        cell = divmod(int(cells[draws.index(len(cells))]), occupied.shape[1])
        along_x, sign = draws.index(2), 2 * draws.index(2) - 1
        radius, speed = draws.uniform(*spec.mover_radius), draws.uniform(*spec.mover_speed)
        low, high = _lane(closed, cell, along_x, resolution, origin)
        if (high - low)[1 - along_x] >= LEAST_LANE:
            velocity = sign * speed * np.array([along_x, 1 - along_x])
            movers.append((radius, centre(cell, resolution, origin), velocity, low, high))
    return _collected(movers)


def _collected(movers: list[tuple]) -> Movers:
    """Movers from (radius, position, velocity, low, high) of each."""
    radius, position, velocity, low, high = zip(*movers, strict=True) if movers else ((),) * 5
    return movers_of(radius, position, velocity, low, high)


def _far_cells(closed: np.ndarray, start: Cell, goal: Cell, spec: TaskSpec, resolution: float,
               slack: float) -> np.ndarray:
    """[N] int, row-major: open cells, farther than the mover distance + slack [m] from start and goal."""
    least = (spec.mover_distance + slack) / resolution
    far = ~closed
    for row, column in (start, goal):
        along_y, along_x = (np.arange(far.shape[0]) - row) ** 2, (np.arange(far.shape[1]) - column) ** 2
        far &= along_y[:, None] + along_x[None, :] > least * least
    return np.flatnonzero(far)


def _lane(closed: np.ndarray, cell: Cell, along_x: int, resolution: float,
          origin: Point) -> tuple[np.ndarray, np.ndarray]:
    """Low and high corner (x, y) [m] of the box of the mover's centre in the lane through a cell.

    Along the lane from centre to centre of its last cells; across it a cell wide, so that no side is of
    length 0.
    """
    row, column = cell
    line, here = (closed[row], column) if along_x else (closed[:, column], row)
    stops = np.concatenate([[-1], np.flatnonzero(line), [line.size]])
    after = np.searchsorted(stops, here)
    along, across = np.array([stops[after - 1] + 1.5, stops[after] - 0.5]), np.array([0.0, 1.0])
    across += row if along_x else column
    x, y = (along, across) if along_x else (across, along)
    return tuple(np.stack([x, y], axis=1) * resolution + origin)  # pyright: ignore
