"""A small job for tests, cut into many small tiles and blocks, without the drawing of its report."""

import sys
from pathlib import Path

import numpy as np

import tuning.report
from tuning import cli, conclude_job, engine, job_checks, search_job, store, tiled_judge
from tuning.outputs import write_whole

JOB = """\
name = "small"
seed = 3

[planner]
preset = "paper"

[training]
suites = [{suite = "paper-15", count = 5, seed = 1}]

[held_out]
suites = [{suite = "paper-15", count = 3, seed = 2}]

[parameters.clearance]
low = 0.02
high = 0.5
scale = "log"

[parameters.velocity]
low = 0.2
high = 1.5

[method]
name = "nsga3"
episodes = 45
population = 4
"""
CANDIDATES, SCENARIOS = 9, 5  # what the budget pays for, the default included


def written(folder: Path, text: str = JOB) -> Path:
    path = folder / "job.toml"
    path.write_text(text, encoding="utf-8")
    return path


def short_report(folder, job, findings, training, held_out, held_out_rows, remembered, environment, gallery):
    """Depends on all that a report is made of."""
    totals = [{name: float(np.sum(column, dtype=np.float64)) for name, column in found.columns.items()}
              for found in (training, held_out) if found]  # fmt: skip
    facts = job.name, len(findings.front), held_out_rows.tolist(), totals, sorted(remembered), environment["inputs"]
    write_whole(folder / "report.html", f"{facts}\n")
    return folder / "report.html"


def in_small_pieces(patch=setattr):
    """patch: setattr, or that of a monkeypatch."""
    patch(tuning.report, "write_report", short_report)
    patch(conclude_job, "_gallery", lambda *_: ())
    patch(engine, "LANES", ((512, 4),))  # idle lanes cost as much as others
    for module in (store, search_job, job_checks):
        patch(module, "TILE_WIDTH", 2)
    for name in ("FIRST_BLOCK", "SMALLEST_BLOCK", "LARGEST_BLOCK"):
        patch(tiled_judge, name, 4)


def results_of(folder: Path) -> dict[str, bytes]:
    """Every file of a job that is a result, by its path."""
    files = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.name not in ("lock", "log.jsonl")]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def pairs_driven(events) -> list[tuple]:
    """(suite, row, scenario) of every episode that the log says was driven, repeated if it was again."""
    return [(event["suite"], row, scenario) for event in events if event["event"] == "block"
            for row in event["rows"] for scenario in range(*event["scenarios"])]  # fmt: skip


if __name__ == "__main__":  # the command, in a process of its own
    in_small_pieces()
    sys.argv[0] = "adwa"
    cli.main()
