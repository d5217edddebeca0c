"""Pictures of what gradients see: a loss over two constants, arrows, a softened decision, a smoothed search.

Conventions: `scenarios.drawing`. Fields go from light to dark as they grow.
Dimension letters: A, U values across and up; B points; L temperatures; X values.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from scenarios.drawing import BLACK, BLUE, CELL_LINES, FONT, ORANGE, VERMILLION, figure_of, new_figure
from tuning.figures import Panels, legend_of, panels_of
from tuning.findings import Interval
from tuning.search_slope import Smoothed
from tuning.softened import Softened
from tuning.space import Space

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DARKEST = 0.75  # of cividis, so that arrows can be told from the field
HARD = {"facecolor": BLACK, "edgecolor": "white"}
SOFT = {"facecolor": "white", "edgecolor": BLACK}
LINES = ("-", "--", "-.", ":")
LINE_COLOURS = (BLUE, ORANGE, VERMILLION, BLACK)


class Arrows(NamedTuple):
    """Gradients at some points: steepest descent is the other way."""

    points: np.ndarray  # [B, 2] in the unit square
    hard: np.ndarray  # [B, 2]
    relaxed: np.ndarray  # [B, 2]


def landscape_figure(space: Space, unit: np.ndarray, hard: np.ndarray, relaxed: np.ndarray,
                     arrows: Arrows | None = None, axes: "Panels | None" = None) -> "Figure":
    """The hard loss and the relaxed one side by side, both [A · U] at the points `unit` [A · U, 2] of a lattice, and at
    some points which way down each planner's gradient says; arrows have one length.
    """
    alone = axes is None
    panels = panels_of(new_figure((10.4, 4.9)).subplots(1, 2) if axes is None else axes, 2)
    for ax, losses, label in zip(panels, (hard, relaxed), ("scalarised objective of the hard planner [1]",
                                                         "loss of the relaxed planner [1]"), strict=True):  # fmt: skip
        _draw_losses(space, unit, losses, ax, label)
        if arrows is not None:
            _draw_arrows(space, arrows.points, arrows.hard, ax, "downhill by the hard gradient", HARD)
            _draw_arrows(space, arrows.points, arrows.relaxed, ax, "downhill by the surrogate's gradient", SOFT)
            _number(space.values(arrows.points), ax)
    legend_of(panels, alone)
    return figure_of(panels[0])


def intervals_figure(found: Mapping[str, Interval], label: str, chance: float = 0.0, least: float = -1.0,
                     ax: "Axes | None" = None) -> "Figure":
    """Estimates by name with their 95 % intervals, on an axis from `least` to 1; dashed: what chance would give."""
    alone = ax is None
    ax = new_figure((7.4, 0.42 * len(found) + 1.2)).subplots() if ax is None else ax
    place = np.arange(len(found))
    value, low, high = np.array(list(found.values())).T
    ax.errorbar(value, place, xerr=np.maximum([value - low, high - value], 0.0), fmt="o", color=BLUE, capsize=3,
                label="estimate, 95 % interval")  # fmt: skip
    ax.axvline(chance, color=BLACK, linewidth=0.8, linestyle="--", label="chance")
    ax.set_yticks(place, list(found), fontsize=FONT)
    ax.set(ylim=(len(found) - 0.5, -0.5), xlim=(least - 0.05, 1.05))
    _dress(ax, label, "")
    legend_of([ax], alone)
    return figure_of(ax)


def temperature_figure(temperatures: Sequence[float], cosines: Sequence[Interval], signs: Sequence[Interval],
                       ax: "Axes | None" = None) -> "Figure":
    """Agreement of the surrogate's gradient with the hard one over the temperature of the choice, [L] each."""
    alone = ax is None
    ax = new_figure((6.4, 3.6)).subplots() if ax is None else ax
    styles: tuple[dict[str, Any], ...] = ({"fmt": "o-", "color": BLUE},
                                          {"fmt": "D--", "color": ORANGE, "markeredgecolor": BLACK})  # fmt: skip
    for shift, found, name, style in ((0.96, cosines, "mean cosine", styles[0]),
                                      (1.04, signs, "share of signs that agree", styles[1])):  # fmt: skip
        value, low, high = np.array(found).T
        ax.errorbar(shift * np.asarray(temperatures), value, np.maximum([value - low, high - value], 0.0), capsize=3,
                    label=f"{name}, 95 % interval", **style)  # fmt: skip
    for chance in (0.0, 0.5):
        ax.axhline(chance, color=BLACK, linewidth=0.8, linestyle=":", label="chance: 0 and ½", zorder=0)
    ax.set(xscale="log", ylim=(-1.05, 1.05))
    _dress(ax, "temperature of the choice [1]", "agreement with the hard gradient [1]")
    legend_of([ax], alone)
    return figure_of(ax)


def softened_figure(found: Softened, axes: "Panels | None" = None) -> "Figure":
    """One decision: each candidate's share at every temperature, then the turn commanded over one weight.

    axes: L + 1.
    """
    count, alone = len(found.temperatures), axes is None
    if axes is None:
        figure = new_figure((3.1 * count + 0.3, 6.6))
        grid = figure.add_gridspec(2, count, height_ratios=(1.0, 1.15))
        axes = [*(figure.add_subplot(grid[0, place]) for place in range(count)), figure.add_subplot(grid[1, :])]
    panels = panels_of(axes, count + 1)
    for place, ax in enumerate(panels[:count]):
        _draw_share(found, place, ax)
    _draw_command(found, panels[count])
    legend_of(panels, alone)
    return figure_of(panels[0])


def smoothed_figure(found: Smoothed, name: str = "expansions", unit: str = "1",
                    axes: "Panels | None" = None) -> "Figure":
    """A search's f(ω) on the first map, its mean over a window with tangents, and the slope over all maps."""
    alone = axes is None
    left, right = panels_of(new_figure((10.4, 4.2)).subplots(1, 2) if axes is None else axes, 2)
    weight = found.weight[found.inner]
    left.step(found.weight, found.each[0], where="mid", color=BLACK, linewidth=1.0, label=f"{name} on one map")
    left.plot(weight, found.mean[0], color=BLUE, linewidth=2.0, label=f"mean over ω ± {found.reach:g}")
    for place in np.linspace(0, len(weight) - 1, 7).round().astype(int)[1:-1]:
        ends = weight[place] + np.array([-1.0, 1.0]) * found.reach
        left.plot(ends, found.mean[0, place] + found.slope[0, place] * (ends - weight[place]), color=VERMILLION,
                  linewidth=1.6, linestyle="--", label="its slope, from two searches")  # fmt: skip
        left.plot(weight[place], found.mean[0, place], marker="o", color=VERMILLION, markeredgecolor=BLACK)
    _dress(left, "heuristic weight ω [1]", f"{name} [{unit}]")
    slope, half = found.slope.mean(axis=0), 1.96 * found.slope.std(axis=0, ddof=1) / np.sqrt(len(found.slope))
    right.fill_between(weight, slope - half, slope + half, color=BLUE, alpha=0.3, linewidth=0,
                       label=f"95 % of the mean over {len(found.slope)} maps")  # fmt: skip
    right.plot(weight, slope, color=BLUE, linewidth=2.0, label="slope, mean over the maps")
    right.plot(weight, found.slope[0], color=BLACK, linewidth=0.9, linestyle=":", label="slope on the one map")
    right.axhline(0.0, color=BLACK, linewidth=0.8, linestyle="--")
    _dress(right, "heuristic weight ω [1]", f"slope of {name} over ω [{unit}]")
    legend_of([left, right], alone)
    return figure_of(left)


def _draw_losses(space: Space, unit: np.ndarray, losses: np.ndarray, ax: "Axes", label: str) -> None:
    """A field over the two constants, its least, and the base's own constants."""
    x, y = (np.unique(column) for column in space.values(unit).T)
    field = np.reshape(losses, (len(y), len(x)))
    image = ax.pcolormesh(x, y, field, cmap=_light_to_dark(), shading="nearest")
    bar = figure_of(ax).colorbar(image, ax=ax, shrink=0.9, pad=0.02)
    bar.set_label(label, fontsize=FONT)
    bar.ax.tick_params(labelsize=FONT - 1)
    least = np.unravel_index(np.argmin(field), field.shape)
    marks: dict[str, Any] = {"linestyle": "none", "markeredgecolor": BLACK, "zorder": 6}
    ax.plot(x[least[1]], y[least[0]], marker="*", markersize=13, color=ORANGE, label="least of the lattice", **marks)
    ax.plot(*space.default, marker="s", markersize=7, color=ORANGE, label="constants of the preset", **marks)
    ax.set_xlabel(f"weight {space.names[0]} [1]", fontsize=FONT)
    ax.set_ylabel(f"weight {space.names[1]} [1]", fontsize=FONT)
    ax.tick_params(labelsize=FONT - 1)


def _draw_arrows(space: Space, points: np.ndarray, slopes: np.ndarray, ax: "Axes", label: str,
                 style: Mapping[str, Any]) -> None:
    """Of one length, from the points downhill; what has no slope gets none."""
    at, length = space.values(points), np.linalg.norm(slopes, axis=1, keepdims=True)
    down = -slopes / np.where(length > 0, length, 1.0)
    ax.quiver(*at.T, *down.T, angles="xy", scale=9.0, width=0.011, headwidth=3.6, headlength=4.2, headaxislength=4.0,
              linewidth=0.8, zorder=5, label=label, **style)  # fmt: skip


def _number(points: np.ndarray, ax: "Axes") -> None:
    for number, point in enumerate(points, start=1):
        ax.annotate(str(number), point, ha="center", va="center", fontsize=FONT - 2, zorder=7,
                    bbox={"boxstyle": "circle,pad=0.15", "facecolor": "white", "edgecolor": BLACK, "linewidth": 0.6})


def _draw_share(found: Softened, place: int, ax: "Axes") -> None:
    share = found.share[place]
    image = ax.pcolormesh(found.yaw_rate, found.v, share / share.max(), cmap="Blues", vmin=0.0, vmax=1.0,
                          shading="nearest", edgecolors=CELL_LINES, linewidth=0.3)  # fmt: skip
    if place == len(found.temperatures) - 1:
        bar = figure_of(ax).colorbar(image, ax=ax, pad=0.02)
        bar.set_label("share ÷ largest share [1]", fontsize=FONT)
        bar.ax.tick_params(labelsize=FONT - 1)
    ax.plot(share.sum(axis=0) @ found.yaw_rate, share.sum(axis=1) @ found.v, marker="X", markersize=10, color=ORANGE,
            markeredgecolor=BLACK, linestyle="none", label="mean of the shares")  # fmt: skip
    ax.set_title(f"temperature {found.temperatures[place]:g}, largest share {share.max():.1%}", fontsize=FONT)
    ax.invert_xaxis()  # turns to the left on the left
    _dress(ax, "yaw rate [rad/s], to the left > 0", "speed [m/s]" if place == 0 else "")
    ax.grid(visible=False)


def _draw_command(found: Softened, ax: "Axes") -> None:
    ax.plot(found.values, found.hard[:, 1], color=BLACK, linewidth=2.4, drawstyle="steps-mid", label="hard planner")
    for place, temperature in enumerate(found.temperatures):
        ax.plot(found.values, found.soft[place, :, 1], color=LINE_COLOURS[place % 3], linewidth=1.6,
                linestyle=LINES[1 + place % 3], label=f"temperature {temperature:g}")  # fmt: skip
    ax.axvline(found.own, color=CELL_LINES, linewidth=1.5, zorder=0, label="weight as above")
    _dress(ax, f"weight {found.weight} [1]", "yaw rate commanded [rad/s]")


def _dress(ax: "Axes", across: str, up: str) -> None:
    ax.set_xlabel(across, fontsize=FONT)
    ax.set_ylabel(up, fontsize=FONT)
    ax.tick_params(labelsize=FONT - 1)
    ax.grid(color=CELL_LINES, linewidth=0.5)
    ax.set_axisbelow(True)


def _light_to_dark() -> Any:
    """Cividis from its light end, without its darkest part."""
    from matplotlib import colormaps
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("light to dark", colormaps["cividis_r"](np.linspace(0.0, DARKEST, 64)))
