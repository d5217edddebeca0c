"""The pictures of a tuning job: front, parallel coordinates, sweeps, hypervolume, importance, stability of the choices,
optimism gap, gradient agreement.

Findings in, matplotlib figures out. Conventions: `scenarios.drawing`. `ax`, or
`axes` where a figure has several panels, may be given: the legend is then under the last of them.
Dimension letters: D parameters; O objectives; N members; W candidates; G generations; S starts of the gradient method.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations
from math import ceil
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from scenarios.drawing import (
    BLACK,
    BLUE,
    CELL_LINES,
    FONT,
    ORANGE,
    SKY,
    VERMILLION,
    figure_of,
    new_figure,
)
from tuning.analysis import judgements
from tuning.console import UNITS
from tuning.evaluations import Evaluations
from tuning.figures import Panels, legend_of, panels_of
from tuning.findings import BY_HAND, Findings, HypervolumeCurve, Judgement, Member
from tuning.objectives import RATES, Goals, Statistic, estimate
from tuning.weights_file import UNITS as CONSTANT_UNITS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 3  # panels side by side
GREY = "#999999"
VIOLATING = "breaks a constraint"
COLOURS = "cividis"  # equal steps in lightness: also for the colour-blind, and in grey
SEED = 0  # of the resamples behind the intervals of a sweep
DEFAULT = {"marker": "s", "markersize": 7, "color": BLACK}
FRONT = {"marker": "o", "markersize": 5, "color": BLUE}
CHOSEN = {"marker": "*", "markersize": 13, "color": VERMILLION, "markeredgecolor": BLACK}


def recommended(findings: Findings) -> Member:
    """The member that the job recommends, or that was chosen by hand in its place."""
    return findings.front[findings.choices[findings.recommended].member]


def measure_name(statistic: Statistic) -> str:
    """For people: without underscores, a rate as a rate."""
    name = statistic.label.replace("_", " ")
    return name.replace(statistic.measure, f"{statistic.measure} rate", 1) if statistic.measure in RATES else name


def axis_label(statistic: Statistic) -> str:
    """Name, unit, and which way is better."""
    return f"{axis_name(statistic)}, {'less' if statistic.direction == 'min' else 'more'} is better"


def axis_name(statistic: Statistic) -> str:
    """Name and unit, [1] where there is none."""
    return f"{measure_name(statistic)} [{unit_of(statistic) or 1}]"


def name_and_unit(statistic: Statistic) -> str:
    """For headings."""
    unit = unit_of(statistic)
    return measure_name(statistic) + (f" [{unit}]" if unit else "")


def constant_and_unit(name: str) -> str:
    """A constant's name for axes."""
    return name.replace("_", " ") + (f" [{CONSTANT_UNITS[name]}]" if name in CONSTANT_UNITS else "")


def unit_of(statistic: Statistic) -> str:
    """Of `in_units`."""
    return "%" if statistic.measure in RATES else UNITS.get(statistic.measure, "")


def in_units(statistic: Statistic, value: Any) -> Any:
    """A rate in percent, all else as it is; never −0."""
    return (100.0 if statistic.measure in RATES else 1.0) * np.asarray(value, np.float64) + 0.0


def view_of(statistic: Statistic, values: np.ndarray, share: float = 0.12) -> tuple[float, float]:
    """Ends of an axis that shows the values, in units as shown, with room of that share of their span at each end.

    Rates end where they can: at 0 and 100 %, but for half a marker's width.
    """
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    room = share * (high - low) or 0.02 * abs(high) or 1.0
    ends = low - room, high + room
    if statistic.measure not in RATES:
        return ends
    marker = 0.05 * (ends[1] - ends[0])
    return max(ends[0], -marker), min(ends[1], 100.0 + marker)


def front_figure(findings: Findings, training: Evaluations | None = None, numbered: bool = False,
                 axes: "Panels | None" = None) -> "Figure":
    """Every pair of objectives: the front, the default constants and the recommended ones, a line from each to its
    value on the held-out suite; all candidates in grey if `training` is given, crosses where they break a constraint.
    One objective: by candidate.

    numbered: members of the front carry the numbers that tables give them, from 1. axes: one a pair, or one.
    """
    objectives = findings.goals.objectives
    if len(objectives) == 1:
        return _single_objective(findings, training, axes)
    pairs = list(combinations(range(len(objectives)), 2))
    panels = _panels(len(pairs), height=3.0) if axes is None else panels_of(axes, len(pairs))
    cloud = None if training is None else (candidate_objectives(findings.goals, training),
                                           violating(findings.goals, training))  # fmt: skip
    for ax, (across, up) in zip(panels, pairs, strict=True):
        _show_members(findings, across, up, ax)
        if cloud is not None:
            points, violates = cloud
            _draw_candidates(points[:, [across, up]], violates, ax)
        _draw_members(findings, across, up, ax)
        if numbered:
            _number_members(findings, across, up, ax)
        _label_axes(ax, axis_label(objectives[across]), axis_label(objectives[up]))
        _mark_rates(ax, objectives[across], objectives[up])
    legend_of(panels, axes is None)
    return figure_of(panels[0])


def parallel_table(findings: Findings) -> tuple[list[str], np.ndarray]:
    """Names of D constants and O objectives, and [N + 1, D + O] their values, in units as shown: of the front's
    members, objectives on training, then of the default.
    """
    objectives = findings.goals.objectives
    names = [*map(constant_and_unit, findings.parameters), *map(name_and_unit, objectives)]
    rows = [[*member.values, *(float(in_units(statistic, part.value)) for statistic, part in
                               zip(objectives, member.training.objectives, strict=True))]
            for member in (*findings.front, findings.default)]  # fmt: skip
    return names, np.array(rows)


def telling_objectives(findings: Findings) -> list[int]:
    """Objectives by index, those first in which the members differ most: by their span over their largest value."""
    objectives = parallel_table(findings)[1][:, len(findings.parameters) :]
    span = np.nanmax(objectives, axis=0) - np.nanmin(objectives, axis=0)
    return np.argsort(-span / np.maximum(np.nanmax(np.abs(objectives), axis=0), 1e-9), kind="stable").tolist()


def line_colours(count: int = 64) -> list[str]:
    """Of thin lines, from least to most: `COLOURS` without its light end, which is lost on white."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colour) for colour in colormaps[COLOURS](np.linspace(0.0, 0.68, count))]


def parallel_figure(findings: Findings, ax: "Axes | None" = None) -> "Figure":
    """Parallel coordinates: one line a member of the front through its constants and its objectives on training.

    Each axis runs over what is shown; the shade is the objective in which they differ most.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    names, table = parallel_table(findings)
    alone = ax is None
    ax = new_figure((max(0.62 * len(names) + 1.6, 5.0), 4.6)).subplots() if ax is None else ax
    low, high = np.nanmin(table, axis=0), np.nanmax(table, axis=0)
    lines = np.where(high > low, (table - low) / np.where(high > low, high - low, 1.0), 0.5)
    shade = telling_objectives(findings)[0]
    shaded = table[:, len(findings.parameters) + shade]
    shades = ScalarMappable(Normalize(np.nanmin(shaded), np.nanmax(shaded)), ListedColormap(line_colours()))
    for line, value in zip(lines[:-1], shaded[:-1], strict=True):
        ax.plot(line, color=shades.to_rgba(value), linewidth=1.2, zorder=2)
    ax.plot(lines[-1], color=BLACK, linewidth=1.8, linestyle="--", zorder=3, label="default constants")
    best = lines[findings.choices[findings.recommended].member]
    style: dict[str, Any] = CHOSEN | {"markersize": 9}
    ax.plot(best, linewidth=2.4, zorder=4, label=findings.picked, **style)
    _dress_parallel(ax, names, low, high, len(findings.parameters))
    bar = figure_of(ax).colorbar(shades, ax=ax, pad=0.01, shrink=0.8)
    bar.set_label(axis_label(findings.goals.objectives[shade]), fontsize=FONT)
    bar.ax.tick_params(labelsize=FONT - 1)
    legend_of([ax], alone)
    return figure_of(ax)


class Sweep(NamedTuple):
    """Candidates in which one parameter varies and no other."""

    parameter: int  # index
    rows: np.ndarray  # of the evaluations, lowest value first


def sweeps(training: Evaluations, fewest: int = 3) -> list[Sweep]:
    """The curves of §3.4 that there are, with `fewest` candidates or more each, whichever method asked for them.

    The others are fixed at the default, or at the end of the searched range that is nearest to it.
    """
    values = training.values[training.complete]
    rows = np.flatnonzero(training.complete)
    searched = values[1:] if len(values) > 1 else values
    fixed = np.clip(training.values[0], searched.min(axis=0), searched.max(axis=0))
    differs = ~np.isclose(values, fixed, rtol=1e-9, atol=1e-12)
    found = []
    for index in range(values.shape[1]):
        alone = np.flatnonzero(~np.delete(differs, index, axis=1).any(axis=1))
        if len(alone) >= fewest:
            found.append(Sweep(index, rows[alone[np.argsort(values[alone, index], kind="stable")]]))
    return found


def sweep_figure(goals: Goals, training: Evaluations, found: Sequence[Sweep],
                 axes: "Panels | None" = None) -> "Figure":
    """§3.4: each parameter in turn (down) against each objective (across), with 95 % intervals; default dashed.

    axes: row by row.
    """
    columns, rows = len(goals.objectives), len(found)
    if axes is None:
        axes = new_figure((2.5 * columns + 0.4, 2.0 * rows + 0.5)).subplots(rows, columns, squeeze=False)
    panels = panels_of(axes, rows * columns)
    for place, sweep in enumerate(found):
        line = panels[place * columns : (place + 1) * columns]
        values = training.values[sweep.rows, sweep.parameter]
        judged = [one.objectives for one in judgements(training, sweep.rows.tolist(), goals, SEED)]
        for ax, statistic, intervals in zip(line, goals.objectives, zip(*judged, strict=True), strict=True):
            points = in_units(statistic, intervals)
            ax.fill_between(values, points[:, 1], points[:, 2], color=SKY, alpha=0.4, linewidth=0)
            ax.plot(values, points[:, 0], color=BLUE, marker="o", markersize=3, linewidth=1.4)
            ax.axvline(training.values[0, sweep.parameter], color=BLACK, linestyle="--", linewidth=0.9)
            name = training.parameters[sweep.parameter].replace("_", " ")
            _label_axes(ax, name, axis_name(statistic))
            _mark_rates(ax, None, statistic)
    return figure_of(panels[0])


def hypervolume_figure(curve: HypervolumeCurve, ax: "Axes | None" = None) -> "Figure":
    """Hypervolume against the episodes driven: it can only rise."""
    if ax is None:
        ax = new_figure((5.6, 3.2)).subplots()
    ax.step(curve.episodes, curve.value, where="post", color=BLUE, linewidth=1.8)
    ax.plot(curve.episodes, curve.value, linestyle="none", marker="o", markersize=3.5, color=BLUE)
    ax.set_xlim(left=0.0)
    _label_axes(ax, "episodes driven", "hypervolume of the front")
    return figure_of(ax)


def importance_figure(findings: Findings, ax: "Axes | None" = None) -> "Figure":
    """Heat map: share [%] of each objective's variation that each parameter explains by itself.

    A column need not add up to 100: what parameters that moved together explain counts for each of them.
    """
    share, objectives = 100.0 * findings.importance, findings.goals.objectives
    if ax is None:
        ax = new_figure((1.35 * len(objectives) + 2.6, 0.34 * len(share) + 1.5)).subplots()
    image = ax.imshow(share, cmap=COLOURS, vmin=0.0, vmax=100.0, aspect="auto")
    for (row, column), value in np.ndenumerate(share):
        text = "–" if np.isnan(value) else f"{value:.0f}"
        ax.text(column, row, text, ha="center", va="center", fontsize=FONT, color=BLACK if value > 55 else "white")
    ax.set_xticks(range(len(objectives)), [measure_name(statistic).replace(" ", "\n", 1) for statistic in objectives])
    ax.set_yticks(range(len(share)), [name.replace("_", " ") for name in findings.parameters])
    ax.tick_params(labelsize=FONT, length=0)
    bar = figure_of(ax).colorbar(image, ax=ax, pad=0.02)
    bar.set_label("share of the variation [%]", fontsize=FONT)
    bar.ax.tick_params(labelsize=FONT - 1)
    return figure_of(ax)


def stability_figure(findings: Findings, ax: "Axes | None" = None) -> "Figure":
    """Heat map over the front's members, had other scenarios of the kind been drawn: in how many [%] of the resamples
    nothing dominates a member, and each rule picks it. The rules' picks are framed.

    Members without a number in a row are picked in under half a percent; thinned fronts leave some out altogether.
    """
    from matplotlib.patches import Rectangle

    choices = [choice for choice in findings.choices if choice.rule != BY_HAND]
    share = 100.0 * np.array([[member.non_dominated for member in findings.front], *(one.shares for one in choices)])
    if ax is None:
        ax = new_figure((0.42 * share.shape[1] + 3.4, 0.42 * len(share) + 1.3)).subplots()
    image = ax.imshow(share, cmap=COLOURS, vmin=0.0, vmax=100.0, aspect="auto")
    for (row, column), value in np.ndenumerate(share):
        ax.text(column, row, f"{value:.0f}" if value > 0.5 else "", ha="center", va="center", fontsize=FONT - 1,
                color=BLACK if value > 55 else "white")  # fmt: skip
    for row, choice in enumerate(choices, start=1):
        ax.add_patch(Rectangle((choice.member - 0.5, row - 0.5), 1, 1, fill=False, edgecolor=VERMILLION, linewidth=2.5,
                               zorder=3))  # fmt: skip
    ax.set_xticks(range(share.shape[1]), [str(number) for number in range(1, share.shape[1] + 1)])
    ax.set_yticks(range(len(share)), ["not dominated", *(one.rule.replace("_", " ") for one in choices)])
    ax.axhline(0.5, color="white", linewidth=3.0)
    ax.set_xlabel("member of the front", fontsize=FONT)
    ax.tick_params(labelsize=FONT, length=0)
    bar = figure_of(ax).colorbar(image, ax=ax, pad=0.02)
    bar.set_label("share of the resamples [%]", fontsize=FONT)
    bar.ax.tick_params(labelsize=FONT - 1)
    return figure_of(ax)


def optimism_figure(findings: Findings, axes: "Panels | None" = None) -> "Figure":
    """Training against held-out, a panel an objective, with 95 % intervals: on the dashed line both are equal."""
    objectives = findings.goals.objectives
    panels = _panels(len(objectives), 3.1, columns=2) if axes is None else panels_of(axes, len(objectives))
    best = recommended(findings)
    for index, (ax, statistic) in enumerate(zip(panels, objectives, strict=True)):
        others = [member for member in findings.front if member is not best]
        _draw_against(others, index, statistic, ax, FRONT | {"label": "front"})
        _draw_against([findings.default], index, statistic, ax, DEFAULT | {"label": "default constants"})
        _draw_against([best], index, statistic, ax, CHOSEN | {"label": findings.picked})
        ends = np.array([*ax.get_xlim(), *ax.get_ylim()])
        ax.axline((ends.min(), ends.min()), slope=1.0, color=GREY, linestyle="--", linewidth=1.0, zorder=0,
                  label="equal on both")  # fmt: skip
        _label_axes(ax, f"training: {axis_name(statistic)}", f"held-out: {axis_name(statistic)}")
        _mark_rates(ax, statistic, statistic)
        ax.set_title(axis_label(statistic).rpartition(", ")[2], fontsize="medium")
    legend_of(panels, axes is None)
    return figure_of(panels[0])


def agreement_figure(agreement: Mapping[str, np.ndarray], place_name: str = "start",
                     ax: "Axes | None" = None) -> "Figure":
    """Cosine between the surrogate's gradient and the hard planner's at each start, with its 95 % interval, and the
    share of parameters whose signs agree, with that of chance. cosine, cosine_low, cosine_high, sign_agreement: [S].
    place_name: what a start is called.
    """
    alone = ax is None
    ax = new_figure((6.2, 3.2)).subplots() if ax is None else ax
    cosine, low, high, signs = (np.atleast_1d(agreement[name]) for name in
                                ("cosine", "cosine_low", "cosine_high", "sign_agreement"))  # fmt: skip
    place = np.arange(len(cosine))
    ax.errorbar(place - 0.1, cosine, np.maximum([cosine - low, high - cosine], 0.0), fmt="o", color=BLUE, capsize=3,
                label="cosine, 95 % interval")  # fmt: skip
    ax.plot(place + 0.1, signs, linestyle="none", marker="D", markersize=6, markerfacecolor=ORANGE,
            markeredgecolor=BLACK, label="share of signs that agree")  # fmt: skip
    ax.axhline(0.0, color=BLACK, linewidth=0.8, linestyle="--")
    ax.axhline(0.5, color=ORANGE, linewidth=1.0, linestyle=":", zorder=1, label="signs that agree by chance")
    ax.set(ylim=(-1.05, 1.05), xlim=(-0.5, len(cosine) - 0.5))
    _label_axes(ax, place_name, "agreement [1]")
    ax.set_xticks(place, [str(index + 1) for index in place])
    legend_of([ax], alone)
    return figure_of(ax)


def candidate_objectives(goals: Goals, evaluations: Evaluations) -> np.ndarray:
    """[W', O] objectives, in units as shown, of those candidates that have seen all scenarios."""
    whole = evaluations.rows(evaluations.complete)
    return np.stack([in_units(statistic, estimate(statistic, whole.columns, whole.done))
                     for statistic in goals.objectives], axis=1)  # fmt: skip


def violating(goals: Goals, evaluations: Evaluations) -> np.ndarray:
    """[W'] bool: which of those candidates break a constraint."""
    whole = evaluations.rows(evaluations.complete)
    violates = goals.scores(whole.columns, whole.done).violation > 0.0
    return violates if goals.constraints else np.zeros_like(violates)


def _panels(count: int, height: float, columns: int = COLUMNS) -> list["Axes"]:
    """`count` axes of a new figure; what is left of the last row is empty."""
    columns = min(count, columns)
    rows = ceil(count / columns)
    figure = new_figure((3.2 * columns + 0.3, height * rows + 0.5))
    panels = figure.subplots(rows, columns, squeeze=False).ravel().tolist()
    for spare in panels[count:]:
        spare.set_axis_off()
    return panels[:count]


def _draw_members(findings: Findings, across: int, up: int, ax: "Axes") -> None:
    statistics = findings.goals.objectives[across], findings.goals.objectives[up]
    best = recommended(findings)
    for kind, members, style in (("front", findings.front, FRONT), ("default constants", [findings.default], DEFAULT),
                                 (findings.picked, [best], CHOSEN)):  # fmt: skip
        points = np.array([_point(member.training, across, up, statistics) for member in members])
        ax.plot(*points.T, linestyle="none", zorder=4 if kind == "front" else 5, label=kind, **style)
        for member, point in zip(members, points, strict=True):
            if member.held_out is not None:
                _draw_held_out(point, _point(member.held_out, across, up, statistics), style["color"], kind, ax)


def _number_members(findings: Findings, across: int, up: int, ax: "Axes") -> None:
    """Members at one place share a label, which lies beside its mark where it hides the least of marks and labels; a
    white rim keeps it apart from what lies under it, and a line leads to it where it is far.
    """
    from matplotlib.patheffects import withStroke

    statistics = findings.goals.objectives[across], findings.goals.objectives[up]
    numbers: dict[tuple[float, float], list[str]] = {}
    for number, member in enumerate(findings.front, start=1):
        x, y = _point(member.training, across, up, statistics).tolist()
        numbers.setdefault((x, y), []).append(str(number))
    labels = [", ".join(there) for there in numbers.values()]
    best, default = (_point(one.training, across, up, statistics) for one in (recommended(findings), findings.default))
    marks = [*((place, 3.0) for place in numbers), (default, 4.5), (best, 7.0)]
    for place, label, offset in zip(numbers, labels, _label_offsets(list(numbers), labels, marks, ax), strict=True):
        far = float(np.hypot(*offset)) > 13.0
        ax.annotate(label, place, xytext=offset, textcoords="offset points", fontsize=FONT - 1, zorder=6, ha="center",
                    va="center", path_effects=[withStroke(linewidth=2.0, foreground="white")],
                    arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.6} if far else None)  # fmt: skip


def _label_offsets(places: Sequence[tuple[float, float]], labels: Sequence[str],
                   marks: Sequence[tuple[Any, float]], ax: "Axes") -> list[tuple[float, float]]:
    """Of each label's middle from its place [pt], one after the other where least is hidden.

    marks: places with half their size [pt].
    """
    scale = 72.0 / figure_of(ax).dpi
    taken = [(*(scale * ax.transData.transform(place)), half, half) for place, half in marks]  # middle, half sizes
    low, high = scale * np.array(ax.bbox.min), scale * np.array(ax.bbox.max)
    angles = np.deg2rad([45, 135, -45, -135, 90, 0, 180, -90])
    found = []
    for place, label in zip(places, labels, strict=True):
        middle, half = scale * ax.transData.transform(place), np.array([2.6 * len(label) + 0.5, 4.0])
        offsets = [(distance + np.array([half[0] - 3.0, 0.0])) * np.array([np.cos(angle), np.sin(angle)])
                   for distance in (9.0, 12.0, 17.0, 23.0) for angle in angles]  # fmt: skip
        boxes = np.array(taken)
        costs = []
        for offset in offsets:
            at = middle + offset
            shared = np.maximum(half + boxes[:, 2:] - np.abs(at - boxes[:, :2]), 0.0)
            outside = np.maximum(low + half - at, 0.0) + np.maximum(at + half - high, 0.0)
            costs.append(shared.prod(axis=1).sum() + 40.0 * outside.sum() + 0.2 * np.hypot(*offset))
        offset = offsets[int(np.argmin(costs))]
        taken.append((*(middle + offset), *half))
        found.append((float(offset[0]), float(offset[1])))
    return found


def _draw_held_out(trained: np.ndarray, held_out: np.ndarray, color: str, kind: str, ax: "Axes") -> None:
    """A hollow mark, joined to the training value; faint for the front, of which there are many."""
    faint = 0.35 if kind == "front" else 1.0
    ax.plot(*np.stack([trained, held_out]).T, color=color, linewidth=0.9, alpha=faint, zorder=3)
    ax.plot(*held_out[:, None], linestyle="none", marker="o", markersize=5, markerfacecolor="white",
            markeredgecolor=color, alpha=max(faint, 0.6), zorder=3.5, label="the same, held out")


def _point(judgement: Judgement, across: int, up: int, statistics: tuple[Statistic, Statistic]) -> np.ndarray:
    return np.array([float(in_units(statistic, judgement.objectives[index].value))
                     for statistic, index in zip(statistics, (across, up), strict=True)])  # fmt: skip


def _show_members(findings: Findings, across: int, up: int, ax: "Axes") -> None:
    """Zoom to the members: candidates far off would press them into a corner."""
    statistics = findings.goals.objectives[across], findings.goals.objectives[up]
    judgements = [judged for member in (*findings.front, findings.default)
                  for judged in (member.training, member.held_out) if judged is not None]  # fmt: skip
    points = np.array([_point(judged, across, up, statistics) for judged in judgements])
    for statistic, values, limits in zip(statistics, points.T, (ax.set_xlim, ax.set_ylim), strict=True):
        limits(*view_of(statistic, values))


def _draw_candidates(points: np.ndarray, violates: np.ndarray, ax: "Axes") -> None:
    """Those [W, 2] within the view; one beyond it is left out rather than cut at the frame. violates: [W] bool."""
    low, high = np.array([ax.get_xlim(), ax.get_ylim()]).T
    within = ((points >= low) & (points <= high)).all(axis=1)
    for kind, marker, shown in (("candidate", ".", within & ~violates), (VIOLATING, "x", within & violates)):
        if shown.any() or kind != VIOLATING:
            ax.plot(*np.where(shown[:, None], points, np.nan).T, linestyle="none", marker=marker, markersize=4,
                    color=GREY, zorder=1, clip_on=False, label=kind)  # fmt: skip


def _mark_rates(ax: "Axes", across: Statistic | None, up: Statistic | None) -> None:
    """No tick below 0 or above 100 % on the axes of rates; call it when the limits are settled. None: no statistic."""
    for axis, statistic in ((ax.xaxis, across), (ax.yaxis, up)):
        if statistic is not None and statistic.measure in RATES:
            low, high = sorted(axis.get_view_interval())
            ticks = np.asarray(axis.get_major_locator().tick_values(low, high))
            axis.set_ticks(ticks[(ticks >= max(low, -1e-9)) & (ticks <= min(high, 100.0 + 1e-9))].tolist())


def _single_objective(findings: Findings, training: Evaluations | None, axes: "Panels | None") -> "Figure":
    """The only objective of every candidate in the order in which they were asked for."""
    (ax,) = panels_of(new_figure((5.6, 3.4)).subplots() if axes is None else axes, 1)
    (statistic,) = findings.goals.objectives
    if training is not None:
        cloud = candidate_objectives(findings.goals, training)
        ax.plot(np.flatnonzero(training.complete), cloud[:, 0], linestyle="none", marker=".", color=GREY,
                label="candidate")  # fmt: skip
    for member, style, kind in ((findings.default, DEFAULT, "default constants"),
                                (recommended(findings), CHOSEN, findings.picked)):  # fmt: skip
        value = float(in_units(statistic, member.training.objectives[0].value))
        ax.plot(member.row, value, linestyle="none", label=kind, **style)
        if member.held_out is not None:
            held_out = float(in_units(statistic, member.held_out.objectives[0].value))
            ends = np.array([member.row, value]), np.array([member.row, held_out])
            _draw_held_out(*ends, style["color"], kind, ax)
    _label_axes(ax, "candidate, in the order asked for", axis_label(statistic))
    _mark_rates(ax, None, statistic)
    legend_of([ax], axes is None)
    return figure_of(ax)


def _draw_against(members: Sequence[Member], index: int, statistic: Statistic, ax: "Axes",
                  style: dict[str, Any]) -> None:
    """Held-out over training, with both intervals."""
    judged = [(member.training, member.held_out) for member in members if member.held_out is not None]
    if not judged:
        return
    training, held_out = (in_units(statistic, [part.objectives[index] for part in parts]).T
                          for parts in zip(*judged, strict=True))  # fmt: skip
    spread = [np.maximum([part[0] - part[1], part[2] - part[0]], 0.0) for part in (training, held_out)]
    ax.errorbar(training[0], held_out[0], spread[1], spread[0], linestyle="none", elinewidth=0.7, **style)


def _dress_parallel(ax: "Axes", names: Sequence[str], low: np.ndarray, high: np.ndarray, parameters: int) -> None:
    """Axes with their ends written at them; a gap of shade tells constants from objectives."""
    for place in range(len(names)):
        ax.axvline(place, color=CELL_LINES, linewidth=1.0, zorder=0)
        ax.text(place, 1.03, f"{high[place]:.3g}", ha="center", va="bottom", fontsize=FONT - 1)
        ax.text(place, -0.03, f"{low[place]:.3g}", ha="center", va="top", fontsize=FONT - 1)
    ax.axvspan(parameters - 0.5, len(names) - 0.5, color=CELL_LINES, alpha=0.45, zorder=-1, label="objectives")
    ax.set_xticks(range(len(names)), names, rotation=40, ha="right", fontsize=FONT)
    ax.set(yticks=[], xlim=(-0.5, len(names) - 0.5), ylim=(-0.1, 1.1))
    for side in ("top", "right", "left"):
        ax.spines[side].set_visible(False)


def _label_axes(ax: "Axes", across: str, up: str) -> None:
    from matplotlib.ticker import MaxNLocator

    ax.set_xlabel(across, fontsize=FONT)
    ax.set_ylabel(up, fontsize=FONT)
    ax.tick_params(labelsize=FONT - 1)
    ax.xaxis.set_major_locator(MaxNLocator(nbins=5))
    ax.grid(color=CELL_LINES, linewidth=0.5)
    ax.set_axisbelow(True)
