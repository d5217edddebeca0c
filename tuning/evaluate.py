"""Judge a planner on a suite: plan and drive every scenario."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from adwa_jax.constants import Constants
from adwa_jax.presets import Preset
from adwa_jax.score import ScoreWeights
from scenarios.errors import InputError
from scenarios.suite import Suite
from tuning.engine import judge_pairs
from tuning.results import Results

Progress = Callable[[int, int], None]  # (episodes done, of how many)


class Interrupted(KeyboardInterrupt):
    """The user stopped the work; `results` holds what was done, or None if that is nothing."""

    def __init__(self, results: Results | None, total: int):
        super().__init__()
        self.results, self.total = results, total


def evaluate(suite: Suite, config: Preset, weights: ScoreWeights | None = None,
             progress: Progress | None = None) -> Results:
    """Plan and drive every scenario of a suite; `weights`, if given, stand in for the configuration's.

    Changing weights, limits or ω constants compiles nothing anew. `progress` is called from time to time. Raises
    InputError for a suite without scenarios, Interrupted, with what is done, on KeyboardInterrupt.
    """
    constants = config.constants if weights is None else replace(config.constants, weights=weights)
    return evaluate_all(suite, config, [constants], progress)[0]


def evaluate_all(suite: Suite, config: Preset, candidates: Sequence[Constants],
                 progress: Progress | None = None) -> list[Results]:
    """`evaluate` for every candidate's constants, on common scenarios: one result a candidate."""
    if not suite.scenarios:
        raise InputError(f"{suite.name}: 0 scenarios; there must be at least one; make the suite again")
    judged = judge_pairs(suite.scenarios, candidates, config.options, progress=progress)
    found = [_results(suite, {name: values[row] for name, values in judged.columns.items()}, done)
             for row, done in enumerate(judged.done)]  # fmt: skip
    if not judged.done.all():
        raise Interrupted(next((results for results in found if results is not None), None), len(suite.scenarios))
    return [results for results in found if results is not None]


def _results(suite: Suite, columns: dict[str, np.ndarray], done: np.ndarray) -> Results | None:
    """Of the scenarios that are done; None if none is."""
    if not done.any():
        return None
    kept = {name: values[done] for name, values in columns.items()}
    names = tuple(name for name, is_done in zip(suite.names, done, strict=True) if is_done)
    return Results(suite.name, names, kept.pop("outcome"), kept)
