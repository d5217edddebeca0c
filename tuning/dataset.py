"""What was driven as an `xarray.Dataset`: named dimensions, units and long names, for one's own analysis."""

from collections.abc import Mapping
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from adwa_jax.episode import Outcome
from scenarios.errors import InputError
from scenarios.feasibility import Feasibility
from tuning.console import UNITS
from tuning.job_folder import HELD_OUT, TRAINING
from tuning.results import Results
from tuning.store import read_store
from tuning.weights_file import UNITS as CONSTANT_UNITS

if TYPE_CHECKING:
    import xarray

PARTS = {"training": TRAINING, "held_out": HELD_OUT}  # of a job
LONG_NAMES = {
    "optimal_length": "length of the shortest grid path",
    "planned_length": "length of the planned grid path",
    "planned_length_ratio": "length of the planned grid path over that of the shortest",
    "key_point_length": "length of the key-point polyline",
    "key_point_count": "key points, ends counted",
    "expansions": "cells that the search expanded",
    "planned_breaking_points": "turning points of the grid path",
    "planned_danger_points": "danger points of the grid path",
    "planned_key_point_breaking_points": "turning points of the key-point polyline",
    "planned_key_point_danger_points": "danger points of the key-point polyline",
    "outcome": "how the episode ended",
    "hit_while_stopped": "whether a mover ran into the standing robot",
    "brakings": "control steps without an admissible candidate",
    "replans": "routes planned anew under way",
    "time": "time until the end",
    "length": "length of the driven path",
    "length_ratio": "length of the driven path over that of the shortest grid path",
    "spl": "success weighted by path length",
    "breaking_points": "breaking points of the driven path",
    "danger_points": "danger points of the driven path",
    "least_clearance": "least distance from the robot's outline to an obstacle",
    "mean_clearance": "mean distance from the robot's outline to the nearest obstacle",
    "curvature": "mean curvature of the driven path",
    "angle_over_length": "turning over the length of the driven path",
    "command_variation": "sum of the changes of both commanded velocities",
    "jerk": "mean jerk",
    "barn_score": "score of the BARN challenge",
}


def open_evaluations(folder: str | Path, suite: str = "training") -> "xarray.Dataset":
    """The evaluations of a job's folder: a variable [candidate, scenario] for every figure, and `done`. Each
    candidate's constants and generation are coordinates. All have `units` ("1" where there is none) and a `long_name`.

    What is not done, of candidates dropped early, is NaN; where all is done, whole figures are whole numbers. suite:
    "training" or "held_out". InputError where there is no such store.
    """
    import xarray

    if suite not in PARTS:
        raise InputError(f"suite: {suite!r}; a job has the parts {' and '.join(PARTS)}; name one of them")
    found, names = read_store(Path(folder) / PARTS[suite])
    both = ("candidate", "scenario")
    variables = _figures(both, {name: _masked(values, found.done) for name, values in found.columns.items()})
    variables["done"] = both, found.done, _attributes("whether the episode was driven")
    candidates = {
        "candidate": ("candidate", np.arange(len(found.values)), {"long_name": "candidate; 0: the default constants"}),
        "generation": ("candidate", found.generation, _attributes("generation that the candidate was asked for in")),
        **{name: ("candidate", found.values[:, index], _attributes(name.replace("_", " "), CONSTANT_UNITS.get(name)))
           for index, name in enumerate(found.parameters)},
    }  # fmt: skip
    scenarios = {"scenario": ("scenario", list(names), {"long_name": f"scenario of the {suite} suites"})}
    described = {"title": f"{Path(folder).resolve().name}: {suite}", "missing": "not driven"}
    return xarray.Dataset(variables, {**candidates, **scenarios}, described)


def results_dataset(results: Results) -> "xarray.Dataset":
    """An evaluation: a variable [scenario] for every figure, with its `units` and `long_name`."""
    import xarray

    variables = _figures(("scenario",), {"outcome": results.outcome, **results.measures})
    if results.feasibility is not None:
        described = _flags("what is proven of the scenario", Feasibility)
        variables["feasibility"] = "scenario", results.feasibility, described
    return xarray.Dataset(variables, {"scenario": list(results.names)}, {"title": results.suite})


def _figures(dimensions: tuple[str, ...], columns: Mapping[str, np.ndarray]) -> dict[str, Any]:
    described = {name: (dimensions, values, _attributes(LONG_NAMES[name], UNITS.get(name)))
                 for name, values in columns.items()}  # fmt: skip
    return described | {"outcome": (dimensions, columns["outcome"], _flags(LONG_NAMES["outcome"], Outcome))}


def _flags(long_name: str, kinds: type[IntEnum]) -> dict[str, Any]:
    return _attributes(long_name) | {"flag_values": [int(kind) for kind in kinds],
                                     "flag_meanings": " ".join(kind.name for kind in kinds)}  # fmt: skip


def _attributes(long_name: str, units: str | None = None) -> dict[str, str]:
    return {"long_name": long_name, "units": units or "1"}


def _masked(values: np.ndarray, done: np.ndarray) -> np.ndarray:
    return values if done.all() else np.where(done, values.astype(np.float64), np.nan)
