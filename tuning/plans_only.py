"""Candidates judged by their planned paths alone: for the constants of eq. 5, whose effect is on the search.

Dimension letters: W candidates; S scenarios.
"""

import threading
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from adwa_jax.astar import Status
from adwa_jax.constants import Constants, Options
from adwa_jax.episode import Outcome
from adwa_jax.scenario import Scenario
from tuning.compiled import keep_compiled
from tuning.engine import Judged, Program, Progress, pairs_by_program, usable_cores
from tuning.plans_ahead import Pair, Planner

PLANNED = ("optimal_length", "planned_length", "planned_length_ratio", "key_point_length", "key_point_count",
           "expansions", "planned_breaking_points", "planned_danger_points", "planned_key_point_breaking_points",
           "planned_key_point_danger_points")  # fmt: skip
"""Measures of the planned path: nothing need be driven for them."""


def judge_plans(scenarios: Sequence[Scenario], candidates: Sequence[Constants], options: Options,
                workers: int | None = None, progress: Progress | None = None) -> Judged:
    """`engine.judge_pairs` up to the plan: the figures of `PLANNED`, with the same bits, and `outcome`, REACHED where
    a path was found and NO_PATH elsewhere.
    """
    keep_compiled()
    options = replace(options, plan=replace(options.plan, subdivision=1))  # nothing is looked up in the field
    collected = _Collected(len(candidates), len(scenarios), progress)
    count = usable_cores() if workers is None else workers
    with ThreadPoolExecutor(count) as pool:
        parts = [partial(_plan, scenarios, candidates, program, part, collected)
                 for program, pairs in pairs_by_program(scenarios, candidates, options).items()
                 for part in _shares(pairs, count)]  # fmt: skip
        for future in [pool.submit(part) for part in parts]:
            future.result()
    return Judged(collected.columns, collected.done, collected.plans)


def _shares(pairs: Sequence[Pair], count: int) -> Iterable[Sequence[Pair]]:
    """So many parts at most; the pairs of a scenario stay together."""
    scenarios = list(dict.fromkeys(pair.scenario for pair in pairs))
    for share in np.array_split(np.array(scenarios), min(count, len(scenarios))):
        kept = set(share.tolist())
        yield [pair for pair in pairs if pair.scenario in kept]


class _Collected:
    """Figures as they come in; safe to use from several threads."""

    def __init__(self, candidates: int, scenarios: int, progress: Progress | None):
        self.columns: dict[str, np.ndarray] = {}
        self.done = np.zeros((candidates, scenarios), np.bool_)
        self.plans = 0
        self._progress, self._lock = progress, threading.Lock()

    def write(self, pair: Pair, figures: Mapping[str, Any]) -> None:
        with self._lock:
            for name, value in figures.items():
                if name not in self.columns:
                    self.columns[name] = np.zeros(self.done.shape, np.asarray(value).dtype)
                self.columns[name][pair] = value
            self.done[pair] = True
            if self._progress and pair.candidate == 0:
                self._progress(int(self.done.sum()), self.done.size)

    def count(self, plans: int) -> None:
        with self._lock:
            self.plans += plans


def _plan(scenarios: Sequence[Scenario], candidates: Sequence[Constants], program: Program, pairs: Sequence[Pair],
          collected: _Collected) -> None:
    """Plan some pairs of one program."""
    planner = Planner(scenarios, candidates, program.options, program.shape, pairs)
    for pair in pairs:
        planned = planner.planned(pair)
        found = planned.plan.search.status == Status.FOUND
        outcome = np.int32(Outcome.REACHED if found else Outcome.NO_PATH)
        collected.write(pair, planned.figures | {"outcome": outcome})
    collected.count(planner.plans_made)
