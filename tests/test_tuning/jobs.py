"""A small job for tests, and stand-ins for what makes a job slow: a search without a library, a report of one line."""

import sys
from pathlib import Path
from types import ModuleType

import numpy as np

from tuning.outputs import write_whole

JOB = """\
name = "small"
seed = 3

[planner]
preset = "extended"

[training]
suites = [{suite = "paper-15", count = 5, seed = 1}]

[held_out]
suites = [{suite = "paper-15", count = 4, seed = 2}]

[parameters.clearance]
low = 0.02
high = 0.5
scale = "log"

[parameters.progress]
low = 0.2
high = 1.5

[method]
name = "sobol"
episodes = 50
generation = 4
"""


def written(folder: Path, text: str = JOB) -> Path:
    path = folder / "job.toml"
    path.write_text(text, encoding="utf-8")
    return path


def short_report() -> None:
    """Let the report be one line: drawing it is another module's business."""
    stand_in = ModuleType("tuning.report")

    def write_report(folder, job, findings, training, held_out, held_out_rows, remembered, environment, gallery):
        line = f"{job.name} {len(findings.front)} {training.done.sum()} {held_out_rows.tolist()} {sorted(environment)}"
        write_whole(folder / "report.html", line + f" {np.sum(training.columns['length'], dtype=np.float64)}\n")
        return folder / "report.html"

    stand_in.__dict__["write_report"] = write_report
    sys.modules["tuning.report"] = stand_in
