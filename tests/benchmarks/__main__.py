"""`make bench`: our rates beside those of others, on the same inputs in the same run: table, out/bench.json, picture.

`python -m tests.benchmarks --job W S` times one job alone: W weight vectors on S scenarios.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

import jax
from rich.console import Console
from rich.table import Table

from tests.benchmarks import decisions, episodes, searches
from tests.benchmarks.picture import draw
from tests.benchmarks.timing import Figure
from tests.benchmarks.yardstick import yardstick
from tuning.compiled import keep_compiled

OUT = Path("out")
JOBS = ((1, 1024), (8, 1024))  # weight vectors, scenarios


def main() -> None:
    """Measure, print, write."""
    arguments = parsed()
    OUT.mkdir(exist_ok=True)
    keep_compiled()
    if arguments.job:
        write(job_file(*arguments.job), episodes.job(*arguments.job))
        return
    report = measured()
    write(OUT / "bench.json", report)
    draw(report["figures"], OUT / "bench.png")
    show(report)


def parsed() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("--job", nargs=2, type=int, metavar=("W", "S"), help="only a job of so many evaluations")
    return parser.parse_args()


def measured() -> dict[str, Any]:
    """Everything, part after part."""
    program = yardstick()
    figures = decisions.against_peers(program)
    for side, count, chunk in searches.SIZES:
        figures += searches.against_peers(program, side, count, chunk)
    figures += episodes.against_yardstick(program)
    figures += decisions.presets_beside() + episodes.presets() + episodes.scaling()
    checks: dict[str, Any] = {"seconds to compile and evaluate one scenario": episodes.compile_time()}
    if program:
        differing = decisions.choices_that_differ(program)
        checks["DWA choices that differ of 1000, by how much ours scores better"] = differing
        checks["episodes from the yardstick's plans"] = episodes.agreement(program)
    return {"machine": machine(), "figures": records(figures), "checks": checks,
            "jobs": [job_apart(*sizes) for sizes in JOBS]}  # fmt: skip


def job_apart(weights: int, scenarios: int) -> dict[str, Any]:
    """A job in a process of its own, whose memory it has for itself."""
    subprocess.run([sys.executable, "-m", "tests.benchmarks", "--job", str(weights), str(scenarios)], check=True)
    return json.loads(job_file(weights, scenarios).read_text())


def job_file(weights: int, scenarios: int) -> Path:
    """Where a job's figures are written."""
    return OUT / f"job_{weights}x{scenarios}.json"


def records(figures: list[Figure]) -> list[dict[str, Any]]:
    """Each beside ours in the same task, which is the first named."""
    ours = {figure.task: figure.rate for figure in reversed(figures)}
    return [figure.record(None) | {"ours to it": ours[figure.task] / figure.rate} for figure in figures]


def show(report: dict[str, Any]) -> None:
    """Ratios first."""
    table = Table(title="Medians, all on all cores; ours to it: the first row of a task over this one")
    for heading in ("task", "who", "ours to it", "a second", "counted", "first call [s]"):
        table.add_column(heading, justify="left" if heading in ("task", "who", "counted") else "right")
    for row in report["figures"]:
        table.add_row(row["task"], row["who"], f"{row['ours to it']:.2f}", f"{row['rate']:,.0f}", row["unit"],
                      f"{row['first_s']:.1f}")  # fmt: skip
    console = Console(width=130)
    console.print(table)
    for name, found in report["checks"].items():
        console.print(f"{name}: {found}")
    for job in report["jobs"]:
        console.print(f"job of {job['weights']} × {job['scenarios']}: {job['wall_s']:.1f} s, "
                      f"{job['episodes_per_s']:.1f} episodes/s, peak {job['peak_MiB']:.0f} MiB, {job['plans']} plans")
    console.print("; ".join(f"{name} {value}" for name, value in report["machine"].items()))


def write(path: Path, report: dict[str, Any]) -> None:
    """As JSON."""
    path.write_text(json.dumps(report, indent=1) + "\n")
    print(f"wrote {path}")


def machine() -> dict[str, Any]:
    """What the figures were measured on."""
    device = jax.devices()[0]
    return {"cores": os.cpu_count(), "processor": processor(), "python": platform.python_version(),
            "jax": jax.__version__, "device": f"{device.platform}: {device.device_kind}"}  # fmt: skip


def processor() -> str:
    """Its name where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.machine()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())


if __name__ == "__main__":
    main()
