"""The paper's figures and what goes with them: plans, drives, an animation, success rates.

Results in, matplotlib figures out; nothing is computed here that a kernel computes. Conventions: `scenarios.drawing`.
Dimension letters: P path cells; Q key points; T control steps; M movers; D discs of the robot.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.astar import Status
from adwa_jax.episode import Episode, Outcome
from adwa_jax.grid import Grid, Scalar
from adwa_jax.keypoints import KeyPoints, turning_points
from adwa_jax.lanes import Trace
from adwa_jax.metrics import danger_corners, danger_steps
from adwa_jax.plan import Plan
from adwa_jax.scenario import Scenario
from adwa_jax.window import RobotLimits
from scenarios.drawing import (
    BLACK,
    BLUE,
    FONT,
    GREEN,
    OCCUPIED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    draw_ends,
    draw_hidden,
    draw_map,
    draw_mover_ways,
    draw_movers,
    draw_squares,
    extent,
    figure_legend,
    figure_of,
    legend_below,
    legend_kinds,
    map_size,
    mover_ways,
    new_figure,
)
from scenarios.errors import InputError
from scenarios.padding import ladder_size
from tuning.intervals import wilson
from tuning.planning import PlannedPath

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tuning.replay import Replay
    from tuning.results import Results

Panels: TypeAlias = "Axes | Sequence[Axes] | np.ndarray"
Route = Literal["path", "key points"]
PAPER_SUCCESS = 0.956  # §3.4
SENTENCES = {
    Outcome.REACHED: "reached the goal",
    Outcome.HIT_KNOWN: "hit a known obstacle",
    Outcome.HIT_UNKNOWN: "hit an unknown square",
    Outcome.HIT_MOVER: "hit a mover",
    Outcome.STUCK: "got stuck",
    Outcome.TIMEOUT: "ran out of time",
    Outcome.NO_PATH: "found no path",
}
PLANNERS = {"improved": "Improved A*", "traditional": "Traditional A*", "dijkstra": "Dijkstra"}
_danger_steps, _danger_corners, _turning_points = map(jax.jit, (danger_steps, danger_corners, turning_points))
OUTCOME_STYLES = {
    Outcome.REACHED: (GREEN, ""),
    Outcome.HIT_KNOWN: (OCCUPIED, ""),
    Outcome.HIT_UNKNOWN: (ORANGE, "////"),
    Outcome.HIT_MOVER: (SKY, "...."),
    Outcome.STUCK: ("#E6E6E6", "xxxx"),
    Outcome.TIMEOUT: ("#FFFFFF", "----"),
    Outcome.NO_PATH: (PURPLE, "++++"),
}
MARGIN = 4  # cells shown around the part of a map that holds anything but obstacles
COLLISIONS = (Outcome.HIT_KNOWN, Outcome.HIT_UNKNOWN, Outcome.HIT_MOVER)


class Comparison(NamedTuple):
    """Two plans on one map."""

    name: str
    grid: Grid
    traditional: Plan | PlannedPath
    improved: Plan | PlannedPath


def plan_figure(grid: Grid, plan: Plan | PlannedPath, planner: str = "A*", y_down: bool = False,
                ax: "Axes | None" = None) -> "Figure":
    """One plan: grid path, turning points and danger points, and its key-point polyline. Unbatched.

    planner: named in the title, with length, breaking points and danger points of both.
    """
    planned = planned_path(grid, plan)
    ax = draw_used_map(grid, _points(planned), ax, y_down)
    draw_ends(planned.start, planned.goal, ax)
    _draw_route(grid, planned, "path", ax)
    if len(planned.key_points):
        draw_polyline(planned.key_points, ax, linestyle="--")
    names = {"path": "path: ", "key points": "key points: "} if len(planned.path) else {"path": ""}
    lines = [prefix + route_sentence(planned, route) for route, prefix in names.items()]  # pyright: ignore
    ax.set_title("\n".join([PLANNERS.get(planner, planner), *lines]), fontsize=FONT)
    legend_below(ax)
    return figure_of(ax)


def compare_plans(comparisons: Sequence[Comparison], axes: "Panels | None" = None, y_down: bool = False) -> "Figure":
    """Fig. 3: the traditional A*'s grid path and the improved A*'s key points, each with its danger points ringed.

    One map: side by side; several: a column each, the traditional above the improved. axes: an array of such a shape.
    """
    several = len(comparisons) > 1
    shape = (2, len(comparisons)) if several else (1, 2)
    alone = axes is None
    if axes is None:
        height = max(used_map_size(grid, _points(planned_path(grid, plan)), 3.6, 0.15)[1]
                     for _, grid, *plans in comparisons for plan in plans)  # fmt: skip
        axes = new_figure((3.6 * shape[1], height * shape[0] + 0.4)).subplots(*shape, squeeze=False)
    panels = panels_of(axes, 2 * len(comparisons))
    placed = np.reshape(np.array(panels, object), shape)
    pairs = placed.T if several else placed
    for comparison, (above, below) in zip(comparisons, pairs, strict=True):
        name = f"{comparison.name}, " if comparison.name else ""
        _draw_panel(comparison.grid, comparison.traditional, "path", f"{name}traditional A*", above, y_down)
        _draw_panel(comparison.grid, comparison.improved, "key points", f"{name}improved A*", below, y_down)
    legend_of(panels, alone)
    return figure_of(panels[0])


def drive_figure(scenario: Scenario, plan: Plan, episode: Episode, trace: Trace, title: str = "",
                 ax: "Axes | None" = None, y_down: bool = False, legend: bool = True,
                 robot: RobotLimits | None = None) -> "Figure":
    """Fig. 4: planned polyline dashed, driven path solid, key points, unknown squares, movers and the ways they took.

    Movers are filled where they were when the episode ended and pale where they began; squares and hidden cells the
    robot never sensed are pale too. The last route is drawn where it is not the first. A collision is crossed.
    Unbatched; the plan and trace may be padded. title: put before the outcome. robot: its outline at the end is drawn
    to scale.
    """
    ax = draw_used_map(scenario.grid, drive_points(scenario, plan, trace), ax, y_down)
    steps = int(trace.length)
    draw_hidden_cells(scenario, trace, ax)
    ways = driven_ways(scenario, trace)
    radius = np.asarray(scenario.movers.radius)
    draw_ends(scenario.start[:2], scenario.goal, ax)
    draw_sensed_squares(scenario, np.asarray(trace.known)[steps - 1] if steps else None, ax)
    pale = {"alpha": 0.35, "linestyle": ":", "zorder": 3.2}
    draw_movers(ways[0], radius, ax, "mover, start", **pale)
    draw_movers(ways[-1], radius, ax, "mover, end")
    draw_mover_ways(ways, ax, heads=False)
    if int(plan.key_point_count):
        draw_polyline(np.asarray(plan.key_points)[: int(plan.key_point_count)], ax, "--", "planned path")
    draw_last_route(episode, trace, ax)
    path = driven_path(scenario, trace)
    ax.plot(*path.T, color=VERMILLION, linewidth=2.0, zorder=6, label="driven path", solid_joinstyle="round")
    if robot is not None:
        discs = disc_centres(path[-1], last_heading(scenario, trace), robot.disc_offsets)
        draw_outline(discs, float(robot.radius), ax)
    _draw_last(path[-1], Outcome(int(episode.outcome)), ax)
    ax.set_title(f"{prefixed(title)}{drive_sentence(plan, episode)}", fontsize=FONT)
    if legend:
        legend_below(ax)
    return figure_of(ax)


def compare_drives(drives: Mapping[str, "Replay"], y_down: bool = False, axes: "Panels | None" = None) -> "Figure":
    """Fig. 4: drives side by side, each as `drive_figure` has it under its name, with one legend. axes: one a drive."""
    alone = axes is None
    if axes is None:
        height = max(used_map_size(driven.scenario.grid, drive_points(driven.scenario, driven.plan, driven.trace), 4.6,
                                   0.6)[1] for driven in drives.values())  # fmt: skip
        axes = new_figure((4.6 * len(drives), height)).subplots(1, len(drives), squeeze=False)
    panels = panels_of(axes, len(drives))
    for (name, driven), ax in zip(drives.items(), panels, strict=True):
        drive_figure(driven.scenario, driven.plan, driven.episode, driven.trace, title=name, ax=ax, y_down=y_down,
                     legend=False)
    legend_of(panels, alone)
    return figure_of(panels[0])


def outcome_figure(results: Mapping[str, "Results"], ax: "Axes | None" = None) -> "Figure":
    """How the scenarios ended, a bar a planner; its success with the 95 % Wilson interval stands behind its name."""
    alone = ax is None
    ax = new_figure((8.2, 0.5 * len(results) + 1.5)).subplots() if ax is None else ax
    left = np.zeros(len(results))
    for outcome, (colour, hatch) in OUTCOME_STYLES.items():
        share = np.array([100 * np.mean(found.outcome == outcome) for found in results.values()])
        if share.any():
            ax.barh(np.arange(len(results)), share, left=left, height=0.65, color=colour, hatch=hatch, edgecolor=BLACK,
                    linewidth=0.6, label=SENTENCES[outcome])
        left = left + share
    ax.set_yticks(range(len(results)), [_rated(name, found) for name, found in results.items()])
    ax.invert_yaxis()
    ax.set(xlim=(0, 100))
    ax.set_xlabel("scenarios [%]", fontsize=FONT)
    ax.tick_params(labelsize=FONT - 1)
    legend_of([ax], alone)
    return figure_of(ax)


def success_figure(rates: Mapping[str, tuple[int, int]], paper: float | None = PAPER_SUCCESS,
                   ax: "Axes | None" = None) -> "Figure":
    """Bars of success rates with their 95 % Wilson intervals; the paper's rate is a dashed line.

    rates: name -> (successes, scenarios).
    """
    alone = ax is None
    ax = new_figure((1.1 * len(rates) + 1.9, 3.2)).subplots() if ax is None else ax
    place = np.arange(len(rates))
    share = np.array([successes / max(count, 1) for successes, count in rates.values()])
    low, high = np.array([wilson(successes, count) for successes, count in rates.values()]).T
    ax.bar(place, 100 * share, width=0.6, color=SKY, edgecolor=BLACK, linewidth=0.8, zorder=2)
    spread = np.maximum(np.array([share - low, high - share]), 0.0)  # rounding may leave −0
    ax.errorbar(place, 100 * share, 100 * spread, fmt="none", ecolor=BLACK, capsize=4, zorder=3)
    if paper is not None:
        ax.axhline(100 * paper, color=VERMILLION, linestyle="--", linewidth=1.5, zorder=1,
                   label=f"paper: {100 * paper:.1f} % in “the test scenario”")
    counts = [f"{name}\n{100 * part:.1f} %\n{successes} of {count}"
              for (name, (successes, count)), part in zip(rates.items(), share, strict=True)]  # fmt: skip
    ax.set_xticks(place, counts)
    ax.set(ylim=(0, 104), xlim=(-0.6, len(rates) - 0.4))
    ax.set_ylabel("success rate [%], 95 % interval", fontsize=FONT)
    ax.tick_params(labelsize=FONT - 1)
    if paper is not None:
        legend_of([ax], alone)
    return figure_of(ax)


def planned_path(grid: Grid, plan: Plan | PlannedPath) -> PlannedPath:
    """What is drawn of a plan; a `PlannedPath` passes unchanged. Points [m] in the grid's frame."""
    if isinstance(plan, PlannedPath):
        return plan
    cells = np.asarray(plan.search.path)[: int(plan.search.path_cells)]
    path = (cells[:, ::-1] + 0.5) * float(grid.resolution) + np.asarray(grid.origin)
    ends = [tuple(path[end].tolist()) if len(path) else (np.nan, np.nan) for end in (0, -1)]
    return PlannedPath(
        start=ends[0],
        goal=ends[1],
        status=Status(int(plan.search.status)),
        length=float(plan.length),
        expansions=int(plan.search.expansions),
        measures={name: int(value) for name, value in plan.measures._asdict().items()},
        path=path.astype(np.float32),
        key_points=np.asarray(plan.key_points)[: int(plan.key_point_count)],
        key_point_length=float(plan.key_point_length),
    )


def danger_points(grid: Grid, planned: PlannedPath, route: Route) -> np.ndarray:
    """[D, 2] (x, y) [m]: where the route passes too close to obstacles; as many as its measure of danger points.

    `path`: the corners at which diagonal steps pass an occupied cell. `key points`: the corners of occupied cells
    nearer than a tenth of a cell to the polyline.
    """
    points = planned.path if route == "path" else planned.key_points
    if len(points) < 2:
        return np.zeros((0, 2), np.float32)
    cells, count = _padded_cells(grid, points)
    if route == "path":
        passed = np.asarray(_danger_steps(grid, cells, count))[: len(points) - 1]
        return ((points[:-1] + points[1:]) / 2)[passed]
    corners = np.argwhere(np.asarray(_danger_corners(grid, KeyPoints(cells, count))))
    return corners[:, ::-1] * float(grid.resolution) + np.asarray(grid.origin)


def driven_path(scenario: Scenario, trace: Trace) -> np.ndarray:
    """[T + 1, 2] (x, y) [m]: the start, then where the robot was after each control step."""
    steps = int(trace.length)
    driven = np.stack([np.asarray(trace.robot.x)[:steps], np.asarray(trace.robot.y)[:steps]], axis=-1)
    return np.concatenate([np.asarray(scenario.start)[None, :2], driven])


def driven_ways(scenario: Scenario, trace: Trace) -> np.ndarray:
    """[T + 1, M, 2] (x, y) [m]: where the movers were at the start and after each step; NaN while absent."""
    steps, movers = int(trace.length), len(np.asarray(scenario.movers.valid))
    position = np.asarray(trace.movers.position)[:steps, :movers]
    present = np.asarray(trace.movers.present)[:steps, :movers]
    later = np.where(present[..., None], position, np.float32(np.nan))
    return np.concatenate([mover_ways(scenario.movers, 0.0)[:1], later])


def last_heading(scenario: Scenario, trace: Trace) -> float:
    """Where the robot faced when the episode ended [rad]; a robot that never drove: as the task says."""
    steps = int(trace.length)
    return float(np.asarray(trace.robot.heading)[steps - 1] if steps else np.asarray(scenario.start)[2])


def disc_centres(position: np.ndarray, heading: float, offsets: Sequence[Scalar]) -> np.ndarray:
    """[D, 2] (x, y) [m]: the centres of a robot's discs, so far ahead [m] of its position [2], heading in [rad]."""
    return position + np.array(offsets, np.float64)[:, None] * np.array([np.cos(heading), np.sin(heading)])


def route_sentence(planned: PlannedPath, route: Route) -> str:
    """Length, breaking points and danger points, or why there is no path."""
    if planned.status != Status.FOUND:
        return f"no path: {planned.status.name}"
    prefix = "" if route == "path" else "key_point_"
    length = planned.length if route == "path" else planned.key_point_length
    breaking, danger = (planned.measures[f"{prefix}{kind}_points"] for kind in ("breaking", "danger"))
    return f"{length:.2f} m, {breaking} breaking and {danger} danger points"


def drive_sentence(plan: Plan, episode: Episode) -> str:
    """How a drive ended, and in a second line what it took."""
    outcome, measures = Outcome(int(episode.outcome)), episode.measures
    ending = "a mover ran into the standing robot" if bool(episode.hit_while_stopped) else SENTENCES[outcome]
    if outcome == Outcome.NO_PATH:
        return ending
    return (f"{ending} after {float(measures.time):.1f} s\n{float(measures.length):.2f} m driven, "
            f"{float(plan.key_point_length):.2f} m planned, least clearance {float(measures.least_clearance):.2f} m")


def draw_used_map(grid: Grid, points: np.ndarray, ax: "Axes | None" = None, y_down: bool = False) -> "Axes":
    """`draw_map`, cropped to `used_part`."""
    if ax is None:
        ax = new_figure(used_map_size(grid, points)).subplots()
    draw_map(grid, ax, y_down)
    left, right, bottom, top = used_part(grid, points)
    ax.set(xlim=(left, right), ylim=(top, bottom) if y_down else (bottom, top))
    return ax


def used_map_size(grid: Grid, points: np.ndarray, width: float = 5.0, legend: float = 1.0) -> tuple[float, float]:
    """`map_size` of `used_part`."""
    left, right, bottom, top = used_part(grid, points)
    rows, columns = (round((end - start) / float(grid.resolution)) for start, end in ((bottom, top), (left, right)))
    return map_size(replace(grid, height=jnp.int32(rows), width=jnp.int32(columns)), width, legend)


def used_part(grid: Grid, points: np.ndarray) -> tuple[float, float, float, float]:
    """Left, right, bottom, top [m] of all free cells and of points [N, 2] (x, y) [m], with `MARGIN` cells around.

    No more than the map, beyond which only points lie. Without it, wide unknown margins would be most of a picture.
    """
    left, right, bottom, top = extent(grid)
    side, origin = float(grid.resolution), np.array([left, bottom])
    cells = np.argwhere(~np.asarray(grid.occupied)[: int(grid.height), : int(grid.width)])[:, ::-1]
    finite = points[np.isfinite(points).all(axis=1)]
    corners = np.concatenate([cells, cells + 1, (finite - origin) / side])
    if not len(corners):
        return left, right, bottom, top
    low, high = np.floor(corners.min(axis=0)) - MARGIN, np.ceil(corners.max(axis=0)) + MARGIN
    low, high = np.maximum(low, 0), np.minimum(high, (int(grid.width), int(grid.height)))
    left, bottom = np.minimum(origin + low * side, finite.min(axis=0, initial=np.inf)).tolist()
    right, top = np.maximum(origin + high * side, finite.max(axis=0, initial=-np.inf)).tolist()
    return left, right, bottom, top


def drive_points(scenario: Scenario, plan: Plan, trace: Trace) -> np.ndarray:
    """[N, 2] (x, y) [m]: start, goal, key points, driven path and last route."""
    return np.concatenate([
        np.asarray(scenario.goal)[None],
        np.asarray(plan.key_points)[: int(plan.key_point_count)],
        driven_path(scenario, trace),
        np.asarray(trace.route.points)[: int(trace.route.count)],
    ])  # fmt: skip


def draw_polyline(key_points: np.ndarray, ax: "Axes", linestyle: str, label: str = "key-point path") -> None:
    """The key-point polyline [Q, 2], a diamond at each key point between its ends."""
    ax.plot(*key_points.T, color=BLACK, linewidth=1.6, linestyle=linestyle, zorder=5, label=label)
    between = key_points[1:-1]
    ax.plot(*between.T, linestyle="none", marker="D", markersize=4.5, color=BLACK, zorder=6.5,
            label="key point" if len(between) else "_")


def draw_last_route(episode: Episode, trace: Trace, ax: "Axes") -> list[Any]:
    """The route that was followed last, if it is another than the planned path; returns its line."""
    if not int(episode.replans):
        return []
    route = np.asarray(trace.route.points)[: int(trace.route.count)]
    return ax.plot(*route.T, color=PURPLE, linewidth=1.2, linestyle="-.", zorder=5.5, label="last route")


def draw_hidden_cells(scenario: Scenario, trace: Trace, ax: "Axes") -> list[Any]:
    """The hidden cells, pale where the robot never saw them; returns their collections."""
    hidden, seen = np.asarray(scenario.hidden), np.asarray(trace.seen)
    if not hidden.size:
        return []
    rows, columns = hidden.shape
    found = hidden & seen[:rows, :columns]
    unseen = draw_hidden(scenario.grid, hidden & ~found, ax)
    for drawn in unseen:
        drawn.set(facecolor="white", label="hidden cell never seen")
    return draw_hidden(scenario.grid, found, ax) + unseen


def draw_sensed_squares(scenario: Scenario, known: np.ndarray | None, ax: "Axes") -> list[Any]:
    """The unknown squares, pale where `known` [S] is False; None: all pale. Returns their patches."""
    valid = np.asarray(scenario.squares.valid)
    patches = draw_squares(scenario.squares, ax)
    sensed = np.zeros(len(patches), bool) if known is None else known[: len(valid)][valid]
    for patch, seen in zip(patches, sensed, strict=True):
        patch.set_facecolor(ORANGE if seen else "white")
    for seen, label in ((True, "unknown square"), (False, "square never sensed")):
        kind = [patch for patch, value in zip(patches, sensed, strict=True) if value == seen]
        for index, patch in enumerate(kind):
            patch.set_label("_" if index else label)
    return patches


def draw_outline(discs: np.ndarray, radius: float, ax: "Axes", label: str = "robot, end", **style: Any) -> list[Any]:
    """The robot to scale: its discs [D, 2] of a radius [m]; returns their patches."""
    from matplotlib.patches import Circle

    style = {"facecolor": "none", "edgecolor": VERMILLION, "linewidth": 1.2, "zorder": 8.5} | style
    return [ax.add_patch(Circle((x, y), radius, label="_" if index else label, **style))
            for index, (x, y) in enumerate(discs)]  # fmt: skip


def panels_of(axes: "Panels", count: int) -> list["Axes"]:
    """The axes of a figure of several panels, given as a list or an array. InputError where they are not as many."""
    panels = np.ravel(np.array(axes, object)).tolist()
    if len(panels) != count:
        raise InputError(f"axes: {len(panels)}; this figure has {count} panels; give as many, or none")
    return panels


def legend_of(axes: Sequence["Axes"], alone: bool) -> None:
    """One of all axes: under the figure where they stand `alone` in it, else under the last of them."""
    if alone:
        figure_legend(figure_of(axes[0]), axes)
    else:
        _legend_under(axes[-1], axes)


def prefixed(title: str) -> str:
    """The title, if there is one, before what follows it."""
    return f"{title}: " if title else ""


def _legend_under(ax: "Axes", axes: Sequence["Axes"]) -> None:
    """Of all axes, each kind of thing once, below the x axis's labels in as many columns as fit; none of no kinds."""
    from matplotlib.transforms import ScaledTranslation

    kinds = legend_kinds(axes)
    if not kinds:
        return
    figure = figure_of(ax)
    inches = figure.get_figwidth() * ax.get_position().width
    columns = max(1, min(len(kinds), int(inches / (0.065 * max(map(len, kinds)) + 0.5))))
    labels = ax.xaxis.get_tightbbox()
    down = (ax.bbox.y0 - labels.y0) / figure.dpi if labels else 0.0
    below = ax.transAxes + ScaledTranslation(0.0, -down - 0.06, figure.dpi_scale_trans)
    legend_below(ax, columns, kinds)
    ax.get_legend().set_bbox_to_anchor((0.5, 0.0), below)  # pyright: ignore[reportOptionalMemberAccess]


def _rated(name: str, results: "Results") -> str:
    reached, count = int(results.reached.sum()), results.count
    low, high = wilson(reached, count)
    return f"{name}\n{100 * reached / count:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


def _points(planned: PlannedPath) -> np.ndarray:
    """[N, 2] (x, y) [m]: all that is drawn of a plan."""
    return np.concatenate([np.array([planned.start, planned.goal]), planned.path, planned.key_points])


def _draw_panel(grid: Grid, plan: Plan | PlannedPath, route: Route, name: str, ax: "Axes", y_down: bool) -> None:
    planned = planned_path(grid, plan)
    draw_used_map(grid, _points(planned), ax, y_down)
    draw_ends(planned.start, planned.goal, ax)
    if route == "path":
        _draw_route(grid, planned, route, ax)
    else:
        ax.plot(*planned.path.T, color=BLUE, linewidth=1.0, linestyle=":", zorder=4, label="grid path before reduction")
        draw_polyline(planned.key_points, ax, linestyle="-")
        _draw_rings(grid, planned, route, ax)
    ax.set_title(f"{name}\n{route_sentence(planned, route)}", fontsize=FONT)


def _draw_route(grid: Grid, planned: PlannedPath, route: Route, ax: "Axes") -> None:
    """The grid path, its turning points without the ends, and its danger points."""
    path = planned.path
    ax.plot(*path.T, color=BLUE, linewidth=2.2, zorder=4, label="grid path", **_haloed())
    turning = np.asarray(_turning_points(*_padded_cells(grid, path)))[: len(path)]
    breaking = path[turning][1:-1]
    ax.plot(*breaking.T, linestyle="none", marker="o", markersize=4.5, markerfacecolor="white", markeredgecolor=BLUE,
            zorder=5, label="breaking point" if len(breaking) else "_")
    _draw_rings(grid, planned, route, ax)


def _draw_rings(grid: Grid, planned: PlannedPath, route: Route, ax: "Axes") -> None:
    """A ring around each danger point, wide enough to be found on a large map."""
    points = danger_points(grid, planned, route)
    if not len(points):
        return
    size = float(np.clip(0.9 * _cell_size(grid, ax), 7.0, 16.0))
    ax.plot(*points.T, linestyle="none", marker="o", markersize=size, markerfacecolor="none", zorder=7,
            markeredgecolor=VERMILLION, markeredgewidth=size / 8, label="danger point")


def _cell_size(grid: Grid, ax: "Axes") -> float:
    """Points [pt] that a cell's side is likely to take on paper; the layout is settled later."""
    place = ax.get_subplotspec()
    width = figure_of(ax).get_figwidth() / (place.get_gridspec().ncols if place else 1)
    return 72.0 * max(width - 0.8, 1.0) / max(int(grid.height), int(grid.width))


def _draw_last(position: np.ndarray, outcome: Outcome, ax: "Axes") -> None:
    """Where the robot ended, unless that was the goal."""
    if outcome in COLLISIONS:
        ax.plot(*position[None].T, linestyle="none", marker="X", markersize=13, markerfacecolor=VERMILLION,
                markeredgecolor=BLACK, zorder=9, label="collision")
    elif outcome != Outcome.REACHED:
        ax.plot(*position[None].T, linestyle="none", marker="o", markersize=7, markerfacecolor="white",
                markeredgecolor=VERMILLION, markeredgewidth=2.0, zorder=9, label="robot, end")


def _haloed() -> dict[str, Any]:
    """A white rim, so that a line stays apart from the dark cells it crosses."""
    from matplotlib.patheffects import withStroke

    return {"path_effects": [withStroke(linewidth=3.6, foreground="white")]}


def _padded_cells(grid: Grid, points: np.ndarray) -> tuple[jax.Array, jax.Array]:
    """[P, 2] int32 (row, col) of the cells that hold points (x, y) [m], and how many count; the last repeats.

    P is a rung of the ladder, so that few lengths are compiled.
    """
    cells = np.floor((points - np.asarray(grid.origin)) / float(grid.resolution))[:, ::-1].astype(np.int32)
    count, mode = len(cells), "edge" if len(cells) else "constant"
    padded = np.pad(cells, ((0, ladder_size(count) - count), (0, 0)), mode=mode)
    return jnp.asarray(padded), jnp.int32(count)
