"""Moving obstacles of the DynaBARN benchmark: discs that move along key frames over and over.

Dimension letters: J key frames of an obstacle.
"""

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from scenarios.formats.reading import bad_input, number, read_lines, shown

WORLDS_OF_A_TIER = 20
"""Obstacles go at 0.5-0.95, 1.0-1.45 and 1.4-1.95 m/s in worlds 0-19 (tier 1), 20-39 (2) and 40-59 (3)."""
LEAST_STEP = 0.01
"""Key frames of an obstacle are at least so far apart [s]."""

_COLUMNS = ("world", "obstacle", "period_s", "t_s", "x_m", "y_m")
_KIND = "a file of DynaBARN key frames"

Row = tuple[str, list[float]]
"""File and line, and the values of `_COLUMNS`."""


def load_dynabarn(path: str | Path) -> list[tuple[str, list[np.ndarray]]]:
    """Read key frames, CSV with a header and at least the columns world, obstacle, period_s, t_s, x_m, y_m.

    Returns each world as (name, tracks), `world_22-tier2` by name, in the file's order: a track for each obstacle,
    [J, 3] float64, rows t [s], x, y [m], from t = 0 to its period. There it starts anew, where that may be. Raises
    InputError naming file and line for rows that are not such numbers or not in order of t.
    """
    rows: dict[tuple[float, float], list[Row]] = {}
    for where, values in _rows(path):
        rows.setdefault((values[0], values[1]), []).append((where, values))
    if not rows:
        raise bad_input(path, "no key frame", f"{_KIND} has a row for each", "check that this is such a file")
    worlds: dict[float, list[np.ndarray]] = {}
    for (world, _), frames in rows.items():
        worlds.setdefault(world, []).append(_track(frames))
    return [(f"world_{int(world)}-tier{int(world) // WORLDS_OF_A_TIER + 1}", tracks)
            for world, tracks in worlds.items()]


def _rows(path: str | Path) -> Iterator[Row]:
    lines = csv.reader(read_lines(path, _KIND))
    header = next(lines, [])
    for column in _COLUMNS:
        if column not in header:
            raise bad_input(f"{path}:1", f"no column '{column}'", f"{_KIND} is CSV with the columns "
                            f"{', '.join(_COLUMNS)}", "check that this is such a file")
    for line in lines:
        where = f"{path}:{lines.line_num}"
        if len(line) != len(header):
            raise bad_input(where, f"{len(line)} values", f"the header names {len(header)}", "mend the line")
        named = dict(zip(header, line, strict=True))
        yield where, [_value(where, column, named[column]) for column in _COLUMNS]


def _value(where: str, column: str, text: str) -> float:
    value = number(f"{where}, {column}", text, "must be a finite number", "mend the line")
    if column in ("world", "obstacle") and (value < 0 or value != int(value)):
        raise bad_input(f"{where}, {column}", shown(text), "must be a whole number from 0", "mend the line")
    return value


def _track(frames: list[Row]) -> np.ndarray:
    """[J, 3] of one obstacle, checked: from 0 to its period, in order."""
    track = np.array([values[3:] for _, values in frames])
    period = frames[0][1][2]
    for index, (where, values) in enumerate(frames):
        if values[2] != period:
            raise bad_input(where, f"period_s {values[2]:g}", f"the obstacle's period is {period:g}", "mend the line")
        if index and values[3] - track[index - 1, 0] < LEAST_STEP * 0.99:
            raise bad_input(where, f"t_s {values[3]:g}", f"key frames are in order of time, {LEAST_STEP:g} s apart or "
                            "more", "sort the rows")
    if len(track) < 2 or track[0, 0] != 0.0 or track[-1, 0] != period:
        raise bad_input(frames[-1][0], f"{len(track)} key frames from {track[0, 0]:g} to {track[-1, 0]:g} s",
                        f"an obstacle has at least two, from 0 to its period {period:g} s", "add the missing rows")
    return track
