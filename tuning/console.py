"""What the command line shows while it works and when it is done."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from tuning.results import OVER_ALL, Results

PATIENCE = 2.0  # [s] work shorter than this shows no bar

UNITS = {  # of the measures a table shows
    "time": "s", "length": "m", "length_ratio": "", "spl": "", "breaking_points": "", "danger_points": "",
    "least_clearance": "m", "mean_clearance": "m", "curvature": "1/m", "angle_over_length": "rad/m",
    "command_variation": "", "jerk": "m/s³", "barn_score": "", "brakings": "", "hit_while_stopped": "",
    "optimal_length": "m", "planned_length": "m", "key_point_length": "m", "key_point_count": "", "expansions": "",
}  # fmt: skip


def stderr() -> Console:
    """Where bars and notes go, so that standard output holds results only."""
    return Console(stderr=True)


@contextmanager
def progress_bar(title: str, quiet: bool) -> Iterator[Callable[[int, int], None]]:
    """A function (done, total) that moves a bar, which appears once the work has lasted `PATIENCE` seconds."""
    columns = (TextColumn(title), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=stderr(), transient=True, disable=quiet)
    task = bar.add_task(title, total=None)
    timer = threading.Timer(PATIENCE, bar.start)
    timer.daemon = True
    timer.start()
    try:
        yield lambda done, total: bar.update(task, completed=done, total=total)
    finally:
        timer.cancel()
        bar.stop()


def results_table(results: Results) -> Table:
    """Outcomes with their share, success with its interval, and the means beside it."""
    summary = results.summary()
    low, high = summary["success_ci"]
    successes = int(results.reached.sum())
    table = Table(title=f"{results.suite}: {results.count} scenarios", title_justify="left")
    table.add_column("")
    table.add_column("value", justify="right")
    table.add_column("")
    table.add_row("success rate", f"{summary['success_rate']:.1%}", f"95 % interval {low:.1%} … {high:.1%} (Wilson)")
    for name, count in summary["outcomes"].items():
        table.add_row(name, str(count), f"{count / results.count:.1%}")
    table.add_section()
    for name, mean in summary["means"].items():
        over = f"all {results.count}" if name in OVER_ALL else f"the {successes} successes"
        shown = "–" if mean is None else f"{mean:.3f} {UNITS.get(name, '')}".rstrip()
        table.add_row(name, shown, f"mean over {over}")
    return table
