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
from tuning.evaluations import Evaluations
from tuning.findings import Findings, Interval
from tuning.job_folder import HELD_OUT, TRAINING
from tuning.results import Results
from tuning.store import read_store
from tuning.weights_file import MEANINGS
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
    "training", or "held_out", of which candidates have the numbers that they have in training. InputError where there
    is no such store.
    """
    import xarray

    if suite not in PARTS:
        raise InputError(f"suite: {suite!r}; a job has the parts {' and '.join(PARTS)}; name one of them")
    found, names = read_store(Path(folder) / PARTS[suite])
    numbers = np.arange(len(found.values)) if suite == "training" else _training_rows(Path(folder), found)
    both = ("candidate", "scenario")
    variables = _figures(both, {name: _masked(values, found.done) for name, values in found.columns.items()})
    variables["done"] = both, found.done, _attributes("whether the episode was driven")
    candidates = {
        "candidate": ("candidate", numbers, {"long_name": "candidate; 0: the default constants"}),
        "generation": ("candidate", found.generation, _attributes("generation that the candidate was asked for in")),
        **{name: ("candidate", found.values[:, index], _attributes(MEANINGS[name], CONSTANT_UNITS.get(name)))
           for index, name in enumerate(found.parameters)},
    }  # fmt: skip
    scenarios = {"scenario": ("scenario", list(names), {"long_name": f"scenario of the {suite} suites"})}
    described = {"title": f"{Path(folder).resolve().name}: {suite}", "missing": "not driven"}
    return xarray.Dataset(variables, {**candidates, **scenarios}, described)


def front_dataset(findings: Findings) -> "xarray.Dataset":
    """The front: by member, 0 the default constants, each constant, and each objective on training and on held-out
    scenarios with its 95 % interval, `_low` to `_high`; NaN where nothing was driven. Rates are shares of 1.
    """
    import xarray

    members = (findings.default, *findings.front)
    variables: dict[str, Any] = {
        name: ("member", np.array([member.values[index] for member in members]),
               _attributes(MEANINGS[name], CONSTANT_UNITS.get(name)))
        for index, name in enumerate(findings.parameters)
    }  # fmt: skip
    for suite in PARTS:
        judged = [getattr(member, suite) for member in members]
        for index, statistic in enumerate(findings.goals.objectives):
            for end in Interval._fields:
                values = [np.nan if one is None else getattr(one.objectives[index], end) for one in judged]
                name = f"{statistic.label}_{suite}" + ("" if end == "value" else f"_{end}")
                variables[name] = ("member", np.array(values, np.float64),
                                   _attributes(f"{statistic.label.replace('_', ' ')}, {suite.replace('_', ' ')}",
                                               UNITS.get(statistic.measure)))  # fmt: skip
    numbers = ("member", np.arange(len(members)), {"long_name": "member of the front; 0: the default constants"})
    best = findings.choices[findings.recommended].member + 1
    return xarray.Dataset(variables, {"member": numbers}, {"recommended_member": best})


def results_dataset(results: Results) -> "xarray.Dataset":
    """An evaluation: a variable [scenario] for every figure, with its `units` and `long_name`."""
    import xarray

    variables = _figures(("scenario",), {"outcome": results.outcome, **results.measures})
    if results.feasibility is not None:
        described = _flags("what is proven of the scenario", Feasibility)
        variables["feasibility"] = "scenario", results.feasibility, described
    return xarray.Dataset(variables, {"scenario": list(results.names)}, {"title": results.suite})


def _training_rows(folder: Path, held_out: Evaluations) -> np.ndarray:
    """[H] ascending: the candidates of the training store that those of the held-out one are."""
    training, _ = read_store(folder / TRAINING)
    rows: list[int] = []
    for values, generation in zip(held_out.values, held_out.generation, strict=True):
        same = (training.values == values).all(axis=1) & (training.generation == generation)
        same[: rows[-1] + 1 if rows else 0] = False
        if not same.any():
            raise InputError(f"{folder / HELD_OUT}: of other candidates than {TRAINING}; must be of its front; go on "
                             f"with the job: adwa tune resume {folder}")  # fmt: skip
        rows.append(int(np.argmax(same)))
    return np.array(rows, np.int64)


def _figures(dimensions: tuple[str, ...], columns: Mapping[str, np.ndarray]) -> dict[str, Any]:
    described = {name: (dimensions, values, _attributes(LONG_NAMES[name], UNITS.get(name)))
                 for name, values in columns.items()}  # fmt: skip
    outcome = columns["outcome"]
    reached = outcome == Outcome.REACHED
    success = reached if outcome.dtype.kind == "i" else np.where(np.isnan(outcome), np.nan, reached)
    return described | {"outcome": (dimensions, outcome, _flags(LONG_NAMES["outcome"], Outcome)),
                        "success": (dimensions, success, _attributes("whether the goal was reached"))}


def _flags(long_name: str, kinds: type[IntEnum]) -> dict[str, Any]:
    return _attributes(long_name) | {"flag_values": [int(kind) for kind in kinds],
                                     "flag_meanings": " ".join(kind.name for kind in kinds)}  # fmt: skip


def _attributes(long_name: str, units: str | None = None) -> dict[str, str]:
    return {"long_name": long_name, "units": units or "1"}


def _masked(values: np.ndarray, done: np.ndarray) -> np.ndarray:
    return values if done.all() else np.where(done, values.astype(np.float64), np.nan)
