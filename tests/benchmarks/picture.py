"""The benchmark's picture: how many times faster than each other program, task by task."""

from pathlib import Path
from typing import Any

from scenarios.drawing import BLUE, VERMILLION, new_figure
from tuning.outputs import save_figure

TICKS = (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0)


def draw(figures: list[dict[str, Any]], path: Path) -> None:
    """Bars of ours over theirs, on a logarithmic axis; shorter than 1 is slower."""
    rows = [row for row in figures if row["who"] != "adwa-jax" and against_others(row, figures)]
    save_figure(lambda: picture(rows), path)


def against_others(row: dict[str, Any], figures: list[dict[str, Any]]) -> bool:
    """Whether the row is of a task that we are in as well."""
    return any(other["task"] == row["task"] and other["who"] == "adwa-jax" for other in figures)


def picture(rows: list[dict[str, Any]]) -> Any:
    """One bar a row, from 1 to the ratio."""
    figure = new_figure((9.0, 1.2 + 0.3 * len(rows)))
    axes = figure.add_subplot()
    ratios = [row["ours to it"] for row in rows]
    axes.barh(range(len(rows)), [ratio - 1.0 for ratio in ratios], left=1.0, edgecolor="white",
              color=[BLUE if ratio >= 1 else VERMILLION for ratio in ratios],
              hatch=["" if ratio >= 1 else "//" for ratio in ratios])  # fmt: skip
    axes.set_yticks(range(len(rows)), [f"{row['task']}: {row['who']}" for row in rows])
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.set_xlim(min(ratios) / 3, max(ratios) * 3)
    ticks = [tick for tick in TICKS if min(ratios) / 3 < tick < max(ratios) * 3]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.axvline(1.0, color="black", linewidth=1.0)
    for place, ratio in enumerate(ratios):
        text = f" {ratio:.2f}× " if ratio < 10 else f" {ratio:.0f}× "
        axes.text(ratio, place, text, va="center", ha="left" if ratio >= 1 else "right")
    axes.set_xlabel("our rate over theirs, all cores; hatched: slower")
    return figure
