"""Scenarios of unequal size as a handful of flat arrays, and back, bit for bit.

For each field: one array with the values of all scenarios end to end, and beside it, under the name with `.shape`, the
shape of each [N, dimensions]. Maps, known and hidden cells, are stored once however many scenarios share them; `grid`
[N] int32 says which.
Dimension letters: N scenarios or maps; H, W map; h, w hidden cells; S unknown squares; M movers; J track points.
"""

import math
from collections.abc import Mapping, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from adwa_jax.grid import Grid
from adwa_jax.scenario import Movers, Scenario, UnknownSquares

Fields = Mapping[str, tuple[type, tuple[str | int, ...]]]
"""Name of a field: its dtype and its shape, letters standing for sizes that may differ between scenarios."""

MAP_FIELDS: Fields = {
    "grid.occupied": (np.bool_, ("H", "W")),
    "grid.height": (np.int32, ()),
    "grid.width": (np.int32, ()),
    "grid.resolution": (np.float32, ()),
    "grid.origin": (np.float32, (2,)),
    "hidden": (np.bool_, ("h", "w")),
}
SQUARES_FIELDS: Fields = {
    "squares.centre": (np.float32, ("S", 2)),
    "squares.half_width": (np.float32, ("S",)),
    "squares.rounding": (np.float32, ("S",)),
    "squares.valid": (np.bool_, ("S",)),
}
MOVERS_FIELDS: Fields = {
    "movers.radius": (np.float32, ("M",)),
    "movers.position": (np.float32, ("M", 2)),
    "movers.velocity": (np.float32, ("M", 2)),
    "movers.low": (np.float32, ("M", 2)),
    "movers.high": (np.float32, ("M", 2)),
    "movers.track": (np.float32, ("M", "J", 3)),
    "movers.track_length": (np.int32, ("M",)),
    "movers.period": (np.float32, ("M",)),
    "movers.valid": (np.bool_, ("M",)),
}
TASK_FIELDS: Fields = {
    "start": (np.float32, (3,)),
    "heading_given": (np.bool_, ()),
    "goal": (np.float32, (2,)),
    "goal_tolerance": (np.float32, ()),
    "time_limit": (np.float32, ()),
    "reference_length": (np.float32, ()),
}
SCENARIO_FIELDS: Fields = {**TASK_FIELDS, **SQUARES_FIELDS, **MOVERS_FIELDS}


def packed(scenarios: Sequence[Scenario]) -> dict[str, np.ndarray]:
    """The flat arrays of unbatched scenarios.

    Raises ValueError for a leaf that has not the documented dtype or number of dimensions.
    """
    first_with = {map_of(scenario): scenario for scenario in reversed(scenarios)}
    maps = list(reversed(first_with.values()))
    number = {map_of(scenario): index for index, scenario in enumerate(maps)}
    index = np.array([number[map_of(scenario)] for scenario in scenarios], np.int32)
    return {"grid": index, **_flat(MAP_FIELDS, maps), **_flat(SCENARIO_FIELDS, scenarios)}


def unpacked(arrays: Mapping[str, np.ndarray], count: int) -> list[Scenario]:
    """The `count` scenarios in the flat arrays.

    Raises ValueError, saying what is wrong, for missing arrays, other dtypes and shapes that do not fit together.
    """
    index = _array(arrays, "grid", np.int32, 1)
    total = len(_array(arrays, "grid.height.shape", np.int64, 2))
    if len(index) != count or (count and not 0 <= index.min() <= index.max() < total):
        raise ValueError(f"array 'grid' does not give one of the {total} grids to each of {count} scenarios")
    maps = [_map(leaves) for leaves in _rows(arrays, MAP_FIELDS, total)]
    rows = _rows(arrays, SCENARIO_FIELDS, count)
    return [_scenario(*maps[place], leaves=row) for place, row in zip(index.tolist(), rows, strict=True)]


def map_of(scenario: Scenario) -> tuple[int, int]:
    """What scenarios of one map have in common; all that hide nothing hide the same."""
    return id(scenario.grid), id(scenario.hidden) if np.size(scenario.hidden) else 0


def _map(leaves: tuple[Any, ...]) -> tuple[Grid, Any]:
    """Grid and hidden cells of leaves in the order of `MAP_FIELDS`."""
    *grid, hidden = leaves
    if hidden.shape not in ((0, 0), grid[0].shape):
        raise ValueError("array 'hidden.shape' holds sizes other than those of the map and 0, 0")
    return Grid(*grid), hidden


def _scenario(grid: Grid, hidden: Any, leaves: tuple[Any, ...]) -> Scenario:
    """The scenario of leaves in the order of `SCENARIO_FIELDS`, which is that of the classes' fields."""
    task, rest = leaves[: len(TASK_FIELDS)], leaves[len(TASK_FIELDS) :]
    parts: list[Any] = [*task, UnknownSquares(*rest[: len(SQUARES_FIELDS)]), Movers(*rest[len(SQUARES_FIELDS) :])]
    return Scenario(grid, hidden, *parts)


def _flat(fields: Fields, holders: Sequence[Scenario]) -> dict[str, np.ndarray]:
    """The arrays of the fields of all holders."""
    arrays = {}
    for name, (dtype, dims) in fields.items():
        leaves = [np.asarray(leaf) for leaf in map(attrgetter(name), holders)]
        if any(leaf.dtype != dtype or leaf.ndim != len(dims) for leaf in leaves):
            raise ValueError(f"{name}: a leaf is not {np.dtype(dtype)} with shape {dims}")
        arrays[name] = np.concatenate([leaf.ravel() for leaf in leaves] or [np.zeros(0, dtype)])
        shapes = np.array([leaf.shape for leaf in leaves], np.int64)
        arrays[f"{name}.shape"] = shapes.reshape(len(leaves), len(dims))
    return arrays


def _rows(arrays: Mapping[str, np.ndarray], fields: Fields, count: int) -> list[tuple[Any, ...]]:
    """For each of `count` holders the leaves of its fields, in the order of `fields`."""
    sizes: dict[str, np.ndarray] = {}
    columns = [_leaves(arrays, name, dtype, dims, count, sizes) for name, (dtype, dims) in fields.items()]
    return list(zip(*columns, strict=True))


def _leaves(arrays: Mapping[str, np.ndarray], name: str, dtype: type, dims: tuple[str | int, ...], count: int,
            sizes: dict[str, np.ndarray]) -> list[np.ndarray]:
    """One field of all holders; `sizes` collects what the letters stand for, [count] each."""
    values, shapes = _array(arrays, name, dtype, 1), _array(arrays, f"{name}.shape", np.int64, 2)
    if shapes.shape != (count, len(dims)) or (shapes < 0).any():
        raise ValueError(f"array '{name}.shape' does not hold {count} shapes of {len(dims)} sizes")
    for size, dim in zip(shapes.T, dims, strict=True):
        expected = sizes.setdefault(dim, size) if isinstance(dim, str) else np.full(count, dim)
        if (size != expected).any():
            raise ValueError(f"array '{name}.shape' holds sizes other than {dim}")
    ends = np.cumsum([math.prod(shape) for shape in shapes.tolist()], dtype=object).tolist()
    if (ends[-1] if ends else 0) != len(values):
        raise ValueError(f"array '{name}' holds {len(values)} values, its shapes ask for {ends[-1] if ends else 0}")
    starts = [0, *ends][: len(ends)]
    return [values[start:end].reshape(shape) for start, end, shape in zip(starts, ends, shapes.tolist(), strict=True)]


def _array(arrays: Mapping[str, np.ndarray], name: str, dtype: type, ndim: int) -> np.ndarray:
    if name not in arrays:
        raise ValueError(f"array '{name}' is missing")
    if arrays[name].dtype != dtype or arrays[name].ndim != ndim:
        found = f"{arrays[name].dtype} with {arrays[name].ndim} dimensions"
        raise ValueError(f"array '{name}' is {found}, not {np.dtype(dtype)} with {ndim}")
    return arrays[name]
