"""The benchmark's picture: how many times faster than each other program, task by task."""

from pathlib import Path
from typing import Any

from scenarios.drawing import BLUE, VERMILLION, new_figure
from tuning.outputs import save_figure


def draw(figures: list[dict[str, Any]], path: Path) -> None:
    """Bars of ours over theirs, on a logarithmic axis; shorter than 1 is slower."""
    rows = [row for row in figures if row["who"] != "adwa-jax" and against_others(row, figures)]
    save_figure(lambda: picture(rows), path)


def against_others(row: dict[str, Any], figures: list[dict[str, Any]]) -> bool:
    """Whether the row is of a task that we are in as well."""
    return any(other["task"] == row["task"] and other["who"] == "adwa-jax" for other in figures)


def picture(rows: list[dict[str, Any]]) -> Any:
    """One bar a row."""
    figure = new_figure((9.0, 1.2 + 0.3 * len(rows)))
    axes = figure.add_subplot()
    ratios = [row["ours to it"] for row in rows]
    colours = [BLUE if ratio >= 1 else VERMILLION for ratio in ratios]
    axes.barh(range(len(rows)), ratios, color=colours, hatch=["" if ratio >= 1 else "//" for ratio in ratios],
              edgecolor="white")  # fmt: skip
    axes.set_yticks(range(len(rows)), [f"{row['task']}: {row['who']}" for row in rows])
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.axvline(1.0, color="black", linewidth=1.0)
    for place, ratio in enumerate(ratios):
        axes.text(ratio, place, f" {ratio:.2g}×", va="center")
    axes.set_xlabel("our rate over theirs, all cores (logarithmic); hatched: slower than they are")
    return figure
