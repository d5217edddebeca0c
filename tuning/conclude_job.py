"""The end of a job: the best on held-out scenarios, the analysis, the recommended constants, the report."""

import time
from pathlib import Path
from typing import Any

import numpy as np

from adwa_jax.presets import Preset
from scenarios.errors import InputError
from tuning.analysis import analyse, chosen_rows, front_rows
from tuning.console import progress_bar
from tuning.evaluations import Evaluations
from tuning.findings import Findings, Member
from tuning.job_checks import Setup
from tuning.job_folder import HELD_OUT, TRAINING, Log, remembered
from tuning.nav2 import nav2_text
from tuning.outputs import write_whole
from tuning.store import Store, as_evaluations
from tuning.tiled_judge import TiledJudge
from tuning.weights_file import weights_text

SHOWN = 32  # members of the front that are driven on held-out scenarios
RECOMMENDED, NAV2, PICTURES = "recommended.toml", "recommended_nav2.yaml", "failures"


def conclude(folder: Path, setup: Setup, environment: dict[str, Any]) -> Findings:
    """Analyse what the stores hold; write the recommended constants and the report. Nothing is judged anew."""
    from tuning.report import write_report  # brings the drawing with it

    job, training = setup.job, as_evaluations(folder / TRAINING)
    if not training.done.any() or not training.complete[0]:
        raise InputError(f"{folder}: the default constants are not judged yet; a report compares with them; go on: "
                         f"adwa tune resume {folder}")  # fmt: skip
    held_out, rows = _held_out(folder, training, setup)
    findings = analyse(training, held_out, rows, setup.goals, setup.space, job.choice, job.seed)
    preset = setup.space.preset(_recommended(findings).values)
    write_whole(folder / RECOMMENDED, recommended_text(setup, findings, preset))
    write_whole(folder / NAV2, nav2_text(preset))
    gallery = _gallery(folder, setup, preset, held_out, rows, findings)
    write_report(folder, job, findings, training, held_out, rows, remembered(folder), environment, gallery)
    return findings


def drive_held_out(folder: Path, setup: Setup, log: Log, quiet: bool) -> None:
    """Judge the default, the front and every choice on the held-out scenarios, as far as the store lacks it."""
    training = as_evaluations(folder / TRAINING)
    rows, scenarios = held_out_rows(training, setup), len(setup.held_out.scenarios)
    store = Store(folder / HELD_OUT, setup.space.names, setup.held_out.names, setup.figures)
    with progress_bar(f"held out, {setup.held_out.name}", quiet) as progress:
        judge = TiledJudge(store, setup.held_out, setup.space, log, len(rows) * scenarios, progress,
                           setup.plans_only)
        began = time.perf_counter()
        judge.admitted(0, training.values[rows], training.generation[rows])(np.arange(len(rows)), 0, scenarios)
    log.write("held out", candidates=len(rows), driven=judge.driven, seconds=round(time.perf_counter() - began, 3))


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
    return [f"{name}: success {_successes(member)}"
            for name, member in (("default", findings.default), ("recommended", _recommended(findings)))]  # fmt: skip


def _successes(member: Member) -> str:
    return ", ".join(f"{suite} {judged.success.value:.1%} [{judged.success.low:.1%}, {judged.success.high:.1%}] of "
                     f"{judged.scenarios}" for suite, judged in (("training", member.training),
                                                                 ("held out", member.held_out)) if judged)  # fmt: skip


def _recommended(findings: Findings) -> Member:
    return findings.front[findings.choices[findings.recommended].member]


def _gallery(folder: Path, setup: Setup, preset: Preset, held_out: Evaluations | None, rows: np.ndarray,
             findings: Findings) -> tuple:
    """Pictures of the recommended constants' worst held-out scenarios."""
    from tuning.failures import failure_pictures, results_of

    if held_out is None or setup.plans_only:
        return ()
    row = int(np.flatnonzero(rows == _recommended(findings).row)[0])
    results = results_of(held_out, row, setup.held_out)
    return failure_pictures(setup.held_out, preset, results, folder / PICTURES, y_down=setup.y_down)


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
