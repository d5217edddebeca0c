"""Evaluations on disk: a zarr group written by tiles so that no kill leaves a wrong one.

A tile is one candidate on a range of scenarios, and one chunk. Its mark, written after it, holds a checksum of it and
of the candidate's constants: what is torn, damaged or of other constants is not done.

Dimension letters: W candidates; S scenarios; T tiles of a candidate; D parameters; M figures.
"""

import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import groupby, product
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from adwa_jax.metrics import Measures, PlannedMeasures
from scenarios.errors import InputError
from tuning.console import UNITS
from tuning.evaluations import Evaluations

WHOLE = ("outcome", "brakings", "replans", "key_point_count", "expansions", "breaking_points",
         "danger_points", *(f"planned_{name}" for name in PlannedMeasures._fields))  # fmt: skip
# Of the engine's columns, in its order.
FIGURES: dict[str, type] = {
    name: np.bool_ if name == "hit_while_stopped" else np.int32 if name in WHOLE else np.float32
    for name in ("optimal_length", "planned_length", "planned_length_ratio", "key_point_length", "key_point_count",
                 "expansions", *(f"planned_{name}" for name in PlannedMeasures._fields), "outcome",
                 "hit_while_stopped", "brakings", "replans", *Measures._fields)
}  # fmt: skip
TILE_WIDTH = 64  # scenarios of a tile: seconds of work, and a file of a few kilobytes
MARK = 1 << 32  # beside the checksum, so that a mark is never 0


class Store:
    """The evaluations of one suite. Figures are kept as float32, in which whole ones below 2²⁴ are exact."""

    def __init__(self, path: Path, parameters: Sequence[str], names: Sequence[str],
                 figures: Sequence[str] = tuple(FIGURES)):
        """Open the group, or make it. InputError if it is another job's, or its description is damaged."""
        self.path, self._figures = path, tuple(figures)
        self.width = min(TILE_WIDTH, len(names))
        self.tiles = [slice(start, min(start + self.width, len(names))) for start in range(0, len(names), self.width)]
        self._attributes = {"parameters": list(parameters), "scenarios": list(names), "figures": list(figures),
                            "units": {name: UNITS.get(name, "") for name in figures}}  # fmt: skip
        for unfinished in path.rglob("*.partial"):  # of a process that was killed
            unfinished.unlink()
        self._arrays = self._opened()
        self._marks = np.zeros((0, len(self.tiles)), np.uint64)  # [W, T], those that hold

    def admit(self, first: int, values: np.ndarray, generation: np.ndarray) -> np.ndarray:
        """Let the rows from first have the constants [C, D], asked for by generation [C]; [C, T] bool: which of their
        tiles are done.
        """
        last = first + len(values)
        self._grow(last)
        rows = slice(first, last)
        if not _same(self._arrays["values"], rows, values):
            self._arrays["values"][rows] = values
        if not _same(self._arrays["generation"], rows, generation):
            self._arrays["generation"][rows] = generation
        self._marks[rows] = _holding(self._arrays, rows, values, self.tiles)[0]
        return self._marks[rows] > 0

    def write(self, rows: np.ndarray, tiles: slice, values: np.ndarray, columns: Mapping[str, np.ndarray]) -> None:
        """Keep whole tiles of candidates, rows: [C] ascending. values: [C, D]; columns: name -> [C, of the tiles]."""
        block = np.stack([columns[name].astype(np.float32) for name in self._figures], axis=-1)
        start, stop = self.tiles[tiles.start].start, self.tiles[tiles.stop - 1].stop
        for places in _runs(rows):
            within = slice(int(rows[places.start]), int(rows[places.stop - 1]) + 1)
            self._arrays["figures"][within, start:stop] = block[places]
        for place, row in enumerate(rows.tolist()):
            for tile in range(tiles.start, tiles.stop):
                part = self.tiles[tile]
                figures = block[place, part.start - start : part.stop - start]
                self._marks[row, tile] = _mark(values[place], figures)
        for places in _runs(rows):
            within = slice(int(rows[places.start]), int(rows[places.stop - 1]) + 1)
            self._arrays["done"][within] = self._marks[within]

    def read(self, rows: np.ndarray, tiles: slice) -> dict[str, np.ndarray]:
        """Columns, name -> [C, of the tiles], of tiles that are done."""
        start, stop = self.tiles[tiles.start].start, self.tiles[tiles.stop - 1].stop
        figures = self._arrays["figures"]
        block = np.concatenate([np.asarray(figures[int(rows[part.start]) : int(rows[part.stop - 1]) + 1, start:stop])
                                for part in _runs(rows)])  # fmt: skip
        return _columns(block, self._figures)

    def _opened(self) -> dict[str, Any]:
        try:
            if not self.path.exists():
                _make(self.path, self._attributes, len(self.tiles), self.width)
            group = zarr.open_group(self.path, mode="r+")
            arrays = {name: group[name] for name in ("figures", "done", "values", "generation")}
            found = {key: group.attrs.get(key) for key in self._attributes}
        except (KeyError, ValueError, TypeError, FileNotFoundError) as error:
            raise InputError(f"{self.path}: damaged ({' '.join(str(error).split())}); must be a store of evaluations; "
                             "remove it, and resume the job: it is driven anew") from None  # fmt: skip
        if found != self._attributes:
            raise InputError(f"{self.path}: of other parameters, scenarios or figures; a store belongs to one job; "
                             "run the job anew in another folder")  # fmt: skip
        return arrays

    def _grow(self, count: int) -> None:
        for array in self._arrays.values():
            if array.shape[0] < count:
                array.resize((count, *array.shape[1:]))
        missing = count - len(self._marks)
        if missing > 0:
            self._marks = np.concatenate([self._marks, np.zeros((missing, len(self.tiles)), np.uint64)])


def as_evaluations(path: Path) -> Evaluations:
    """All that is done in the store at a path; candidates of which nothing is are left out at the end."""
    found, _ = read_store(path)
    some = np.flatnonzero(found.done.any(axis=1))
    return found.rows(np.arange(some[-1] + 1 if some.size else 0))


def damaged_tiles(path: Path) -> int:
    """How many tiles of the store at a path were written and are no longer as they were."""
    group = zarr.open_group(path, mode="r")
    arrays: dict[str, Any] = {name: group[name] for name in ("figures", "done", "values")}
    count = min(array.shape[0] for array in arrays.values())
    scenarios, width = arrays["figures"].shape[1], arrays["figures"].chunks[1]
    tiles = [slice(start, min(start + width, scenarios)) for start in range(0, scenarios, width)]
    kept, _ = _holding(arrays, slice(0, count), np.asarray(arrays["values"][:]), tiles)
    return int((_decoded(arrays["done"], slice(0, count), [slice(None)], 0) > 0).sum() - (kept > 0).sum())


def read_store(path: Path) -> tuple[Evaluations, tuple[str, ...]]:
    """What the store at a path holds, and the scenarios' names. InputError where there is none."""
    try:
        group = zarr.open_group(path, mode="r")
        arrays: dict[str, Any] = {name: group[name] for name in ("figures", "done", "values", "generation")}
        parameters, names, figures = (tuple(group.attrs[key])  # pyright: ignore
                                      for key in ("parameters", "scenarios", "figures"))  # fmt: skip
        values, generation = np.asarray(arrays["values"][:]), np.asarray(arrays["generation"][:])
    except (KeyError, ValueError, TypeError, FileNotFoundError, RuntimeError) as error:
        raise InputError(f"{path}: cannot be read ({' '.join(str(error).split())}); must be a store of a job's "
                         "evaluations; name a job's folder, or resume the job") from None  # fmt: skip
    width = arrays["figures"].chunks[1]
    tiles = [slice(start, min(start + width, len(names))) for start in range(0, len(names), width)]
    count = min(array.shape[0] for array in arrays.values())
    marks, block = _holding(arrays, slice(0, count), values, tiles)
    done = np.repeat(marks > 0, [part.stop - part.start for part in tiles], axis=1)
    block[~done] = 0.0
    return Evaluations(parameters, values[:count], generation[:count], _columns(block, figures), done), names


def _make(path: Path, attributes: Mapping[str, Any], tiles: int, width: int) -> None:
    """An empty store, moved to its place once it is whole."""
    unfinished = path.with_name(f"{path.name}.partial")
    group = zarr.create_group(unfinished, attributes=dict(attributes), overwrite=True)
    scenarios, parameters, figures = (len(attributes[key]) for key in ("scenarios", "parameters", "figures"))

    def array(name: str, kind: str, fill: Any, shape: tuple[int, ...], chunks: tuple[int, ...], *names: str) -> None:
        group.create_array(name, shape=(0, *shape), chunks=(1, *chunks), dtype=kind, fill_value=fill,
                           dimension_names=("candidate", *names))  # fmt: skip

    array("figures", "float32", np.nan, (scenarios, figures), (width, figures), "scenario", "figure")
    array("done", "uint64", 0, (tiles,), (tiles,), "tile")
    array("values", "float64", np.nan, (parameters,), (parameters,), "parameter")
    array("generation", "int32", -1, (), ())
    unfinished.rename(path)


def _holding(arrays: Mapping[str, Any], rows: slice, values: np.ndarray,
             tiles: Sequence[slice]) -> tuple[np.ndarray, np.ndarray]:
    """[C, T] uint64 the marks of tiles that are as they were written, 0 for the others; and the figures [C, S, M]."""
    marks = _decoded(arrays["done"], rows, [slice(None)], 0)
    figures = _decoded(arrays["figures"], rows, tiles, np.nan)
    kept = np.zeros_like(marks)
    for row, tile in np.argwhere(marks > 0).tolist():
        if _mark(values[row], figures[row, tiles[tile]]) == marks[row, tile]:
            kept[row, tile] = marks[row, tile]
    return kept, figures


def _decoded(array: Any, rows: slice, parts: Sequence[slice], fill: float) -> np.ndarray:
    """Rows of an array; `fill` in those parts of a row, each a chunk, that cannot be decoded."""
    try:
        return np.asarray(array[rows])
    except Exception:  # codecs raise what they like
        found = np.full((rows.stop - rows.start, *array.shape[1:]), fill, array.dtype)
        for row, part in product(range(rows.start, rows.stop), parts):
            with suppress(Exception):
                found[row - rows.start, part] = array[row, part]
        return found


def _same(array: Any, rows: slice, values: np.ndarray) -> bool:
    try:
        return np.array_equal(np.asarray(array[rows]), values)
    except Exception:
        return False


def _mark(values: np.ndarray, figures: np.ndarray) -> int:
    """Of a tile [S, M] of float32 and its candidate's constants [D]."""
    content = np.ascontiguousarray(values, np.float64).tobytes() + np.ascontiguousarray(figures, np.float32).tobytes()
    return MARK | zlib.crc32(content)


def _columns(block: np.ndarray, figures: Sequence[str]) -> dict[str, np.ndarray]:
    """Figures [W, S, M] by name, in the engine's types."""
    return {name: block[..., index].astype(FIGURES[name]) for index, name in enumerate(figures)}


def _runs(rows: np.ndarray) -> Iterator[slice]:
    """Places of consecutive rows."""
    places = groupby(enumerate(rows.tolist()), key=lambda pair: pair[1] - pair[0])
    for _, members in places:
        found = [place for place, _ in members]
        yield slice(found[0], found[-1] + 1)
