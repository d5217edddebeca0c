"""`make bench`: our rates beside those of others, on the same inputs in the same run, each table when it is there.

Ends with out/bench.json and a picture. `python -m tests.benchmarks --only loop` runs one part and writes
out/bench_loop.json; `--job W S` times one job alone: W weight vectors on S scenarios.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import jax
from rich.console import Console
from rich.table import Table

from tests.benchmarks import decisions, episodes, searches
from tests.benchmarks.agreement import agreement
from tests.benchmarks.picture import draw
from tests.benchmarks.timing import Figure
from tests.benchmarks.yardstick import Yardstick, yardstick
from tuning.compiled import keep_compiled

OUT = Path("out")
JOBS = ((1, 1024), (8, 1024))  # weight vectors, scenarios
CONSOLE = Console(width=120, markup=False, highlight=False)
Row = dict[str, Any]
CONTESTS: dict[str, Callable[[Yardstick | None], Iterable[list[Figure]]]] = {
    "decisions": lambda program: [decisions.against_peers(program)],
    "searches": lambda program: (searches.against_peers(program, *sizes) for sizes in searches.SIZES),
    "loop": lambda program: [episodes.against_yardstick(program)],
    "presets": lambda program: (contest() for contest in (decisions.presets_beside, episodes.presets)),
    "scaling": lambda program: episodes.scaling(),
}
PARTS = (*CONTESTS, "checks", "jobs")


def main() -> None:
    """Measure, print as it goes, write."""
    arguments = parsed()
    OUT.mkdir(exist_ok=True)
    keep_compiled()
    if arguments.job:
        write(job_file(*arguments.job), episodes.job(*arguments.job, arguments.time_limit))
        return
    name = f"bench_{arguments.only}" if arguments.only else "bench"
    report = measured([arguments.only] if arguments.only else PARTS)
    write(OUT / f"{name}.json", report)
    draw(report["figures"], OUT / f"{name}.png")


def parsed() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("--only", choices=PARTS, help="only this part")
    parser.add_argument("--job", nargs=2, type=int, metavar=("W", "S"), help="only a job of so many evaluations")
    parser.add_argument("--time-limit", type=float, metavar="SECONDS", help="of the job's episodes")
    return parser.parse_args()


def measured(parts: Iterable[str]) -> dict[str, Any]:
    """The parts in turn."""
    program = yardstick()
    report: dict[str, Any] = {"machine": machine(), "figures": [], "checks": {}, "jobs": []}
    CONSOLE.print("; ".join(f"{name} {value}" for name, value in report["machine"].items()))
    for part in parts:
        if part == "checks":
            report["checks"] = checked(program)
        elif part == "jobs":
            report["jobs"] = [job_apart(*sizes) for sizes in JOBS]
        else:
            for figures in CONTESTS[part](program):
                report["figures"] += shown(records(figures))
    return report


def checked(program: Yardstick | None) -> dict[str, Any]:
    """What is found out besides rates, each printed when it is known."""
    checks = {"seconds to compile and evaluate one scenario": episodes.compile_time}
    if program:
        checks["DWA choices that differ of 1000, by how much ours scores better"] = lambda: (
            decisions.choices_that_differ(program))
        checks["episodes from the yardstick's plans"] = lambda: agreement(program)
    found = {}
    for name, check in checks.items():
        found[name] = check()
        CONSOLE.print(f"{name}: {sentence(found[name])}")
    return found


def sentence(found: Any) -> str:
    """Names and figures in words."""
    if isinstance(found, dict):
        return "; ".join(f"{name} {sentence(value)}" for name, value in found.items())
    return f"{found:.3g}" if isinstance(found, float) else str(found)


def job_apart(weights: int, scenarios: int) -> dict[str, Any]:
    """A job in a process of its own, whose memory it has for itself."""
    subprocess.run([sys.executable, "-m", "tests.benchmarks", "--job", str(weights), str(scenarios)], check=True)
    job = json.loads(job_file(weights, scenarios).read_text())
    CONSOLE.print(f"job of {weights} × {scenarios}: {job['episodes_per_s']:.1f} episodes/s, {job['wall_s']:.1f} s, "
                  f"peak {job['peak_MiB']:.0f} MiB, {job['plans']} plans")
    return job


def job_file(weights: int, scenarios: int) -> Path:
    """Where a job's figures are written."""
    return OUT / f"job_{weights}x{scenarios}.json"


def records(figures: list[Figure]) -> list[Row]:
    """Each of a task beside its first, which is ours where we take part: medians, and round by round."""
    first = figures[0]
    return [figure.record(None) | {
        "ours to it": first.rate / figure.rate,
        "ours to it, each round": [ours / theirs for ours, theirs in zip(first.rates, figure.rates, strict=True)],
    } for figure in figures]  # fmt: skip


def shown(rows: list[Row]) -> list[Row]:
    """Print a task's table, ratios first; the rows again."""
    table = Table(title=f"{rows[0]['task']} (medians; all cores unless named)", title_justify="left",
                  caption=notes(rows), caption_justify="left")  # fmt: skip
    table.add_column("who")
    for heading in (f"{rows[0]['who']} ÷ it", "in rounds", f"{rows[0]['unit']}/s", "first call [s]"):
        table.add_column(heading, justify="right")
    for row in rows:
        rounds = row["ours to it, each round"]
        table.add_row(row["who"], f"{row['ours to it']:.2f}", f"{min(rounds):.2f} to {max(rounds):.2f}",
                      f"{row['rate']:,.0f}", f"{row['first_s']:.1f}")  # fmt: skip
    CONSOLE.print(table)
    return rows


def notes(rows: list[Row]) -> str:
    """A line a note: whose it is, and what it says."""
    whose: dict[str, list[str]] = {}
    for row in rows:
        whose.setdefault(row["note"], []).append(row["who"])
    return "\n".join(f"{' and '.join(names)}: {note}" for note, names in whose.items() if note)


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
