"""Pictures of maps, scenarios and suites, for eyes that may not tell colours apart and for printing in grey.

Colours are those of Okabe and Ito (2008); every kind of thing also has a shape or line style of its own. A function
that gets no axes makes a figure outside pyplot's list; it shows no window, and nothing is left open after it is saved.
Dimension letters: H, W map; M movers; T times.
"""

from collections.abc import Mapping, Sequence
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax
import numpy as np
from numpy.typing import ArrayLike

from adwa_jax.grid import Grid
from adwa_jax.obstacles import MoverStates, movers_at
from adwa_jax.scenario import Movers, Scenario, UnknownSquares
from scenarios.errors import InputError
from scenarios.suite import Suite

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILLION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"
OCCUPIED = "#4D4D4D"
CELL_LINES = "#DDDDDD"
FONT = 9  # [pt]
MOST_CELL_LINES = 40  # cells a side up to which each cell is outlined
TRACK_STEP = 0.1  # [s] between the points of a mover's track
FASTEST = 20.0  # [m/s]; what covers more between two points of its track was not moved but put there
UNKNOWN_STYLE: dict[str, Any] = {"facecolor": ORANGE, "edgecolor": BLACK, "hatch": "////"}
"""How that is drawn which is not on the robot's map."""


def draw_map(grid: Grid, ax: "Axes | None" = None, y_down: bool = False) -> "Axes":
    """The map without its padding: free cells white, occupied ones dark; x and y in metres, y up unless `y_down`."""
    from matplotlib.colors import ListedColormap
    from matplotlib.ticker import MaxNLocator

    height, width = int(grid.height), int(grid.width)
    left, right, bottom, top = extent(grid)
    if ax is None:
        ax = new_figure(map_size(grid)).subplots()
    ax.imshow(np.asarray(grid.occupied)[:height, :width], cmap=ListedColormap(["#FFFFFF", OCCUPIED]), vmin=0, vmax=1,
              origin="lower", extent=(left, right, bottom, top), interpolation="nearest", zorder=0)
    if max(height, width) <= MOST_CELL_LINES:
        ax.hlines(np.linspace(bottom, top, height + 1), left, right, CELL_LINES, linewidth=0.5, zorder=1)
        ax.vlines(np.linspace(left, right, width + 1), bottom, top, CELL_LINES, linewidth=0.5, zorder=1)
    ax.set(xlim=(left, right), ylim=(top, bottom) if y_down else (bottom, top), aspect="equal")
    ax.set_xlabel("x [m]", fontsize=FONT)
    ax.set_ylabel("y [m]", fontsize=FONT)
    ax.tick_params(labelsize=FONT - 1)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 2, 5, 10]))
    return ax


def draw_scenario(scenario: Scenario, ax: "Axes | None" = None, y_down: bool = False, seconds: float = 10.0,
                  legend: bool = True) -> "Axes":
    """Map, hidden cells, start, goal, unknown squares, and movers at t = 0 with their way over the next `seconds` [s].

    Movers are drawn to scale, as discs; an arrowhead ends each one's way. Unbatched; padding is not drawn.
    """
    ax = draw_map(scenario.grid, ax, y_down)
    draw_hidden(scenario.grid, scenario.hidden, ax)
    draw_ends(scenario.start[:2], scenario.goal, ax)
    draw_squares(scenario.squares, ax)
    ways = mover_ways(scenario.movers, seconds)
    draw_movers(ways[0], np.asarray(scenario.movers.radius), ax)
    draw_mover_ways(ways, ax)
    if legend:
        legend_below(ax)
    return ax


def contact_sheet(suite: Suite | Sequence[Scenario], names: Sequence[str] | None = None, path: Path | None = None,
                  limit: int = 24, y_down: bool = False) -> "Figure":
    """The first `limit` scenarios side by side, each with its name and the size of its map; saved if `path` is given.

    names: one a scenario; those of the suite, or numbers from 0, unless given. y_down: of the maps (`draw_map`).
    Raises InputError where there is nothing to draw.
    """
    scenarios = suite.scenarios if isinstance(suite, Suite) else tuple(suite)
    shown = scenarios[:limit]
    if not shown:
        raise InputError(f"contact sheet: {len(scenarios)} scenarios, limit {limit}; both must be ≥ 1; raise them")
    if names is None:
        names = suite.names if isinstance(suite, Suite) else tuple(map(str, range(len(shown))))
    columns = min(len(shown), 6 if len(shown) > 8 else 4)
    rows = ceil(len(shown) / columns)
    height = max(map_size(scenario.grid, 1.75 + 0.6, 0.0)[1] - 0.5 for scenario in shown)
    figure = new_figure((1.75 * columns + 0.3, height * rows + 0.9))
    tiles = figure.subplots(rows, columns, squeeze=False).ravel()
    for tile, scenario, name in zip(tiles, shown, names, strict=False):
        _draw_tile(scenario, name, tile, y_down)
    for tile in tiles[len(shown) :]:
        tile.set_axis_off()
    heading = suite.name if isinstance(suite, Suite) else "Scenarios"
    figure.suptitle(f"{heading}: {len(shown)} of {len(scenarios)}", fontsize=FONT + 2)
    figure_legend(figure, list(tiles[: len(shown)]))
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


def draw_hidden(grid: Grid, hidden: ArrayLike, ax: "Axes") -> list[Any]:
    """The hidden cells [H, W] (or [0, 0]) as hatched cells, to scale; returns their collection, if there are any."""
    from matplotlib.collections import PolyCollection

    rows, columns = np.nonzero(np.asarray(hidden)[: int(grid.height), : int(grid.width)])
    if not rows.size:
        return []
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    cells = np.stack([columns, rows], axis=1)[:, None, :] + corners
    outlines = np.asarray(grid.origin) + cells * float(grid.resolution)
    drawn = PolyCollection(list(outlines), label="hidden cell", linewidth=0.3, zorder=1.5, **UNKNOWN_STYLE)
    return [ax.add_collection(drawn, autolim=False)]


def draw_squares(squares: UnknownSquares, ax: "Axes") -> list[Any]:
    """The unknown squares and discs, hatched, to scale; returns their patches, in order, padding left out."""
    outlines = zip(*map(np.asarray, (squares.centre, squares.half_width, squares.rounding)), strict=True)
    patches = []
    for (centre, half, rounding), valid in zip(outlines, np.asarray(squares.valid), strict=True):
        if valid:
            patch = _unknown_patch(centre, float(half), float(rounding))
            label = "unknown square" if half > 0 else "unknown disc"
            patch.set(label=_once(label, [drawn for drawn in patches if drawn.get_label() == label]))
            patches.append(ax.add_patch(patch))
    return patches


def _unknown_patch(centre: np.ndarray, half: float, rounding: float) -> Any:
    """A disc, a square, or one with rounded corners."""
    from matplotlib.patches import Circle, FancyBboxPatch, Rectangle

    style = {"linewidth": 0.8, "zorder": 3} | UNKNOWN_STYLE
    if half <= 0:
        return Circle(tuple(centre), rounding, **style)
    corner = tuple(centre - half)
    if rounding <= 0:
        return Rectangle(corner, 2 * half, 2 * half, **style)
    return FancyBboxPatch(corner, 2 * half, 2 * half, boxstyle=f"round,pad={rounding},rounding_size={rounding}",
                          **style)


def draw_movers(position: np.ndarray, radius: np.ndarray, ax: "Axes", label: str = "mover", **style: Any) -> list[Any]:
    """Movers as discs, to scale, where position [M, 2] is a number; returns their patches, in order."""
    from matplotlib.patches import Circle

    style = {"facecolor": SKY, "edgecolor": BLACK, "linewidth": 0.8, "zorder": 3.5} | style
    patches = []
    for centre, size in zip(position, radius, strict=True):
        if np.isfinite(centre).all():
            patch = Circle(tuple(centre), float(size), label=_once(label, patches), **style)
            patches.append(ax.add_patch(patch))
    return patches


def draw_mover_ways(ways: np.ndarray, ax: "Axes", heads: bool = True) -> list[Any]:
    """A line for each mover along ways [T, M, 2], with an arrowhead where it ends if `heads`; returns the lines."""
    lines = []
    for way in np.swapaxes(ways, 0, 1):
        if np.isfinite(way).any():
            lines += ax.plot(way[:, 0], way[:, 1], color=BLUE, linewidth=0.8, alpha=0.7, zorder=2.5,
                             solid_joinstyle="round", label=_once("way of a mover", lines))
            if heads:
                _draw_head(way[np.isfinite(way).all(axis=1)], ax)
    return lines


def draw_ends(start: ArrayLike, goal: ArrayLike, ax: "Axes") -> None:
    """Start and goal, (x, y) [m], below key points and danger points that lie near them; NaN is not drawn."""
    marker = {"linestyle": "none", "markeredgecolor": BLACK, "zorder": 6.3}
    ax.plot(*np.reshape(start, (2, 1)), marker="o", markersize=8, markerfacecolor=GREEN, label="start", **marker)
    ax.plot(*np.reshape(goal, (2, 1)), marker="*", markersize=13, markerfacecolor=VERMILLION, label="goal", **marker)


def mover_ways(movers: Movers, seconds: float) -> np.ndarray:
    """[T, M, 2] float32: where the movers are every `TRACK_STEP` from 0 to `seconds`.

    NaN while one is absent, and right before one is elsewhere at once, as where a track repeats that is not closed.
    """
    times = np.arange(0.0, seconds + TRACK_STEP / 2, TRACK_STEP).astype(np.float32)
    if np.shape(movers.valid) == (0,):
        return np.zeros((len(times), 0, 2), np.float32)
    states = _movers_at_all(movers, jax.device_put(times))
    position, drawn = np.asarray(states.position), np.asarray(states.present).copy()
    drawn[:-1] &= np.linalg.norm(np.diff(position, axis=0), axis=2) < FASTEST * TRACK_STEP
    return np.where(drawn[..., None], position, np.float32(np.nan))


def extent(grid: Grid) -> tuple[float, float, float, float]:
    """Left, right, bottom and top [m] of the map without its padding."""
    x, y = np.asarray(grid.origin, np.float64)
    side = float(grid.resolution)
    return float(x), float(x + int(grid.width) * side), float(y), float(y + int(grid.height) * side)


def map_size(grid: Grid, width: float = 5.0, legend: float = 1.0) -> tuple[float, float]:
    """Inches of a figure for one map with its labels, `width` wide, and a legend of that height."""
    shape = float(np.clip(int(grid.height) / int(grid.width), 0.3, 2.0))
    return width, (width - 0.6) * shape + 0.8 + legend


def new_figure(size: tuple[float, float]) -> "Figure":
    """A figure of `size` inches that pyplot does not know of."""
    from matplotlib.figure import Figure

    return Figure(figsize=size, layout="constrained")


def figure_of(ax: "Axes") -> "Figure":
    """The figure that holds the axes."""
    return ax.get_figure(root=True)  # pyright: ignore[reportReturnType]


def legend_below(ax: "Axes", columns: int = 3, kinds: Mapping[str, Any] | None = None) -> None:
    """A legend under the x axis, where it hides nothing. kinds: by label what stands in it, if not what `ax` shows."""
    from matplotlib.transforms import ScaledTranslation

    below_labels = ax.transAxes + ScaledTranslation(0.0, -0.42, figure_of(ax).dpi_scale_trans)
    shown = legend_kinds([ax]) if kinds is None else kinds
    ax.legend(list(shown.values()), list(shown), loc="upper center", bbox_to_anchor=(0.5, 0.0),
              bbox_transform=below_labels, borderaxespad=0.0, ncols=columns, fontsize=FONT - 1, frameon=False,
              handler_map=_handlers())


def figure_legend(figure: "Figure", axes: Sequence["Axes"]) -> None:
    """One legend under all axes, each kind of thing once."""
    kinds = legend_kinds(axes)
    rows = max(1, ceil(len(kinds) / (figure.get_figwidth() / 1.5)))
    columns = max(1, ceil(len(kinds) / rows))
    figure.legend(list(kinds.values()), list(kinds), loc="outside lower center", ncols=columns, fontsize=FONT - 1,
                  frameon=False, handler_map=_handlers())


def legend_kinds(axes: Sequence["Axes"]) -> dict[str, Any]:
    """What the axes show, by label, each kind of thing once."""
    kinds: dict[str, Any] = {}
    for ax in axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            kinds.setdefault(label, handle)
    return kinds


@jax.jit
def _movers_at_all(movers: Movers, times: jax.Array) -> MoverStates:
    return jax.vmap(movers_at, in_axes=(None, 0))(movers, times)


def _draw_tile(scenario: Scenario, name: str, ax: "Axes", y_down: bool) -> None:
    draw_scenario(scenario, ax, y_down, legend=False)
    left, right, bottom, top = extent(scenario.grid)
    ax.set(xticks=[], yticks=[], xlabel="", ylabel="")
    ax.set_title(f"{name}\n{right - left:.3g} m × {top - bottom:.3g} m", fontsize=FONT - 2)
    for line in ax.lines:  # drawn for a page, shown on a stamp
        line.set(markersize=line.get_markersize() * 0.6, markeredgewidth=0.5)
    for cell_lines in ax.collections:
        cell_lines.set_linewidth(0.2)
    for patch in ax.patches:
        patch.set_linewidth(0.5)


def _draw_head(way: np.ndarray, ax: "Axes") -> None:
    """An arrowhead at the end of a way [T, 2] of numbers, if it moves there."""
    back = way[-1] - way[max(len(way) - 4, 0)]
    if np.hypot(*back) < 1e-3:
        return
    up = -1.0 if ax.yaxis_inverted() else 1.0
    angle = np.degrees(np.arctan2(up * back[1], back[0])) - 90.0
    ax.plot(*way[-1:].T, marker=(3, 0, angle), markersize=5, color=BLUE, linestyle="none", zorder=2.6)


def _once(label: str, drawn: Sequence[Any]) -> str:
    """The label for the first of a kind; matplotlib's word for "not in the legend" for the others."""
    return "_" if drawn else label


def _handlers() -> dict[Any, Any]:
    """Discs as discs in the legend; by default every patch is a rectangle."""
    from matplotlib.legend_handler import HandlerPatch
    from matplotlib.patches import Circle, Rectangle

    def disc(legend, orig_handle, xdescent, ydescent, width, height, fontsize):
        return Circle((width / 2, height / 2), height / 2)

    def square(legend, orig_handle, xdescent, ydescent, width, height, fontsize):
        return Rectangle((width / 2 - height / 2, 0), height, height)

    return {Circle: HandlerPatch(patch_func=disc), Rectangle: HandlerPatch(patch_func=square)}
