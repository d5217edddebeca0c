"""The benchmark's picture: how many times faster than each other program, task by task."""

from itertools import groupby
from pathlib import Path
from typing import Any

from scenarios.drawing import BLUE, CELL_LINES, FONT, VERMILLION, new_figure
from tuning.outputs import save_figure

TICKS = (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0)
ROOM = 3.0  # for the figures beside the bars, as a factor
Row = dict[str, Any]


def draw(figures: list[Row], path: Path) -> None:
    """Bars of ours over theirs, on a logarithmic axis, for each task that we and others are in."""
    tasks = [list(rows) for _, rows in groupby(figures, key=lambda row: row["task"])]
    shared = [rows for rows in tasks if len(rows) > 1 and any(row["who"] == "adwa-jax" for row in rows)]
    if shared:
        save_figure(lambda: picture([row for rows in shared for row in rows]), path)


def picture(rows: list[Row]) -> Any:
    """A line a row: a task's name and our rate where the row is ours, else a bar from 1 to the ratio."""
    figure = new_figure((7.5, 0.9 + 0.24 * len(rows)))
    axes = figure.add_subplot()
    bars = {place: row["ours to it"] for place, row in enumerate(rows) if row["who"] != "adwa-jax"}
    draw_scale(axes, list(bars.values()))
    axes.set_yticks(range(len(rows)), [row["who"] if place in bars else row["task"] for place, row in enumerate(rows)],
                    fontsize=FONT)  # fmt: skip
    for place, (label, row) in enumerate(zip(axes.get_yticklabels(), rows, strict=True)):
        if place in bars:
            draw_bar(axes, place, bars[place])
        else:
            label.set_fontweight("bold")
            axes.text(1.0, place, f" adwa-jax: {row['rate']:,.0f} {row['unit']}/s", va="center", fontsize=FONT)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.spines[["top", "right", "left"]].set_visible(False)
    return figure


def draw_bar(axes: Any, place: int, ratio: float) -> None:
    """To the right and plain where we are faster, to the left and hatched where we are slower; the ratio at its end."""
    faster = ratio >= 1.0
    axes.barh(place, ratio - 1.0, left=1.0, height=0.7, edgecolor="white", color=BLUE if faster else VERMILLION,
              hatch="" if faster else "////", zorder=2)  # fmt: skip
    axes.text(ratio, place, f" {ratio:.2f}× " if ratio < 10 else f" {ratio:.0f}× ", va="center",
              ha="left" if faster else "right", fontsize=FONT)  # fmt: skip


def draw_scale(axes: Any, ratios: list[float]) -> None:
    """The axis, which has room for the figures, and a line where we are as fast."""
    low, high = min(1.0, *ratios) / ROOM, max(1.0, *ratios) * ROOM
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    ticks = [tick for tick in TICKS if low < tick < high]
    axes.set_xticks(ticks, [f"{tick:g}×" for tick in ticks], fontsize=FONT)
    axes.minorticks_off()
    axes.grid(axis="x", color=CELL_LINES, zorder=0)
    axes.axvline(1.0, color="black", linewidth=1.0, zorder=3)
    axes.set_xlabel("our rate ÷ theirs, on all cores unless named\nhatched: we are slower", fontsize=FONT)
