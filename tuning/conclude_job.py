"""The end of a job: the best on held-out scenarios, the analysis, the recommended constants, the report."""

import shlex
import time
from pathlib import Path
from typing import Any

import numpy as np

from adwa_jax.presets import Preset
from tuning.console import progress_bar
from tuning.findings import Findings, Member
from tuning.finished_job import FinishedJob, finished, held_out_rows
from tuning.job_checks import Setup
from tuning.job_folder import HELD_OUT, TRAINING, Log, home_of, remembered
from tuning.nav2 import nav2_text
from tuning.outputs import write_whole
from tuning.plans_only import known_of_plans
from tuning.robot_file import SUFFIX
from tuning.store import Store, as_evaluations
from tuning.tiled_judge import TiledJudge
from tuning.weights_file import weights_text

RECOMMENDED, NAV2, PICTURES = "recommended.toml", "recommended_nav2.yaml", "failures"


def conclude(folder: Path, setup: Setup, environment: dict[str, Any]) -> Findings:
    """Analyse what the stores hold; write the recommended constants and the report. Nothing is judged anew."""
    from tuning.report import write_report  # brings the drawing with it

    done = finished(folder, setup)
    findings = done.findings
    preset = setup.space.preset(_recommended(findings).values)
    write_whole(folder / RECOMMENDED, recommended_text(setup, findings, preset, home_of(environment)))
    write_whole(folder / NAV2, nav2_text(preset))
    write_report(folder, setup.job, findings, done.training, done.held_out, done.held_out_rows, remembered(folder),
                 environment, _gallery(folder, done))  # fmt: skip
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


def recommended_text(setup: Setup, findings: Findings, preset: Preset, home: Path) -> str:
    """The recommended constants as a file of weights, with what is known of them. home: of the job file's paths."""
    choice, planner = findings.choices[findings.recommended], setup.job.planner
    robot = str(home / planner.robot) if planner.robot and planner.robot.endswith(SUFFIX) else planner.robot
    options = [f"--preset {planner.preset}", *([f"--robot {shlex.quote(robot)}"] if robot else []),
               *([f"--v-max {planner.v_max:g}"] if planner.v_max else [])]  # fmt: skip
    lines = [f"Tuned by the job {setup.job.name!r}, by the rule {choice.rule}: {choice.reason}",
             *success_lines(findings), f"Use: adwa evaluate {' '.join(options)} --weights recommended.toml"]
    return "".join(f"# {' '.join(line.split())}\n" for line in lines) + weights_text(preset)


def success_lines(findings: Findings) -> list[str]:
    """Success of the default and of the recommended constants, with intervals."""
    what = "path found, nothing driven" if known_of_plans(findings.goals) else "success"
    lines = [f"{name}: {what} {_successes(member)}"
             for name, member in (("default", findings.default), ("recommended", _recommended(findings)))]  # fmt: skip
    if not _recommended(findings).training.feasible:
        lines.append("no candidate holds all constraints on the training scenarios; the recommended comes nearest")
    return lines


def _successes(member: Member) -> str:
    return ", ".join(f"{suite} {judged.success.value:.1%} [{judged.success.low:.1%}, {judged.success.high:.1%}] of "
                     f"{judged.scenarios}" for suite, judged in (("training", member.training),
                                                                 ("held out", member.held_out)) if judged)  # fmt: skip


def _recommended(findings: Findings) -> Member:
    return findings.front[findings.choices[findings.recommended].member]


def _gallery(folder: Path, done: FinishedJob) -> tuple:
    """Pictures of the recommended constants' worst held-out scenarios."""
    from tuning.failures import failure_pictures

    setup, findings = done.setup, done.findings
    if done.held_out is None or setup.plans_only:
        return ()
    number = findings.choices[findings.recommended].member + 1
    return failure_pictures(setup.held_out, done.preset(number), done.held_out_results(number), folder / PICTURES,
                            y_down=setup.y_down)  # fmt: skip
