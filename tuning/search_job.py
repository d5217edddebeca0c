"""The search of a job: generation after generation is judged on the training scenarios, until method or budget ends."""

import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from tuning.console import progress_bar
from tuning.front import front
from tuning.job_checks import Setup
from tuning.job_file import refused
from tuning.job_folder import JOB, TRAINING, Log, remember
from tuning.methods import CUT_ANYWHERE, method_named
from tuning.methods.method import Problem, Remember, Search, computed_anew
from tuning.objectives import Goals, Scores
from tuning.racing import Judge, raced
from tuning.store import TILE_WIDTH, Store
from tuning.tiled_judge import TiledJudge

RIVALS = 64  # candidates that those of a race are compared with


def search(folder: Path, setup: Setup, log: Log, quiet: bool) -> None:
    """Judge the default constants, then what the method asks for. InputError if the budget is too small for that.

    What is in the folder's store is read, not driven. On KeyboardInterrupt all whole tiles are kept.
    """
    began = time.perf_counter()
    method, points = begun(setup, folder / JOB, partial(remember, folder))
    store = Store(folder / TRAINING, setup.space.names, setup.training.names, setup.figures)
    with progress_bar(f"tuning on {setup.training.name}", quiet) as progress:
        judge = TiledJudge(store, setup.training, setup.space, log, setup.job.method.episodes, progress,
                          setup.plans_only)
        past = _Past(setup, judge, log)
        past.generation(setup.space.default[None], racing=False)
        while points is not None and (scores := _scores(past, points, setup)) is not None:
            try:
                points = method.send(scores)
            except StopIteration:
                points = None
    seconds = time.perf_counter() - began
    log.write("searched", driven=judge.driven, read=judge.read, seconds=round(seconds, 3),
              engine_share=round(judge.engine_seconds / seconds, 4))  # fmt: skip


class _Past:
    """What has been judged so far: rows of the store, episodes spent, the best, rivals for races."""

    def __init__(self, setup: Setup, judge: TiledJudge, log: Log):
        self.spent = 0
        self._rows = self._generations = 0
        self._setup, self._judge, self._log = setup, judge, log
        self._front: dict[str, np.ndarray] | None = None  # columns of the front so far, for races
        self._best: tuple[float, float] | None = None
        self._best_facts: dict[str, Any] = {}

    def generation(self, values: np.ndarray, racing: bool) -> Scores:
        """Judge candidates values [C, D]."""
        began, driven, engine = time.perf_counter(), self._judge.driven, self._judge.engine_seconds
        scenarios, goals = len(self._setup.training.scenarios), self._setup.goals
        judge = self._judge.admitted(self._rows, values, np.full(len(values), self._generations))
        columns, counted = self._judged(judge, len(values), scenarios, racing)
        scores = goals.scores(columns, counted)
        self.spent += int(counted.sum())
        self._front = _front_of(self._front, columns, counted, goals)
        self._note_best(values, columns, counted, scores)
        seconds = time.perf_counter() - began
        self._log.write("generation", generation=self._generations, candidates=len(values), spent=self.spent,
                        driven=self._judge.driven - driven, seconds=round(seconds, 3),
                        engine_share=round((self._judge.engine_seconds - engine) / seconds, 4),
                        best=self._best_facts)  # fmt: skip
        self._rows, self._generations = self._rows + len(values), self._generations + 1
        return scores

    def _judged(self, judge: Judge, candidates: int, scenarios: int,
                racing: bool) -> tuple[dict[str, np.ndarray], np.ndarray]:
        if not racing:
            return dict(judge(np.arange(candidates), 0, scenarios)), np.ones((candidates, scenarios), np.bool_)
        found = raced(self._setup.goals, candidates, scenarios, TILE_WIDTH, judge, self._front)
        return found.columns, found.counted

    def _note_best(self, values: np.ndarray, columns: dict[str, np.ndarray], counted: np.ndarray,
                   scores: Scores) -> None:
        """By violation, then by the first objective, of those that saw all scenarios."""
        for row in np.flatnonzero(counted.all(axis=1)):
            key = float(scores.violation[row]), float(scores.objectives[row, 0])
            if self._best is None or key < self._best:
                signs = [statistic.sign for statistic in self._setup.goals.objectives]
                labels = [statistic.label for statistic in self._setup.goals.objectives]
                self._best = key
                self._best_facts = {
                    "row": int(self._rows + row), "violation": key[0],
                    "objectives": dict(zip(labels, (scores.objectives[row] * signs).tolist(), strict=True)),
                    "constants": dict(zip(self._setup.space.names, values[row].tolist(), strict=True)),
                }  # fmt: skip


def _front_of(before: dict[str, np.ndarray] | None, columns: dict[str, np.ndarray], counted: np.ndarray,
              goals: Goals) -> dict[str, np.ndarray]:
    """Columns of the non-dominated among those before and those that saw all scenarios; at most RIVALS of them."""
    joined = {name: column[counted.all(axis=1)] for name, column in columns.items()}
    if before is not None:
        joined = {name: np.concatenate([before[name], column]) for name, column in joined.items()}
    members = front(goals.scores(joined, np.ones_like(joined["outcome"], np.bool_)))[:RIVALS]
    return {name: column[members] for name, column in joined.items()}


def begun(setup: Setup, file: Path, keep: Remember = computed_anew) -> tuple[Search, np.ndarray | None]:
    """The method and its first generation, [C, D] points of the unit cube; None if it asks for nothing.

    InputError, for the job file, if the method cannot do with the parameters, or the budget does not pay for that.
    """
    job, scenarios = setup.job, len(setup.training.scenarios)
    left = job.method.episodes - scenarios  # the default constants come first
    fewest = TILE_WIDTH if job.method.racing and job.method.name in CUT_ANYWHERE else scenarios
    problem = Problem(setup.space, setup.goals, job.seed, left // fewest, setup.training, job.method.settings, keep)
    method = method_named(job.method.name)(problem)
    try:
        points = next(method, None)
    except InputError as error:
        raise refused(file, [str(error)]) from None
    count = 0 if points is None else len(points)
    needed = (1 + count) * scenarios
    if needed > job.method.episodes:
        raise refused(file, [f"method.episodes: {job.method.episodes}; the default constants and the first generation "
                             f"of {count} candidates on {scenarios} scenarios take {needed}; raise it, or make "
                             "generations smaller"])  # fmt: skip
    return method, points


def _scores(past: _Past, points: np.ndarray, setup: Setup) -> Scores | None:
    """Scores of a generation; None once the budget is spent.

    Where a race may have left too little for the whole of it, as many as can be paid for are judged, then as many of
    the others as what that has left pays for: then less than a candidate's episodes stay unspent.
    """
    method, scenarios, parts = setup.job.method, len(setup.training.scenarios), []
    while len(points):
        count = min((method.episodes - past.spent) // scenarios, len(points))
        if count < (1 if method.name in CUT_ANYWHERE else len(points)):
            return None
        parts.append(past.generation(setup.space.values(points[:count]), method.racing))
        points = points[count:]
    return _joined(parts)


def _joined(parts: list[Scores]) -> Scores:
    """Scores of parts of a generation."""
    columns, counted = ([getattr(part, name) for part in parts] for name in ("columns", "counted"))
    return Scores(np.concatenate([part.objectives for part in parts]),
                  np.concatenate([part.violation for part in parts]),
                  {name: np.concatenate([column[name] for column in columns]) for name in columns[0]},
                  np.concatenate(counted))  # fmt: skip
