"""Scenarios of unequal size in one batch, without changing any answer.

Sizes are rounded up to ladders, so that few shapes are compiled; a scenario's padded shape depends on that scenario
alone, never on its neighbours. Added cells are occupied and not hidden, added squares and movers invalid; `height` and
`width` stay.
Dimension letters: H, W map; S unknown squares; M movers; J track points; B scenarios in a batch.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax
import numpy as np

from adwa_jax.grid import Grid
from adwa_jax.scenario import Movers, Scenario, UnknownSquares


@dataclass(frozen=True, order=True)
class PaddedShape:
    """Static sizes of a padded scenario."""

    rows: int  # H
    columns: int  # W
    squares: int  # S
    movers: int  # M
    track_points: int  # J
    hidden: bool = False  # whether `Scenario.hidden` is [H, W]; otherwise it is [0, 0]


def padded_shape(scenario: Scenario) -> PaddedShape:
    """The least rungs that hold an unbatched scenario.

    Rows and columns: 16, 24, 32, 48, 64, 96, … (2ᵏ and 1.5 · 2ᵏ). Squares and movers: 0, 8, 16, 32, 64, …
    Track points: 0, 16, 64, 256, …
    """
    rows, columns = np.shape(scenario.grid.occupied)
    movers, points, _ = np.shape(scenario.movers.track)
    return PaddedShape(
        rows=ladder_size(rows),
        columns=ladder_size(columns),
        squares=_rung(len(scenario.squares.valid), least=8, factor=2),
        movers=_rung(movers, least=8, factor=2),
        track_points=_rung(points, least=16, factor=4),
        hidden=np.size(scenario.hidden) > 0,
    )


def pad(scenario: Scenario, shape: PaddedShape) -> Scenario:
    """The unbatched scenario with numpy leaves of `shape`.

    Raises ValueError if the scenario is larger than the shape.
    """
    return replace(
        scenario,
        grid=pad_grid(scenario.grid, shape.rows, shape.columns),
        hidden=_filled(scenario.hidden, (shape.rows, shape.columns) if shape.hidden else (0, 0), False),
        squares=_pad_squares(scenario.squares, shape.squares),
        movers=_pad_movers(scenario.movers, shape.movers, shape.track_points),
    )


def pad_grid(grid: Grid, rows: int, columns: int) -> Grid:
    """The unbatched grid with `rows` × `columns` cells; the added ones are occupied."""
    return replace(grid, occupied=_filled(grid.occupied, (rows, columns), True))


def stack(scenarios: Sequence[Scenario]) -> Scenario:
    """One scenario with a leading axis B and numpy leaves, from B ≥ 1 scenarios of one padded shape.

    Raises ValueError if their shapes differ.
    """
    return jax.tree.map(lambda *leaves: np.stack(leaves), *scenarios)


def _pad_squares(squares: UnknownSquares, count: int) -> UnknownSquares:
    """Squares up to `count`; the added ones are invalid points at (0, 0)."""
    return UnknownSquares(
        centre=_filled(squares.centre, (count, 2), 0.0),
        half_width=_filled(squares.half_width, (count,), 0.0),
        rounding=_filled(squares.rounding, (count,), 0.0),
        valid=_filled(squares.valid, (count,), False),
    )


def _pad_movers(movers: Movers, count: int, points: int) -> Movers:
    """Movers up to `count`; the added ones are invalid points at rest at (0, 0) in a box of 1 m."""
    return Movers(
        radius=_filled(movers.radius, (count,), 0.0),
        position=_filled(movers.position, (count, 2), 0.0),
        velocity=_filled(movers.velocity, (count, 2), 0.0),
        low=_filled(movers.low, (count, 2), 0.0),
        high=_filled(movers.high, (count, 2), 1.0),
        track=_filled(_lengthened(movers.track, points), (count, points, 3), 0.0),
        track_length=_filled(movers.track_length, (count,), 0),
        period=_filled(movers.period, (count,), 0.0),
        valid=_filled(movers.valid, (count,), False),
    )


def _lengthened(track: jax.Array, points: int) -> jax.Array:
    """Tracks [M, J, 3] up to `points` rows, the last row repeated; tracks without rows stay so."""
    missing = points - track.shape[1]
    if missing <= 0 or track.shape[1] == 0:
        return track
    return np.pad(track, ((0, 0), (0, missing), (0, 0)), mode="edge")  # pyright: ignore


def _filled(array: jax.Array, shape: tuple[int, ...], value: float | bool) -> jax.Array:
    """The array enlarged at its ends to `shape`, with `value` in what is added."""
    array_shape = np.shape(array)
    if any(size > room for size, room in zip(array_shape, shape, strict=True)):
        raise ValueError(f"shape: {shape}; must hold the scenario's {array_shape}; take its padded_shape")
    added = [(0, room - size) for size, room in zip(array_shape, shape, strict=True)]
    return np.pad(np.asarray(array), added, constant_values=value)  # pyright: ignore


def ladder_size(size: int) -> int:
    """The least of 16, 24, 32, 48, 64, 96, … that is ≥ `size`."""
    rung = 16
    while rung < size:
        rung = rung * 3 // 2 if rung & (rung - 1) == 0 else rung * 4 // 3
    return rung


def _rung(size: int, least: int, factor: int) -> int:
    rung = least if size else 0
    while rung < size:
        rung *= factor
    return rung
