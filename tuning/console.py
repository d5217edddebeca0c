"""What the command line shows while it works and when it is done."""

import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich import box
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

from adwa_jax.astar import Status
from scenarios.feasibility import Feasibility
from tuning.results import OVER_ALL, Results

PATIENCE = 2.0  # [s] work shorter than this shows no bar
MOST_ROWS = 20  # of a table of plans

UNITS = {  # of the measures a table shows
    "time": "s", "length": "m", "length_ratio": "", "spl": "", "breaking_points": "", "danger_points": "",
    "least_clearance": "m", "mean_clearance": "m", "curvature": "1/m", "angle_over_length": "rad/m",
    "command_variation": "", "jerk": "m/s³", "barn_score": "", "brakings": "", "replans": "", "hit_while_stopped": "",
    "optimal_length": "m", "planned_length": "m", "planned_length_ratio": "", "key_point_length": "m",
    "key_point_count": "", "expansions": "",
}  # fmt: skip


def note(text: str) -> None:
    """A line beside the results, on standard error, so that standard output holds results only."""
    print(text, file=sys.stderr)


def show(table: Table) -> None:
    """Print a table; a terminal too narrow for it, or none, cuts nothing off."""
    console = Console()
    console.width = max(console.width, console.measure(table, options=console.options.update(max_width=1000)).maximum)
    console.print(table)


class _Rate(ProgressColumn):
    """How many a second."""

    def render(self, task: Task) -> Text:
        """Nothing before it is known."""
        return Text(f"{task.speed:,.1f}/s" if task.speed else "")


@contextmanager
def progress_bar(title: str, quiet: bool) -> Iterator[Callable[[int, int], None]]:
    """A function (done, total) that moves a bar, which appears once the work has lasted `PATIENCE` seconds.

    The bar is on standard error, and only where that is a terminal.
    """
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), _Rate(),
               TimeElapsedColumn(), TimeRemainingColumn())  # fmt: skip
    bar = Progress(*columns, console=Console(stderr=True), transient=True, disable=quiet)
    task = bar.add_task(title, total=None)
    timer = threading.Timer(PATIENCE, bar.start)
    timer.daemon = True
    timer.start()
    try:
        yield lambda done, total: bar.update(task, completed=done, total=total)
    finally:
        timer.cancel()
        timer.join()
        bar.live.stop()  # bar.stop() prints an empty line where there is no terminal


def results_table(results: Results) -> Table:
    """Outcomes with their share, success with its interval, and the means beside it."""
    summary = results.summary()
    low, high = summary["success_ci"]
    table = _table(f"{results.suite}: {results.count} scenarios", "", "", left=1)
    table.add_column("")
    table.show_header = False
    table.add_row("success rate", f"{summary['success_rate']:.1%}", f"95 %: {low:.1%} … {high:.1%} (Wilson)")
    standing = f" ({results.standing_hits()} while the robot stood)"
    for name, count in summary["outcomes"].items():
        table.add_row(name, str(count), f"{count / results.count:.1%}" + standing * (name == "HIT_MOVER" and count > 0))
    table.add_section()
    if summary["feasible"] is not None:
        _add_feasible(summary["feasible"], results.count, table)
    for name, clearance in summary["closest_approach"].items():
        shown = "–" if clearance is None else f"{clearance:.3f} m"
        table.add_row(f"closest approach, {name}", shown, "of all driven")
    reached = f"mean of {int(results.reached.sum())} reached"
    for name, mean in summary["means"].items():
        shown = "–" if mean is None else f"{mean:.3f} {UNITS.get(name, '')}".rstrip()
        table.add_row(name, shown, f"mean of all {results.count}" if name in OVER_ALL else reached)
    return table


def _add_feasible(feasible: dict[str, Any], count: int, table: Table) -> None:
    """What is proven of the scenarios, and the success among those kept."""
    for kind in Feasibility:
        table.add_row(f"proven {kind.name}" if kind != Feasibility.UNKNOWN else "neither proven",
                      str(feasible[kind.name]), f"{feasible[kind.name] / count:.1%}")  # fmt: skip
    for name in ("not_impossible", "possible"):
        among = feasible[name]
        rate = "–" if among["success_rate"] is None else f"{among['success_rate']:.1%}"
        low, high = among["success_ci"]
        table.add_row(f"success of the {among['count']} {name.replace('_', ' ')}", rate,
                      f"95 %: {low:.1%} … {high:.1%} (Wilson)")  # fmt: skip
    table.add_section()


def plans_table(map_name: str, records: list[dict[str, Any]]) -> Table:
    """The first `MOST_ROWS` plans, from their JSON objects, under the map's name and a count of how they ended."""
    counts = Counter(record["status"] for record in records)
    found = ", ".join(f"{counts[status.name]} {status.name}" for status in Status if counts[status.name])
    columns = {"status": "status", "length": "length", "expected": "listed", "expansions": "expanded",
               "breaking_points": "turns", "danger_points": "danger", "key_point_length": "key-point"}  # fmt: skip
    shown = {name: heading for name, heading in columns.items() if name in records[0]}
    table = _table(f"{map_name}: {found}", "start", "goal", *shown.values(), left=2)
    for record in records[:MOST_ROWS]:
        points = [f"{record[end][0]:g},{record[end][1]:g}" for end in ("start", "goal")]
        table.add_row(*points, *(_cell(record[name]) for name in shown))
    if len(records) > MOST_ROWS:
        table.caption = f"{len(records) - MOST_ROWS} more (--json has them all)"
    return table


def _table(title: str, *headings: str, left: int) -> Table:
    """An empty table, the first `left` columns flush left; a title may hold brackets, which rich takes for markup."""
    table = Table(title=Text(title), title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for index, heading in enumerate(headings):
        table.add_column(heading, justify="left" if index < left else "right", no_wrap=True)
    return table


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4f}" if value == 0 or 1e-2 <= value < 1e6 else f"{value:.4g}"
    return "–" if value is None else str(value)
