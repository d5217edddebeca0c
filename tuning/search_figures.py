"""Pictures of what both planners and the heuristic weight do over many maps. Conventions: `scenarios.drawing`."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from scenarios.drawing import BLACK, BLUE, FONT, ORANGE, SKY, VERMILLION, figure_of, new_figure
from tuning.figures import Panels, legend_of, panels_of
from tuning.intervals import mean_interval
from tuning.search_study import Tradeoff
from tuning.table1 import PAPER_TABLE, QUANTITIES, PlannedMaps, measured, verdicts

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKS = ("o", "s", "^", "D", "v", "P")
VERDICTS = (("improved A* better", BLUE, ""), ("equal", "#E6E6E6", "...."), ("traditional A* better", ORANGE, "////"))


def table1_figure(reports: Mapping[int, PlannedMaps], axes: "Panels | None" = None) -> "Figure":
    """Table 1: each quantity's mean over the maps with its 95 % interval, filled; the paper's one map, hollow.

    reports: by the side of the maps in cells.
    """
    alone = axes is None
    count = len(QUANTITIES)
    panels = panels_of(new_figure((10.2, 3.7)).subplots(1, count) if axes is None else axes, count)
    for place, (quantity, ax) in enumerate(zip(QUANTITIES, panels, strict=True)):
        for side, (planner, marker, colour) in enumerate((("improved", "o", BLUE), ("traditional", "s", VERMILLION))):
            at = np.arange(len(reports)) + 0.18 * (side - 0.5)
            mean, low, high = np.array([mean_interval(measured(maps)[quantity][side]) for maps in reports.values()]).T
            ax.errorbar(at, mean, (mean - low, high - mean), fmt=marker, color=colour, markersize=7, capsize=3,
                        label=f"{planner} A*, mean of many maps")
            printed = [PAPER_TABLE[size][place][side] for size in reports]
            ax.plot(at + 0.18 * (2 * side - 1), printed, marker=marker, markersize=8, markerfacecolor="none",
                    markeredgecolor=colour, linestyle="none", label=f"{planner} A*, the paper's map")
        sizes = [f"{size} × {size}\n{len(maps.improved)} maps" for size, maps in reports.items()]
        ax.set_xticks(range(len(reports)), sizes)
        top = ax.get_ylim()[1]
        ax.set(xlim=(-0.6, len(reports) - 0.4), ylim=(-0.04 * top, 1.06 * top))
        ax.set_ylabel(quantity if "[" in quantity else f"{quantity} [1]", fontsize=FONT)
        ax.tick_params(labelsize=FONT - 1)
    legend_of(panels, alone)
    return figure_of(panels[0])


def verdict_figure(reports: Mapping[str, PlannedMaps], ax: "Axes | None" = None) -> "Figure":
    """On how many maps each planner does better, by name and quantity of Table 1. Fewer and shorter are better."""
    found = {name: verdicts(maps) for name, maps in reports.items()}
    rows = {f"{quantity.partition(' [')[0]}, {name}": found[name][quantity] for quantity in QUANTITIES
            for name in reports}  # fmt: skip
    alone = ax is None
    ax = new_figure((7.6, 0.33 * len(rows) + 1.3)).subplots() if ax is None else ax
    shares = np.array(list(rows.values()))
    left = np.zeros(len(rows))
    for (label, colour, hatch), share in zip(VERDICTS, shares.T, strict=True):
        ax.barh(np.arange(len(rows)), 100 * share, left=100 * left, height=0.7, color=colour, hatch=hatch,
                edgecolor=BLACK, linewidth=0.6, label=label)
        left = left + share
    ax.set_yticks(range(len(rows)), list(rows))
    ax.invert_yaxis()
    ax.set(xlim=(0, 100))
    ax.set_xlabel("maps [%]", fontsize=FONT)
    ax.tick_params(labelsize=FONT - 1)
    legend_of([ax], alone)
    return figure_of(ax)


def weight_study_figure(constant: Mapping[float, Tradeoff], shapes: Mapping[str, Tradeoff],
                        axes: "Panels | None" = None) -> "Figure":
    """Expansions and path length beside ω = 1, over constant ω and against each other, where shapes of eq. 5 stand too.

    The lower left is best: less to search, and no longer a path.
    """
    alone = axes is None
    panels = panels_of(new_figure((11.0, 4.4)).subplots(1, 3) if axes is None else axes, 3)
    weights = np.array(list(constant))
    for ax, name, label in zip(panels[:2], ("expansions", "length"), ("expansions", "path length"), strict=True):
        mean, low, high = np.array([getattr(found, name) for found in constant.values()]).T
        ax.fill_between(weights, low, high, color=SKY, alpha=0.5, linewidth=0, label="95 % of the mean")
        ax.plot(weights, mean, color=BLUE, marker="o", markersize=4, label="constant ω")
        ax.axhline(1.0, color=BLACK, linewidth=0.8, linestyle="--")
        ax.set_xlabel("heuristic weight ω [1]", fontsize=FONT)
        ax.set_ylabel(f"{label} ÷ those of ω = 1 [1]".replace("length ÷ those", "length ÷ that"), fontsize=FONT)
    draw_tradeoff(constant, shapes, panels[2])
    for ax in panels:
        ax.tick_params(labelsize=FONT - 1)
    legend_of(panels, alone)
    return figure_of(panels[0])


def draw_tradeoff(constant: Mapping[float, Tradeoff], shapes: Mapping[str, Tradeoff],
                  ax: "Axes | None" = None) -> "Axes":
    """Mean expansions against mean path length, both beside ω = 1: a line over constant ω, a mark a shape of eq. 5."""
    ax = ax if ax is not None else new_figure((4.6, 4.0)).subplots()
    line = np.array([(found.expansions[0], found.length[0]) for found in constant.values()])
    ax.plot(*line.T, color=BLUE, marker="o", markersize=4, zorder=2, label="constant ω")
    for place in _apart(line):
        weight = list(constant)[place]
        last = line[place, 0] == line[:, 0].max()  # beside it is the frame
        ax.annotate(f"ω = {weight:g}", line[place], textcoords="offset points", xytext=(0 if last else 5, 5),
                    ha="center" if last else "left", fontsize=FONT - 2)  # fmt: skip
    for (name, found), marker in zip(shapes.items(), MARKS, strict=False):
        ax.plot(found.expansions[0], found.length[0], marker=marker, markersize=8, markerfacecolor=ORANGE,
                markeredgecolor=BLACK, linestyle="none", zorder=3, label=name)
    ax.set_xlabel("expansions ÷ those of ω = 1 [1]", fontsize=FONT)
    ax.set_ylabel("path length ÷ that of ω = 1 [1]", fontsize=FONT)
    ax.margins(0.1)  # room for labels
    ax.tick_params(labelsize=FONT - 1)
    return ax


def _apart(line: np.ndarray) -> list[int]:
    """Indices of the points [N, 2] whose labels do not run into that of another; the ends come first."""
    span = np.maximum(np.ptp(line, axis=0), 1e-9)
    kept: list[int] = []
    for place in sorted(range(len(line)), key=lambda place: place not in (0, len(line) - 1)):
        if all(np.max(np.abs(line[place] - line[other]) / span / (0.25, 0.06)) > 1.0 for other in kept):
            kept.append(place)
    return kept
