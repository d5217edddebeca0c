"""MovingAI benchmark files: grid maps (`.map`) and their lists of problems (`.scen`).

Frame: row 0 of the file is row 0 of the grid and y grows downwards, so the point (x, y) of a `.scen` is the
cell (row y, column x), whose centre is (x + 0.5, y + 0.5) at one metre a cell.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from scenarios.formats.map_file import MapFile
from scenarios.formats.reading import bad_input, read_lines, shown

PASSABLE = ".GS"
BLOCKED = "@OTW"  # W, water, joins only W: taken as blocked
SIGNIFICANT_DIGITS = 6  # of lengths printed without a fixed number of decimals
LENGTH_SLACK = 1e-5  # room for lengths that were summed in single precision

_MAP = "a MovingAI map"
_SCEN = "a MovingAI scenario file"
_LAYOUT = "lines 1 to 4 are 'type octile', 'height H', 'width W' and 'map'"


@dataclass(frozen=True)
class ScenEntry:
    """One problem of a `.scen` file. Cells are (x, y) = (column, row)."""

    line: int  # in the file, from 1
    bucket: int
    map_name: str  # base name only: the folder in the file may be stale
    width: int
    height: int
    start: tuple[int, int]
    goal: tuple[int, int]
    expected: float | None  # listed optimal length [cells]; None where the file says unreachable
    tolerance: float  # largest difference from `expected` that its printed digits explain
    expected_unreachable: bool  # listed length 0 although start and goal differ

    @property
    def start_point(self) -> tuple[float, float]:
        """Centre of the start cell, x, y [m] at one metre a cell."""
        return self.start[0] + 0.5, self.start[1] + 0.5

    @property
    def goal_point(self) -> tuple[float, float]:
        """Centre of the goal cell, x, y [m] at one metre a cell."""
        return self.goal[0] + 0.5, self.goal[1] + 0.5


def load_movingai_map(path: str | Path) -> MapFile:
    """Read a `.map`: `.`, `G`, `S` free; `@`, `O`, `T`, `W` occupied (`W`, water, joins only water).

    Resolution 1 m, origin (0, 0), y_down. Raises InputError naming file and line for any other header,
    character, row length or number of rows; blank lines may follow the last row.
    """
    lines = read_lines(path, _MAP)
    height, width = _map_size(path, lines)
    rows = lines[4:4 + height]
    if len(rows) < height:
        raise bad_input(f"{path}:{len(lines)}", f"the file ends after {len(rows)} rows",
                        f"line 2 promises height {height}", "fetch the map again or mend its height")
    for index, row in enumerate(rows):
        _check_row(f"{path}:{index + 5}", row, width)
    for index, extra in enumerate(lines[4 + height:]):
        if extra.strip():
            raise bad_input(f"{path}:{index + 5 + height}", shown(extra),
                            f"line 2 promises height {height} and nothing follows the last row",
                            "mend the height or remove the line")
    characters = np.array([list(row) for row in rows])
    occupied = np.isin(characters, list(BLOCKED))
    return MapFile(name=str(path), occupied=occupied, unknown=np.zeros_like(occupied), resolution=1.0,
                   origin=(0.0, 0.0), y_down=True)


def _map_size(path: str | Path, lines: Sequence[str]) -> tuple[int, int]:
    """Height and width from the four header lines."""
    wanted = (("type", "octile"), ("height", None), ("width", None), ("map", None))
    sizes: list[int] = []
    for index, (keyword, value) in enumerate(wanted):
        if index >= len(lines):
            raise bad_input(f"{path}:{len(lines)}", f"the file ends before '{keyword}'", _LAYOUT,
                            "fetch the map again")
        words = lines[index].split()
        fits = words == ["map"] if keyword == "map" else len(words) == 2 and words[0] == keyword
        if not fits or (value is not None and words[1] != value):
            raise bad_input(f"{path}:{index + 1}", shown(lines[index]), _LAYOUT,
                            "check that this is such a map")
        if keyword in ("height", "width"):
            sizes.append(_whole(f"{path}:{index + 1}", keyword, words[1], least=1))
    return sizes[0], sizes[1]


def _check_row(where: str, row: str, width: int) -> None:
    if len(row) != width:
        raise bad_input(where, f"row of {len(row)} characters", f"line 3 promises width {width}",
                        "fetch the map again or mend the row")
    if not set(row) <= set(PASSABLE + BLOCKED):
        column = next(k for k, character in enumerate(row) if character not in PASSABLE + BLOCKED)
        raise bad_input(where, f"character {shown(row[column])} in column {column + 1}",
                        f"cells are one of {' '.join(PASSABLE)} (free) {' '.join(BLOCKED)} (blocked)",
                        "replace the character")


def load_scen(path: str | Path) -> list[ScenEntry]:
    """Read a `.scen`: one entry a line, separated by tabs (map names may then hold spaces) or by spaces.

    Raises InputError naming file and line for another version, a wrong number of columns, text where a number
    belongs, and points outside the entry's width × height.
    """
    lines = read_lines(path, _SCEN)
    if lines[0].split() not in (["version", "1"], ["version", "1.0"]):
        raise bad_input(f"{path}:1", shown(lines[0]), "the first line is 'version 1' or 'version 1.0'",
                        f"check that this is {_SCEN}")
    rows = [(line, _columns(f"{path}:{line}", text))
            for line, text in enumerate(lines[1:], start=2) if text.strip()]
    if not rows:
        raise bad_input(path, "no scenario", "a line for each scenario follows the version",
                        "fetch the file again")
    decimals = fixed_decimals([columns[8] for _, columns in rows])
    return [_entry(f"{path}:{line}", line, columns, decimals) for line, columns in rows]


def fixed_decimals(lengths: Sequence[str]) -> int | None:
    """How many decimals every length of a file is printed with; None where they differ or one has none.

    A file printed to significant digits drops trailing zeros, so its decimals differ from line to line.
    """
    counts = {len(text.partition(".")[2]) if text.replace(".", "", 1).isdigit() else 0 for text in lengths}
    return counts.pop() if len(counts) == 1 and 0 not in counts else None


def length_tolerance(length: float, decimals: int | None) -> float:
    """Half a unit of the last digit, the sixth significant one if `decimals` is None, plus 1e-5."""
    if decimals is None:
        decimals = SIGNIFICANT_DIGITS - 1 - (math.floor(math.log10(length)) if length > 0.0 else 0)
    return 0.5 * 10.0 ** -decimals + LENGTH_SLACK


def _columns(where: str, text: str) -> list[str]:
    text = text.strip()
    columns = [column.strip() for column in text.split("\t")] if "\t" in text else text.split()
    if len(columns) != 9:
        raise bad_input(where, f"{len(columns)} columns, not 9",
                        "an entry is: bucket map width height start_x start_y goal_x goal_y optimal_length",
                        "separate them by tabs, or by spaces throughout")
    return columns


def _entry(where: str, line: int, columns: Sequence[str], decimals: int | None) -> ScenEntry:
    bucket = _whole(where, "bucket", columns[0], least=0)
    width = _whole(where, "width", columns[2], least=1)
    height = _whole(where, "height", columns[3], least=1)
    names = ("start x", "start y", "goal x", "goal y")
    start_x, start_y, goal_x, goal_y = (
        _whole(where, name, text, least=0, below=limit)
        for name, text, limit in zip(names, columns[4:8], (width, height, width, height), strict=True))
    length = _length(where, columns[8])
    unreachable = length == 0.0 and (start_x, start_y) != (goal_x, goal_y)
    return ScenEntry(line=line, bucket=bucket, map_name=PurePosixPath(columns[1].replace("\\", "/")).name,
                     width=width, height=height, start=(start_x, start_y), goal=(goal_x, goal_y),
                     expected=None if unreachable else length, tolerance=length_tolerance(length, decimals),
                     expected_unreachable=unreachable)


def _whole(where: str, name: str, text: str, least: int, below: int | None = None) -> int:
    """A whole number of at least `least` and, where given, less than `below`."""
    digits = text.isascii() and text.removeprefix("-").isdigit() and len(text) < 10
    if not digits or int(text) < least or (below is not None and int(text) >= below):
        limit = f"at least {least}" if below is None else f"from {least} to {below - 1}"
        raise bad_input(where, f"{name} {shown(text)}", f"must be a whole number, {limit}", "mend the number")
    return int(text)


def _length(where: str, text: str) -> float:
    try:
        length = float(text)
    except ValueError:
        length = math.nan
    if not (math.isfinite(length) and length >= 0.0):
        raise bad_input(where, f"length {shown(text)}", "must be a finite number, at least 0",
                        "mend the number")
    return length
