"""Numpy leaves for the pytrees of `adwa_jax`: exact dtypes, no device, no padding."""

from typing import Any

import numpy as np

from adwa_jax.grid import Grid
from adwa_jax.scenario import Movers, UnknownSquares


def leaf(value: Any, dtype: Any) -> Any:
    """A numpy array of exactly `dtype`; typed Any because the pytrees declare their leaves as jax arrays."""
    return np.asarray(value, dtype)


def numpy_grid(occupied: np.ndarray, resolution: float, origin: tuple[float, float]) -> Grid:
    """A Grid whose map is the whole of `occupied`, [H, W] bool; resolution and origin in metres."""
    height, width = occupied.shape
    return Grid(occupied=leaf(occupied, np.bool_), height=leaf(height, np.int32), width=leaf(width, np.int32),
                resolution=leaf(resolution, np.float32), origin=leaf(origin, np.float32))


def no_squares() -> UnknownSquares:
    """UnknownSquares with S = 0."""
    return UnknownSquares(centre=leaf(np.zeros((0, 2)), np.float32), half_width=leaf(np.zeros(0), np.float32),
                          rounding=leaf(np.zeros(0), np.float32), valid=leaf(np.zeros(0), np.bool_))


def none_hidden() -> Any:
    """`Scenario.hidden` of a world that is all on the map."""
    return leaf(np.zeros((0, 0)), np.bool_)


def tracked_movers(track: np.ndarray, track_length: np.ndarray, radius: float) -> Movers:
    """Movers that run their tracks once.

    track: [M, J, 3], rows t [s], x, y [m], padding repeats the last row; track_length: [M]; radius [m], the
    same for all.
    """
    movers = len(track)
    points = leaf(np.zeros((movers, 2)), np.float32)
    return Movers(radius=leaf(np.full(movers, radius), np.float32), position=points, velocity=points.copy(),
                  low=points.copy(), high=points.copy(), track=leaf(track, np.float32),
                  track_length=leaf(track_length, np.int32), period=leaf(np.zeros(movers), np.float32),
                  valid=leaf(np.ones(movers), np.bool_))


def no_movers() -> Movers:
    """Movers with M = 0."""
    return tracked_movers(np.zeros((0, 0, 3)), np.zeros(0), radius=0.0)
