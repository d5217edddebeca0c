"""How a drive ended: its last seconds around the robot, robot and movers in the same colour at the same time.

Dimension letters: T points of time; M movers.
"""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from adwa_jax.episode import Outcome
from adwa_jax.scenario import Scenario
from scenarios.drawing import BLACK, BLUE, FONT, OCCUPIED, draw_ends, draw_movers
from tuning.figures import (
    disc_centres,
    draw_hidden_cells,
    draw_last_route,
    draw_outline,
    draw_polyline,
    draw_sensed_squares,
    draw_used_map,
    drive_points,
    driven_path,
    driven_ways,
    last_heading,
)
from tuning.replay import Replay

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROOM = 1.5  # [m] shown around the driven path
LEAST_HALF = 2.0  # [m] half the side of what is shown, at least
LEAST_WAY = 0.4  # [m] driven that is shown, at least
ARROW = 1.0  # [s] of motion that an arrow stands for
COLOURS = "cividis"  # equal steps in lightness: also for the colour-blind, and in grey


def draw_last_seconds(driven: Replay, ax: "Axes", seconds: float = 4.0, title: str = "", y_down: bool = False) -> Any:
    """Map, sensed and unsensed obstacles, planned path and last route; what was driven in the last `seconds`, movers
    with their trails and an arrow for the way of the next second, the robot and its local target at the end. Where it
    stood for long, the robot's path begins `LEAST_WAY` before the end, however long ago.

    Dots mark whole seconds. Returns what a colour bar of the time [s] needs, None for a robot that never drove: then
    all of the map that is in use is shown.
    """
    scenario, trace, steps = driven.scenario, driven.trace, int(driven.trace.length)
    draw_used_map(scenario.grid, drive_points(scenario, driven.plan, trace), ax, y_down)
    ax.set_facecolor(OCCUPIED)  # beyond the map
    first = max(steps - round(seconds / step_of(driven)), 0) if steps else 0
    whole = driven_path(scenario, trace)
    begins = min(first, _begins(whole))
    path = whole[begins:]
    if steps:
        _crop(path, ax, y_down)
        scenario = _squares_in_view(scenario, ax)
    draw_hidden_cells(scenario, trace, ax)
    draw_sensed_squares(scenario, np.asarray(trace.known)[steps - 1] if steps else None, ax)
    draw_ends(scenario.start[:2], scenario.goal, ax)
    if int(driven.plan.key_point_count):
        draw_polyline(np.asarray(driven.plan.key_points)[: int(driven.plan.key_point_count)], ax, "--", "planned path")
    draw_last_route(driven.episode, trace, ax)
    ax.set_title(title, fontsize=FONT - 1)
    ax.set(xlabel="", ylabel="")
    if not steps:
        return None
    times = (np.arange(begins, steps + 1) - steps) * step_of(driven)
    shades = {"cmap": COLOURS, "vmin": -seconds, "vmax": 0.0}
    _draw_movers(driven, first, times[first - begins :], ax, shades)
    shaded = _draw_trail(path, times, ax, shades, width=3.0)
    shaded.set_label("driven path")
    _draw_robot(driven, path[-1], ax)
    _list_what_is_in_view(ax)
    return shaded


def step_of(driven: Replay) -> float:
    """Control step [s] of a robot that drove."""
    return float(driven.episode.measures.time) / int(driven.trace.length)


def _begins(path: np.ndarray) -> int:
    """Where the last `LEAST_WAY` of a path [T + 1, 2] begin."""
    left = np.cumsum(np.hypot(*np.diff(path, axis=0).T)[::-1])
    return max(len(path) - 2 - int(np.searchsorted(left, LEAST_WAY)), 0)


def _draw_robot(driven: Replay, position: np.ndarray, ax: "Axes") -> None:
    """Its discs and nose, the local target, and a cross where it was in contact."""
    robot, heading = driven.robot, last_heading(driven.scenario, driven.trace)
    radius = float(robot.radius)
    draw_outline(disc_centres(position, heading, robot.disc_offsets), radius, ax, linewidth=1.6)
    reach = max(map(float, robot.disc_offsets)) + radius
    nose = position + reach * np.array([np.cos(heading), np.sin(heading)])
    ax.plot(*np.stack([position, nose]).T, color=BLACK, linewidth=1.2, zorder=9)
    target = np.asarray(driven.trace.target)[int(driven.trace.length) - 1]
    ax.plot(*target[:, None], linestyle="none", marker="o", markersize=9, markerfacecolor="none",
            markeredgecolor=BLACK, zorder=7, label="local target")
    if driven.outcome in (Outcome.HIT_KNOWN, Outcome.HIT_UNKNOWN, Outcome.HIT_MOVER):
        ax.plot(*position[:, None], linestyle="none", marker="x", markersize=8, color=BLACK, markeredgewidth=2.0,
                zorder=9.5, label="collision")


def _draw_movers(driven: Replay, first: int, times: np.ndarray, ax: "Axes", shades: dict[str, Any]) -> None:
    """Where they are at the end, the way that led there, and where they were going."""
    ways = driven_ways(driven.scenario, driven.trace)[first:]
    radius = np.asarray(driven.scenario.movers.radius)
    seen = _in_view(ways[-1], radius, ax)
    draw_movers(ways[-1, seen], radius[seen], ax, "mover, end", alpha=0.7)
    for way in np.swapaxes(ways, 0, 1):
        _draw_trail(way, times, ax, shades, width=1.5)
    velocity = np.asarray(driven.trace.movers.velocity)[int(driven.trace.length) - 1, : ways.shape[1]]
    going = np.isfinite(ways[-1]).all(axis=1) & (np.hypot(*velocity.T) > 1e-3)
    if going.any():
        ax.quiver(*ways[-1][going].T, *(ARROW * velocity[going]).T, angles="xy", scale_units="xy", scale=1.0,
                  color=BLUE, width=0.008, zorder=4.5)
        if (going & seen).any():
            ax.plot([], [], color=BLUE, linewidth=1.0, marker=">", markersize=4, label="mover, next second")


def _draw_trail(way: np.ndarray, times: np.ndarray, ax: "Axes", shades: dict[str, Any], width: float) -> Any:
    """A line along a way [T, 2] in the colour of its times [T], a dot at every whole second; NaN is not drawn."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import Normalize

    norm = Normalize(shades["vmin"], shades["vmax"])
    segments = np.stack([way[:-1], way[1:]], axis=1)
    shown = np.isfinite(segments).all(axis=(1, 2))
    line = LineCollection(list(segments[shown]), array=times[1:][shown], cmap=shades["cmap"], norm=norm,
                          linewidth=width, zorder=6, capstyle="round")
    line.update_scalarmappable()  # for the legend, which is made before anything is drawn
    ax.add_collection(line, autolim=False)
    whole = np.abs(times - np.rint(times)) < 0.5 * (times[1] - times[0]) - 1e-6
    ax.scatter(*way[whole].T, c=times[whole], s=6.0 * width, edgecolors=BLACK, linewidths=0.5, zorder=6.2, **shades)
    return line


def _crop(path: np.ndarray, ax: "Axes", y_down: bool) -> None:
    """Show a square that holds the path [T, 2] with room around it."""
    low, high = path.min(axis=0), path.max(axis=0)
    middle, half = (low + high) / 2, max(float((high - low).max()) / 2 + ROOM, LEAST_HALF)
    ax.set_xlim(middle[0] - half, middle[0] + half)
    ends = (middle[1] - half, middle[1] + half)
    ax.set_ylim(*(ends[::-1] if y_down else ends))


def _in_view(centre: np.ndarray, half: np.ndarray, ax: "Axes") -> np.ndarray:
    """[N] bool: which of things about centres [N, 2], of half sizes [N] [m], reach into the view."""
    low, high = np.sort([ax.get_xlim(), ax.get_ylim()], axis=1).T
    return np.all((centre + half[:, None] > low) & (centre - half[:, None] < high), axis=1)


def _squares_in_view(scenario: Scenario, ax: "Axes") -> Scenario:
    """The scenario with those unknown squares only."""
    squares = scenario.squares
    half = np.asarray(squares.half_width) + np.asarray(squares.rounding)
    seen = np.asarray(squares.valid) & _in_view(np.asarray(squares.centre), half, ax)
    return replace(scenario, squares=replace(squares, valid=seen))  # pyright: ignore[reportArgumentType]


def _list_what_is_in_view(ax: "Axes") -> None:
    """Lines, marks and cells beyond the view are not in the legend."""
    from matplotlib.transforms import Bbox

    low, high = np.sort([ax.get_xlim(), ax.get_ylim()], axis=1).T
    view = Bbox([low, high])
    for line in ax.lines:
        points = np.asarray(line.get_xydata())
        marks = line.get_linestyle() in ("None", "none")
        if len(points) and not (((points > low) & (points < high)).all(axis=1).any() if marks else
                                len(points) > 1 and line.get_path().intersects_bbox(view, filled=False)):  # fmt: skip
            line.set_label("_")
    for drawn in ax.collections:
        paths = drawn.get_paths()
        if not str(drawn.get_label()).startswith("_") and not any(path.intersects_bbox(view) for path in paths):
            drawn.set_label("_")
