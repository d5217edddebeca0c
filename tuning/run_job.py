"""A job from its folder to its findings: search, held-out scenarios, analysis, report.

Everything is determined by the job file. A job that goes on after a kill is the same job begun anew, to which the
tiles that are done need not be driven again.
"""

import os
import time
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from adwa_jax.presets import Preset
from scenarios.errors import InputError
from tuning.analysis import analyse, chosen_rows, front_rows
from tuning.console import progress_bar
from tuning.evaluations import Evaluations
from tuning.findings import Findings, Member
from tuning.front import front
from tuning.job_checks import Setup
from tuning.job_file import refused
from tuning.job_folder import HELD_OUT, JOB, TRAINING, Log, remember, remembered, storing
from tuning.methods import CUT_ANYWHERE, method_named
from tuning.methods.method import Problem, Search
from tuning.nav2 import nav2_text
from tuning.objectives import Goals, Scores
from tuning.outputs import write_whole
from tuning.racing import Judge, raced
from tuning.store import TILE_WIDTH, Store, as_evaluations
from tuning.tiled_judge import TiledJudge
from tuning.weights_file import weights_text

SHOWN = 32  # members of the front that are driven on held-out scenarios
RIVALS = 64  # candidates that those of a race are compared with


class Finished(NamedTuple):
    """A job's end."""

    findings: Findings
    report: Path
    recommended: Path


def run_job(folder: Path, setup: Setup, environment: dict[str, Any], quiet: bool) -> Finished:
    """Search, judge and report. On KeyboardInterrupt and InputError (no room, say) all whole tiles are kept."""
    log, began = Log(folder), time.perf_counter()
    with storing(folder):
        log.write("begin", pid=os.getpid(), scenarios=len(setup.training.scenarios), budget=setup.job.method.episodes)
        judge = _search(folder, setup, log, quiet)
        seconds = time.perf_counter() - began
        log.write("searched", driven=judge.driven, seconds=round(seconds, 3),
                  engine_share=round(judge.engine_seconds / seconds, 4))  # fmt: skip
        _drive_held_out(folder, setup, log, quiet)
        finished = write_findings(folder, setup, environment)
        log.write("end", seconds=round(time.perf_counter() - began, 3))
    return finished


def write_findings(folder: Path, setup: Setup, environment: dict[str, Any]) -> Finished:
    """Analyse what the stores hold, and write the report and the recommended constants. Nothing is driven."""
    from tuning.report import write_report  # brings the drawing with it

    job, training = setup.job, as_evaluations(folder / TRAINING)
    if not training.done.any() or not training.complete[0]:
        raise InputError(f"{folder}: the default constants are not judged yet; there is nothing to report on; go on: "
                         f"adwa tune resume {folder}")  # fmt: skip
    held_out, rows = _held_out(folder, training, setup)
    findings = analyse(training, held_out, rows, setup.goals, setup.space, job.choice, job.seed)
    recommended = findings.front[findings.choices[findings.recommended].member]
    preset = setup.space.preset(recommended.values)
    write_whole(folder / "recommended.toml", recommended_text(setup, findings, preset))
    write_whole(folder / "recommended_nav2.yaml", nav2_text(preset))
    report = write_report(folder, job, findings, training, held_out, rows, remembered(folder), environment)
    return Finished(findings, report, folder / "recommended.toml")


def recommended_text(setup: Setup, findings: Findings, preset: Preset) -> str:
    """The recommended constants as a file of weights, with what is known of them."""
    choice, planner = findings.choices[findings.recommended], setup.job.planner
    options = [f"--preset {planner.preset}", *([f"--robot {planner.robot}"] if planner.robot else []),
               *([f"--v-max {planner.v_max:g}"] if planner.v_max else [])]  # fmt: skip
    lines = [f"Tuned by the job {setup.job.name!r}, by the rule {choice.rule}: {choice.reason}",
             *success_lines(findings), f"Use: adwa evaluate {' '.join(options)} --weights recommended.toml"]
    return "".join(f"# {' '.join(line.split())}\n" for line in lines) + weights_text(preset)


def success_lines(findings: Findings) -> list[str]:
    """Success of the default and of the recommended constants, with intervals."""
    recommended = findings.front[findings.choices[findings.recommended].member]
    return [f"{name}: success {_successes(member)}"
            for name, member in (("default", findings.default), ("recommended", recommended))]  # fmt: skip


def _successes(member: Member) -> str:
    return ", ".join(f"{suite} {judged.success.value:.1%} [{judged.success.low:.1%}, {judged.success.high:.1%}] of "
                     f"{judged.scenarios}" for suite, judged in (("training", member.training),
                                                                 ("held out", member.held_out)) if judged)  # fmt: skip


def _search(folder: Path, setup: Setup, log: Log, quiet: bool) -> TiledJudge:
    """Judge generation after generation until the method or the budget ends."""
    scenarios, budget = len(setup.training.scenarios), setup.job.method.episodes
    search = _begun(folder, setup)
    points = _first(search, setup, folder)
    store = Store(folder / TRAINING, setup.space.names, setup.training.names)
    with progress_bar(f"tuning on {setup.training.name}", quiet) as progress:
        judge = TiledJudge(store, setup.training, setup.space, log, budget, progress)
        past = _Past(setup, judge, log)
        past.generation(setup.space.default[None], racing=False)
        while points is not None and past.spent + len(points) * scenarios <= budget:
            scores = past.generation(setup.space.values(points), setup.job.method.racing)
            try:
                points = search.send(scores)
            except StopIteration:
                points = None
    return judge


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


def _begun(folder: Path, setup: Setup) -> Search:
    job, scenarios = setup.job, len(setup.training.scenarios)
    left = job.method.episodes - scenarios  # the default constants come first
    fewest = TILE_WIDTH if job.method.racing and job.method.name in CUT_ANYWHERE else scenarios
    problem = Problem(setup.space, setup.goals, job.seed, left // fewest, setup.training, job.method.settings,
                      partial(remember, folder))  # fmt: skip
    return method_named(job.method.name)(problem)


def _first(search: Search, setup: Setup, folder: Path) -> np.ndarray | None:
    """The first generation; InputError if the budget does not pay for it."""
    try:
        points = next(search, None)
    except InputError as error:
        raise refused(folder / JOB, [str(error)]) from None
    scenarios, budget = len(setup.training.scenarios), setup.job.method.episodes
    count = 0 if points is None else len(points)
    needed = (1 + count) * scenarios
    if needed > budget:
        raise refused(folder / JOB, [f"method.episodes: {budget}; the default constants and the first generation of "
                                     f"{count} candidates on {scenarios} scenarios take {needed}; raise "
                                     "it, or make generations smaller"])  # fmt: skip
    return points


def _drive_held_out(folder: Path, setup: Setup, log: Log, quiet: bool) -> None:
    training = as_evaluations(folder / TRAINING)
    rows, scenarios = held_out_rows(training, setup), len(setup.held_out.scenarios)
    store = Store(folder / HELD_OUT, setup.space.names, setup.held_out.names)
    with progress_bar(f"held out, {setup.held_out.name}", quiet) as progress:
        judge = TiledJudge(store, setup.held_out, setup.space, log, len(rows) * scenarios, progress)
        began = time.perf_counter()
        judge.admitted(0, training.values[rows], training.generation[rows])(np.arange(len(rows)), 0, scenarios)
    log.write("held out", candidates=len(rows), driven=judge.driven, seconds=round(time.perf_counter() - began, 3))


def held_out_rows(training: Evaluations, setup: Setup) -> np.ndarray:
    """[H] training rows that the held-out suite is driven with, ascending: the default, the front, every choice."""
    return np.unique(np.concatenate([[0], front_rows(training, setup.goals, SHOWN),
                                     chosen_rows(training, setup.goals, setup.job.choice)]))  # fmt: skip


def _held_out(folder: Path, training: Evaluations, setup: Setup) -> tuple[Evaluations | None, np.ndarray]:
    """The held-out evaluations with their training rows; none unless they are those of the training's front."""
    nothing = None, np.zeros(0, np.int64)
    if not (folder / HELD_OUT).exists():
        return nothing
    found, rows = as_evaluations(folder / HELD_OUT), held_out_rows(training, setup)
    same = found.complete.all() and np.array_equal(found.values, training.values[rows])
    return (found, rows) if same else nothing
