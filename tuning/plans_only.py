"""Candidates judged by their planned paths alone: for the constants of eq. 5, whose effect is on the search.

Dimension letters: W candidates; S scenarios.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby

import numpy as np

from adwa_jax.astar import Status
from adwa_jax.constants import Constants, Options
from adwa_jax.episode import Outcome
from adwa_jax.scenario import Scenario
from tuning.compiled import keep_compiled
from tuning.engine import Judged, Program, Progress, Table, in_threads, pairs_by_program, usable_cores
from tuning.objectives import Goals
from tuning.plans_ahead import Pair, Planned, Planner

PLANNED = ("optimal_length", "planned_length", "planned_length_ratio", "key_point_length", "key_point_count",
           "expansions", "planned_breaking_points", "planned_danger_points", "planned_key_point_breaking_points",
           "planned_key_point_danger_points")  # fmt: skip
"""Measures of the planned path: nothing need be driven for them."""


def known_of_plans(goals: Goals) -> bool:
    """Whether all that matters is known of a plan: then nothing is driven."""
    statistics = [*goals.objectives, *(constraint.statistic for constraint in goals.constraints)]
    return all(statistic.measure in PLANNED for statistic in statistics)


def judge_plans(scenarios: Sequence[Scenario], candidates: Sequence[Constants], options: Options,
                workers: int | None = None, progress: Progress | None = None) -> Judged:
    """`engine.judge_pairs` up to the plan: the figures of `PLANNED`, with the same bits, and `outcome`, REACHED where
    a path was found and NO_PATH elsewhere.
    """
    keep_compiled()
    options = replace(options, plan=replace(options.plan, subdivision=1))  # nothing is looked up in the field
    table = Table(len(candidates), len(scenarios), progress)
    count = usable_cores() if workers is None else workers
    parts = iter([partial(_plan, scenarios, candidates, program, part, table)
                  for program, pairs in pairs_by_program(scenarios, candidates, options).items()
                  for part in _shares(pairs, count)])  # fmt: skip

    def work() -> None:
        for part in parts:  # each is taken by one thread
            part()

    in_threads(work, count, table)
    return table.judged()


def _shares(pairs: Sequence[Pair], count: int) -> Iterable[Sequence[Pair]]:
    """So many parts at most; the pairs of a scenario stay together."""
    scenarios = list(dict.fromkeys(pair.scenario for pair in pairs))
    for share in np.array_split(np.array(scenarios), min(count, len(scenarios))):
        kept = set(share.tolist())
        yield [pair for pair in pairs if pair.scenario in kept]


def _plan(scenarios: Sequence[Scenario], candidates: Sequence[Constants], program: Program, pairs: Sequence[Pair],
          table: Table) -> None:
    """Plan some pairs of one program, scenario after scenario, until the run is to end."""
    planner = Planner(scenarios, candidates, program.options, program.shape, pairs)
    for _, group in groupby(pairs, key=lambda pair: pair.scenario):
        if table.stop:
            break
        some = list(group)
        rows = [_figures(planner.planned(pair)) for pair in some]
        table.write(some, {name: np.stack([row[name] for row in rows]) for name in rows[0]})
    table.count(planner.plans_made)


def _figures(planned: Planned) -> dict[str, np.ndarray]:
    found = planned.plan.search.status == Status.FOUND
    return planned.figures | {"outcome": np.array(Outcome.REACHED if found else Outcome.NO_PATH, np.int32)}
