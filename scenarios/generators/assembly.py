"""Numbers in, `Scenario` with numpy leaves of the documented types out.

Dimension letters: S unknown squares, M movers, J track points.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from adwa_jax.grid import Grid
from adwa_jax.scenario import Movers, Scenario, UnknownSquares
from scenarios.generators.connectivity import Cell
from scenarios.generators.task_spec import TaskSpec

Point = tuple[float, float]
"""(x, y) [m]."""


def float32(values: Any, *shape: int) -> Any:
    """The values as float32, reshaped where a shape is given (which is how an empty list gets one)."""
    array = np.asarray(values, np.float32)
    return array.reshape(shape) if shape else array


def int32(values: Any) -> Any:
    """The values as int32."""
    return np.asarray(values, np.int32)


def grid_of(occupied: np.ndarray, resolution: float, origin: Point = (0.0, 0.0)) -> Grid:
    """The map of occupied [H, W] bool; origin: the outer corner of cell (0, 0) [m]."""
    height, width = occupied.shape
    cells: Any = np.ascontiguousarray(occupied, dtype=np.bool_)
    return Grid(cells, int32(height), int32(width), float32(resolution), float32(origin))


def centre(cell: Cell, resolution: float, origin: Point = (0.0, 0.0)) -> Point:
    """(x, y) [m] of a cell's centre."""
    return (cell[1] + 0.5) * resolution + origin[0], (cell[0] + 0.5) * resolution + origin[1]


def squares_of(centres: Sequence[Point], half_width: float) -> UnknownSquares:
    """Unknown squares with sharp corners, all of one size, in [S] arrays."""
    count = len(centres)
    valid: Any = np.ones(count, np.bool_)
    half_widths, rounding = float32(np.full(count, half_width)), float32(np.zeros(count))
    return UnknownSquares(float32(centres, count, 2), half_widths, rounding, valid)


def discs_in(squares: UnknownSquares) -> UnknownSquares:
    """In place of sharp squares the discs that touch their sides."""
    return replace(squares, half_width=squares.rounding, rounding=squares.half_width)


def movers_of(radius: Sequence[float], position: Sequence[Point], velocity: Sequence[Point],
              low: Sequence[Point], high: Sequence[Point]) -> Movers:
    """Movers that keep their speed and are mirrored at their boxes; sequences of M."""
    count = len(radius)
    corners = [float32(points, count, 2) for points in (position, velocity, low, high)]
    return Movers(float32(radius, count), *corners, track=np.zeros((count, 0, 3), np.float32),  # pyright: ignore
                  track_length=int32(np.zeros(count)), period=float32(np.zeros(count)),
                  valid=np.ones(count, np.bool_))  # pyright: ignore


def walkers_of(radius: Sequence[float], tracks: Sequence[np.ndarray], period: Sequence[float]) -> Movers:
    """Movers with tracks, each [J, 3] (t [s], x, y [m]); shorter ones repeat their last row.

    Position and box are those of the track, the velocity is that of its first stretch.
    """
    count, longest = len(tracks), max((len(track) for track in tracks), default=0)
    padded = [np.pad(track, ((0, longest - len(track)), (0, 0)), mode="edge") for track in tracks]
    velocity = [(track[1, 1:] - track[0, 1:]) / (track[1, 0] - track[0, 0]) for track in tracks]
    first, low, high = ([pick(track[:, 1:]) for track in tracks] for pick in (_first, _lowest, _highest))
    valid: Any = np.ones(count, np.bool_)
    return Movers(float32(radius, count), float32(first, count, 2), float32(velocity, count, 2),
                  float32(low, count, 2), float32(high, count, 2), float32(padded, count, longest, 3),
                  int32([len(track) for track in tracks]).reshape(count), float32(period, count), valid)


def _first(points: np.ndarray) -> np.ndarray:
    return points[0]


def _lowest(points: np.ndarray) -> np.ndarray:
    return points.min(axis=0)


def _highest(points: np.ndarray) -> np.ndarray:
    return points.max(axis=0)


def scenario_of(grid: Grid, start: Point, goal: Point, spec: TaskSpec, squares: UnknownSquares,
                movers: Movers, heading: float | None = None) -> Scenario:
    """The episode from start to goal [m].

    heading [rad]: None leaves the robot to face its first key point, and the array holds the bearing of the
    goal.
    """
    bearing = math.atan2(goal[1] - start[1], goal[0] - start[0]) if heading is None else heading
    given: Any = np.asarray(heading is not None, np.bool_)
    hidden: Any = np.zeros((0, 0), np.bool_)
    return Scenario(grid, hidden, float32([*start, bearing]), given, float32(goal),
                    float32(spec.goal_tolerance), float32(spec.time_limit), float32(0.0), squares, movers)
