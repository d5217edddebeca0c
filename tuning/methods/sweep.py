"""The paper's sweep (§3.4): each parameter in turn over its range, the others fixed at their defaults."""

from math import floor, log10

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from scenarios.errors import InputError
from tuning.methods.method import Problem, Search
from tuning.space import Parameter, Space

FEWEST = 2  # candidates a parameter, below which a curve says nothing
SAME = 1e-9  # relative; by which one constant may come out differently by rounding


class Settings(BaseModel):
    """Of this method."""

    model_config = ConfigDict(extra="forbid", strict=True)

    step: float = Field(0.1, ge=1e-3, le=1e6)
    """Between neighbours: in the parameter's own units where linear, in decades where log; counts take every value."""


def sweep(problem: Problem) -> Search:
    """One generation a parameter. Where the budget pays for fewer points, those of every parameter are thinned evenly.

    Values that eq. 5 forbids beside the other defaults, and the default itself, are left out. InputError if the budget
    pays for fewer than `FEWEST` candidates a parameter.
    """
    lines = _lines(problem.space, Settings.model_validate(problem.settings).step)
    if problem.candidates < FEWEST * len(lines):
        raise InputError(f"method.episodes: pays for {problem.candidates} candidates; a sweep of {len(lines)} "
                         f"parameters needs {FEWEST * len(lines)} at least; raise it, or sweep fewer")  # fmt: skip
    for points in _thinned(lines, problem.candidates):
        if len(points):
            yield points


def needed(space: Space, settings: Settings) -> int:
    """Candidates of the whole sweep."""
    return sum(len(points) for points in _lines(space, settings.step))


def _swept_point(space: Space) -> tuple[np.ndarray, np.ndarray]:
    """[D] in the unit cube, and [D] its constants."""
    unit = space.unit(space.default[None])
    return unit[0], space.values(unit)[0]


def _lines(space: Space, step: float) -> list[np.ndarray]:
    """D, each [N, D] points of the unit cube."""
    return [_line(space, index, step) for index in range(len(space.parameters))]


def _line(space: Space, index: int, step: float) -> np.ndarray:
    """[N, D] points along one parameter, whose constants all differ from each other and from the default."""
    unit, constants = _swept_point(space)
    levels = _levels(space.parameters[index], step)
    wanted = np.tile(constants, (len(levels), 1))
    wanted[:, index] = levels
    points = np.tile(unit, (len(levels), 1))
    points[:, index] = space.unit(wanted)[:, index]
    kept = np.isclose(space.values(points), wanted, rtol=SAME, atol=SAME).all(axis=1)
    return points[kept & ~np.isclose(wanted, space.default, rtol=SAME, atol=SAME).all(axis=1)]


def _levels(parameter: Parameter, step: float) -> np.ndarray:
    """[N] constants from the low end upwards."""
    low, high = parameter.low, parameter.high
    if parameter.scale == "integer":
        return np.arange(low, high + 1.0)
    if parameter.scale == "log":
        return low * 10.0 ** (step * np.arange(floor(log10(high / low) / step + SAME) + 1))
    return low + step * np.arange(floor((high - low) / step + SAME) + 1)


def _thinned(lines: list[np.ndarray], candidates: int) -> list[np.ndarray]:
    """The same share of every line, `FEWEST` points at least, its ends among them; no more than the candidates."""
    counts = np.array([len(points) for points in lines])
    if counts.sum() <= candidates:
        return lines
    fewest = np.minimum(counts, FEWEST)
    spare = (candidates - fewest.sum()) / (counts - fewest).sum()
    kept = fewest + np.floor(spare * (counts - fewest) + SAME).astype(np.int64)
    return [points[np.linspace(0, len(points) - 1, count).round().astype(np.int64)]
            for points, count in zip(lines, kept, strict=True)]  # fmt: skip
