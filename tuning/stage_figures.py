"""Pictures of what happens inside the planner: density, ω, the order of expansions, one decision.

Conventions: `scenarios.drawing`. Fields go from light to dark as they grow, and never become as dark as an obstacle, so
that they can be read in grey.
Dimension letters: H, W map without its padding; V, N candidates; K predicted points; M movers.
"""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from adwa_jax.astar import SearchResult
from adwa_jax.grid import Grid
from adwa_jax.scenario import Scenario
from adwa_jax.window import RobotLimits
from scenarios.drawing import (
    BLACK,
    FONT,
    OCCUPIED,
    ORANGE,
    SKY,
    VERMILLION,
    draw_ends,
    draw_map,
    draw_movers,
    draw_squares,
    extent,
    figure_of,
    legend_below,
    new_figure,
)
from tuning.figures import Panels, disc_centres, draw_outline, draw_used_map, panels_of, used_map_size
from tuning.planning import path_length
from tuning.stages import Densities, Moment

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

MOST_SIGNS = 32  # cells a side up to which a sign is put into each
AROUND = 2.6  # [m] that is shown of the map to each side of a deciding robot
REFUSED = "#9A9A9A"
SCORED = "admissible, by score"


def density_figure(scenario: Scenario, found: Densities, cell: tuple[int, int] | None = None, y_down: bool = False,
                   ax: "Axes | None" = None) -> "Figure":
    """P of eq. 2 for every free cell, as a share of Q; the dashed rectangle is that of `cell` (row, col)."""
    ax = _map_with_bar(scenario.grid, _ends(scenario), ax, y_down)
    _draw_field(scenario.grid, found.local / max(found.overall, 1e-9), ax, "density to the goal ÷ map's, P/Q [1]")
    draw_ends(scenario.start[:2], scenario.goal, ax)
    if cell is not None:
        _draw_rectangle(scenario, found, cell, ax)
    ax.set_title(f"Obstacle density; Q = {found.overall:.3f}", fontsize=FONT)
    legend_below(ax)
    return figure_of(ax)


def weight_figure(scenario: Scenario, found: Densities, y_down: bool = False, ax: "Axes | None" = None) -> "Figure":
    """ω of eq. 5 for every free cell; − stands where it is below 1 (dense), + where above (sparse)."""
    ax = _map_with_bar(scenario.grid, _ends(scenario), ax, y_down)
    _draw_field(scenario.grid, found.weight, ax, "heuristic weight ω [1]")
    draw_ends(scenario.start[:2], scenario.goal, ax)
    _draw_signs(scenario.grid, found.weight, ax)
    free = ~_occupied(scenario.grid)
    below, above = (float(part[free].mean()) for part in (found.weight < 1, found.weight > 1))
    ax.set_title(f"Heuristic weight; ω < 1 in {100 * below:.0f} %, ω > 1 in {100 * above:.0f} % of the free cells",
                 fontsize=FONT)  # fmt: skip
    legend_below(ax)
    return figure_of(ax)


def expansion_figure(grid: Grid, found: SearchResult, name: str = "A*", y_down: bool = False,
                     ax: "Axes | None" = None, most: int | None = None) -> "Figure":
    """Cells coloured by the order in which the search closed them, cells it never closed white, and the grid path.

    most: expansions at which the colours end, the same for searches that are to be compared; this search's unless
    given.
    """
    cells = np.asarray(found.path)[: int(found.path_cells)]
    path = (cells[:, ::-1] + 0.5) * float(grid.resolution) + np.asarray(grid.origin)
    ax = _map_with_bar(grid, path, ax, y_down)
    rows, columns = int(grid.height), int(grid.width)
    order = np.asarray(found.expanded_at)[:rows, :columns]
    ends = (1.0, float(most)) if most is not None else None
    _draw_field(grid, np.where(order >= 0, order + 1.0, np.nan), ax, "order of expansion [1]", ends)
    ax.plot(*path.T, color=BLACK, linewidth=2.0, zorder=4, label="grid path")
    if len(path):
        draw_ends(path[0], path[-1], ax)
    free, length = int((~_occupied(grid)).sum()), path_length(found) * float(grid.resolution)
    expanded = f"{int(found.expansions)} of {free} free cells expanded"
    ax.set_title(f"{name}: {expanded}, path {length:.2f} m", fontsize=FONT)
    legend_below(ax)
    return figure_of(ax)


def decision_figure(scenario: Scenario, moment: Moment, robot: RobotLimits, y_down: bool = False,
                    axes: "Panels | None" = None) -> "Figure":
    """One decision: all candidates on the map, the window of velocities, and the terms of the chosen one. axes: 3."""
    if axes is None:
        figure = new_figure((10.4, 5.9))
        grid = figure.add_gridspec(2, 2, width_ratios=(1.25, 1.0))
        axes = [figure.add_subplot(grid[place]) for place in (np.s_[:, 0], np.s_[0, 1], np.s_[1, 1])]
    arcs, window, terms = panels_of(axes, 3)
    draw_candidates(scenario, moment, robot, arcs, y_down)
    draw_window(moment, window)
    draw_terms(moment, terms)
    return figure_of(arcs)


def draw_candidates(scenario: Scenario, moment: Moment, robot: RobotLimits, ax: "Axes | None" = None,
                    y_down: bool = False) -> "Axes":
    """Candidate arcs, the admissible ones coloured by score, the best on top, the others grey and dashed.

    Around the robot [`AROUND`]. Movers in sight are drawn where they are, and hollow where they are expected at the
    end of the horizon; the target is where it is, or the dotted line points to it.
    """
    from matplotlib.ticker import MaxNLocator

    ax = draw_map(scenario.grid, ax if ax is not None else new_figure((5.6, 6.0)).subplots(), y_down)
    ax.set_facecolor(OCCUPIED)  # beyond the border, where all counts as occupied
    _draw_near_squares(scenario, moment, ax)
    _draw_near_movers(scenario, moment, ax)
    _draw_refused(moment, ax)
    _draw_scored(moment, ax)
    here = np.array([moment.robot.x, moment.robot.y], np.float64)
    discs = disc_centres(here, float(moment.robot.heading), robot.disc_offsets)
    draw_outline(discs, float(robot.radius), ax, "robot", facecolor="white", zorder=4)
    ax.plot(*np.stack([here, moment.target]).T, color=BLACK, linewidth=0.9, linestyle=":", zorder=3,
            label="to the local target")
    if np.abs(moment.target - here).max() < AROUND:
        ax.plot(*moment.target[:, None], marker="D", markersize=7, color=BLACK, linestyle="none", zorder=7,
                label="local target")
    ax.set(xlim=here[0] + np.array([-AROUND, AROUND]))
    ax.set(ylim=here[1] + np.array([-AROUND, AROUND]) * (-1 if y_down else 1))
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 2, 5, 10]))
    admissible = f"{int(moment.admissible.sum())} of {moment.admissible.size} candidates admissible"
    ax.set_title(f"{moment.time:.1f} s: {admissible}", fontsize=FONT)
    legend_below(ax)
    _colour_entry(ax.get_legend(), SCORED)
    return ax


def draw_window(moment: Moment, ax: "Axes | None" = None) -> "Axes":
    """The window of eq. 6: every candidate's velocities, coloured by score, grey where inadmissible."""
    ax = ax if ax is not None else new_figure((4.6, 3.2)).subplots()
    speed, turn = np.meshgrid(moment.v, moment.yaw_rate, indexing="ij")
    refused = ~moment.admissible
    ax.scatter(turn[refused], speed[refused], marker="x", s=14, linewidths=0.8, color=REFUSED, label="inadmissible")
    if moment.admissible.any():
        shown = ax.scatter(turn[~refused], speed[~refused], c=moment.score[~refused], cmap=_light_to_dark(), s=20,
                           edgecolor=BLACK, linewidth=0.2)  # fmt: skip
        _draw_bar(shown, ax, "score G, eq. 9 [1]")
    if moment.chosen:
        ax.plot(turn[moment.chosen], speed[moment.chosen], marker="o", markersize=9, markerfacecolor="none",
                markeredgecolor=VERMILLION, markeredgewidth=2.0, linestyle="none", label="chosen")  # fmt: skip
    ax.plot(float(moment.robot.yaw_rate), float(moment.robot.v), marker="+", markersize=10, color=BLACK,
            linestyle="none", label="velocity now")
    ax.invert_xaxis()  # turns to the left on the left
    ax.set_xlabel("yaw rate [rad/s], to the left > 0", fontsize=FONT)
    ax.set_ylabel("speed [m/s]", fontsize=FONT)
    ax.tick_params(labelsize=FONT - 1)
    ax.set_title("window of velocities", fontsize=FONT)
    legend_below(ax)
    return ax


def draw_terms(moment: Moment, ax: "Axes | None" = None) -> "Axes":
    """Bars: the weighted terms of the chosen candidate. Whiskers: from the least to the most of any admissible one."""
    from matplotlib.ticker import MaxNLocator

    ax = ax if ax is not None else new_figure((4.6, 3.0)).subplots()
    place = np.arange(len(moment.terms))
    if moment.chosen:
        ax.barh(place, [values[moment.chosen] for values in moment.terms.values()], height=0.55, color=SKY,
                edgecolor=BLACK, linewidth=0.8, label="chosen candidate")
    if moment.admissible.any():
        within = [values[moment.admissible] for values in moment.terms.values()]
        least, most = (np.array([end(values) for values in within]) for end in (np.min, np.max))
        ax.errorbar((least + most) / 2, place, xerr=(most - least) / 2, fmt="none", ecolor=BLACK, capsize=4,
                    label="all admissible candidates")
        legend_below(ax, columns=2)
    ax.set_yticks(place, list(moment.terms))
    ax.invert_yaxis()
    ax.set_xlim(left=0)
    ax.xaxis.set_major_locator(MaxNLocator(nbins=5))
    ax.set_xlabel("weighted, normalised term [1]; their sum is the score", fontsize=FONT)
    ax.tick_params(labelsize=FONT - 1)
    ax.set_title("terms of eq. 9", fontsize=FONT)
    return ax


def _ends(scenario: Scenario) -> np.ndarray:
    """[2, 2] (x, y) [m]: start and goal."""
    return np.stack([np.asarray(scenario.start)[:2], np.asarray(scenario.goal)])


def _map_with_bar(grid: Grid, points: np.ndarray, ax: "Axes | None", y_down: bool) -> "Axes":
    """The map's axes, with points [N, 2] (x, y) [m]; those made here leave room for a bar of colours beside it."""
    width, height = used_map_size(grid, points)
    ax = ax if ax is not None else new_figure((width + 1.1, height - 0.2)).subplots()
    return draw_used_map(grid, points, ax, y_down)


def _draw_field(grid: Grid, values: np.ndarray, ax: "Axes", label: str,
                ends: tuple[float, float] | None = None) -> None:
    """Values [H, W] over the free cells, none where NaN, with a bar of colours between `ends`, or the values' own."""
    shown = np.ma.masked_where(_occupied(grid) | ~np.isfinite(values), values)
    least, most = ends if ends is not None else (None, None)
    image = ax.imshow(shown, cmap=_light_to_dark(), vmin=least, vmax=most, origin="lower", extent=extent(grid),
                      interpolation="nearest", aspect=ax.get_aspect(), zorder=0.5)
    _draw_bar(image, ax, label)


def _draw_bar(colours: Any, ax: "Axes", label: str) -> None:
    bar = figure_of(ax).colorbar(colours, ax=ax, shrink=0.85, pad=0.02)
    bar.set_label(label, fontsize=FONT)
    bar.ax.tick_params(labelsize=FONT - 1)


def _draw_rectangle(scenario: Scenario, found: Densities, cell: tuple[int, int], ax: "Axes") -> None:
    """Outline of the cells that P of a cell counts, with its value."""
    from matplotlib.patches import Rectangle

    side, origin = float(scenario.grid.resolution), np.asarray(scenario.grid.origin, np.float64)
    goal = np.floor((np.asarray(scenario.goal) - origin) / side)
    low, high = np.minimum(cell[::-1], goal), np.maximum(cell[::-1], goal) + 1
    ratio = found.local[cell] / max(found.overall, 1e-9)
    ax.add_patch(Rectangle(tuple(origin + low * side), *(high - low) * side, facecolor="none", edgecolor=VERMILLION,
                           linewidth=2.0, linestyle="--", zorder=6, label=f"a cell's rectangle: P/Q = {ratio:.2f}"))
    ax.plot(*(origin + (np.array(cell[::-1]) + 0.5) * side)[:, None], marker="s", markersize=6, color=VERMILLION,
            markeredgecolor=BLACK, linestyle="none", zorder=7, label="the cell")


def _draw_signs(grid: Grid, weight: np.ndarray, ax: "Axes") -> None:
    if max(weight.shape) > MOST_SIGNS:
        return
    for sign, name, chosen in (("_", "dense, ω < 1", weight < 1), ("+", "sparse, ω > 1", weight > 1)):
        rows, columns = np.nonzero(chosen & ~_occupied(grid))
        places = (np.stack([columns, rows]) + 0.5) * float(grid.resolution) + np.asarray(grid.origin)[:, None]
        ax.plot(*places, marker=sign, markersize=4, color=BLACK, linestyle="none", zorder=3, label=name)


def _draw_near_squares(scenario: Scenario, moment: Moment, ax: "Axes") -> None:
    """Those in the picture, pale if the robot does not know of them."""
    squares = scenario.squares
    near = np.asarray(squares.valid) & _in_picture(np.asarray(squares.centre), moment)
    for patch, known in zip(draw_squares(replace(squares, valid=near), ax), moment.square_known[: len(near)][near],
                            strict=True):  # fmt: skip
        patch.set_facecolor(ORANGE if known else "white")


def _draw_near_movers(scenario: Scenario, moment: Moment, ax: "Axes") -> None:
    """Those in sight that are or will be in the picture."""
    radius = np.asarray(scenario.movers.radius)
    ways = moment.movers[:, : len(radius)]
    near = _in_picture(ways, moment).any(axis=0)
    draw_movers(ways[0, near], radius[near], ax)
    draw_movers(ways[-1, near], radius[near], ax, "mover at the horizon", facecolor="none", linestyle="--")
    for way in np.swapaxes(ways[:, near], 0, 1):
        ax.plot(*way.T, color=BLACK, linewidth=0.7, linestyle="--", zorder=3.4)


def _in_picture(points: np.ndarray, moment: Moment) -> np.ndarray:
    """[...] bool of points [..., 2]; half a metre beyond, as obstacles have a size."""
    apart = np.abs(points - np.array([moment.robot.x, moment.robot.y]))
    return np.all(apart < AROUND + 0.5, axis=-1)


def _draw_refused(moment: Moment, ax: "Axes") -> None:
    from matplotlib.collections import LineCollection

    lines = np.moveaxis(moment.arcs, 0, 2)[~moment.admissible]
    if len(lines):
        ax.add_collection(LineCollection(list(lines), colors=REFUSED, linewidths=0.6, linestyles="--", zorder=4.5,
                                         label="inadmissible"), autolim=False)  # fmt: skip


def _draw_scored(moment: Moment, ax: "Axes") -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.patheffects import withStroke

    lines, score = np.moveaxis(moment.arcs, 0, 2)[moment.admissible], moment.score[moment.admissible]
    if len(lines):
        rising = np.argsort(score)
        drawn = LineCollection(list(lines[rising]), array=score[rising], cmap=_light_to_dark(), linewidths=1.2,
                               zorder=5, label=SCORED)  # fmt: skip
        ax.add_collection(drawn, autolim=False)
    if moment.chosen:
        rim = [withStroke(linewidth=4.6, foreground="white")]  # or it would be one among many in grey
        ax.plot(*moment.arcs[:, *moment.chosen].T, color=VERMILLION, linewidth=2.6, zorder=6, label="chosen",
                path_effects=rim)


def _colour_entry(legend: Any, label: str) -> None:
    """A line of many colours stands in the legend in the middle one of them."""
    for text, handle in zip(legend.get_texts(), legend.legend_handles, strict=True):
        if text.get_text() == label:
            handle.set_color(_light_to_dark()(0.5))


def _occupied(grid: Grid) -> np.ndarray:
    return np.asarray(grid.occupied)[: int(grid.height), : int(grid.width)]


def _light_to_dark() -> "Colormap":
    """Viridis from its light end, without the darkest part: apart from white and from obstacles."""
    from matplotlib import colormaps
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("light to dark", colormaps["viridis_r"](np.linspace(0.0, 0.55, 64)))
