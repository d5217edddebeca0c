"""The front as plots that answer to the mouse: axes can be chosen and brushed, a point shows its constants.

Needs plotly, the `report` extra; a report has all of it inlined, so that the page works offline.
"""

import json
from collections.abc import Sequence
from html import escape
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np

from scenarios.drawing import BLACK, BLUE, VERMILLION
from tuning.evaluations import Evaluations
from tuning.findings import Findings, Judgement, Member
from tuning.objectives import Goals, Statistic
from tuning.report_figures import (
    GREY,
    VIOLATING,
    axis_label,
    candidate_objectives,
    in_units,
    line_colours,
    measure_name,
    name_and_unit,
    parallel_table,
    recommended,
    telling_objectives,
    unit_of,
    view_of,
    violating,
)

PLACE = "front-plot"  # id of the plot's element
CANDIDATES = "candidates"


def available() -> bool:
    """Whether plotly is installed."""
    return find_spec("plotly") is not None


def interactive_front(findings: Findings, training: Evaluations) -> tuple[str, str]:
    """The plot's element, and the scripts that fill it, which belong to the end of the page."""
    from plotly.offline import get_plotlyjs

    figure = front_plot(findings, training).to_json().replace("<", "\\u003c")  # no tag ends the script
    element = f'<div class="plot" id="{PLACE}" role="img" aria-label="Interactive scatter plot of the front"></div>'
    fill = f'{{ const figure = {figure}; Plotly.newPlot("{PLACE}", figure.data, figure.layout, {json.dumps(CONFIG)}) }}'
    return element, f"<script>{get_plotlyjs()}</script>\n<script>{fill}</script>"


def front_plot(findings: Findings, training: Evaluations) -> Any:
    """A plotly figure of the two objectives in which members differ most: choose its axes, point at a member for its
    number and constants. A point's `customdata` is its member's number, 0 for the default, −1 for other candidates.
    """
    import plotly.graph_objects as go

    kinds = _kinds(findings, training)
    across, up = sorted((telling_objectives(findings) * 2)[:2])
    figure = go.Figure([_scatter(kind, across, up) for kind in kinds])
    objectives = findings.goals.objectives
    ranges = [_range(statistic, kinds, index) for index, statistic in enumerate(objectives)]
    figure.update_layout(
        template="plotly_white", height=520, margin={"l": 60, "r": 20, "t": 70, "b": 60}, hovermode="closest",
        paper_bgcolor="white", legend={"orientation": "h", "y": -0.16},
        hoverlabel={"align": "left", "bgcolor": "white", "font": {"color": BLACK}},
        xaxis={"title": {"text": axis_label(objectives[across])}, "range": ranges[across]},
        yaxis={"title": {"text": axis_label(objectives[up])}, "range": ranges[up]},
        updatemenus=[_menu("x", objectives, kinds, ranges, across, 0.0),
                     _menu("y", objectives, kinds, ranges, up, 0.5)],
    )  # fmt: skip
    return figure


def parallel_plot(findings: Findings) -> Any:
    """Parallel coordinates as a plotly figure, in which ranges of an axis can be brushed; the first axis is the
    member's number, at which the recommended one (a star) and the default are named.
    """
    import plotly.graph_objects as go

    names, table = parallel_table(findings)
    numbers = [*range(1, len(findings.front) + 1), 0]
    shade = telling_objectives(findings)[0]
    best = findings.choices[findings.recommended].member + 1
    named = {0: "default", best: f"★ {best} {findings.picked}"}
    ticks = sorted(numbers)
    lines = {"color": table[:, len(findings.parameters) + shade], "colorscale": line_colours(9), "showscale": True,
             "colorbar": {"title": {"text": name_and_unit(findings.goals.objectives[shade]), "side": "right"}}}
    axes = [{"label": "member", "values": numbers, "tickvals": ticks,
             "ticktext": [named.get(number, str(number)) for number in ticks]},
            *({"label": name, "values": table[:, index]} for index, name in enumerate(names))]  # fmt: skip
    figure = go.Figure(go.Parcoords(line=lines, dimensions=axes, labelangle=-20))
    figure.update_layout(template="plotly_white", height=460, margin={"l": 120, "r": 20, "t": 110, "b": 30})
    return figure


CONFIG = {"displaylogo": False, "responsive": True, "modeBarButtonsToRemove": ["lasso2d", "select2d"]}


class _Kind(NamedTuple):
    """Of candidates, N of them."""

    name: str
    points: np.ndarray  # [N, O]
    texts: list[str]
    numbers: list[int]  # as the tables number members; the default 0, others -1
    style: dict[str, Any]


def _kinds(findings: Findings, training: Evaluations) -> list[_Kind]:
    goals, best, default = findings.goals, recommended(findings), findings.default
    others = [member for member in findings.front if member.row not in (best.row, default.row)]
    rest = np.isin(np.flatnonzero(training.complete), [member.row for member in (*others, best, default)], invert=True)
    texts = np.array([_constants(findings, values) for values in training.values[training.complete]], object)
    points, violates, kinds = candidate_objectives(goals, training), violating(goals, training), []
    for name, chosen, symbol in ((CANDIDATES, rest & ~violates, "circle"), (VIOLATING, rest & violates, "x-thin-open")):
        if chosen.any() or name == CANDIDATES:
            style = {"color": GREY, "size": 5, "symbol": symbol}
            kinds.append(_Kind(name, points[chosen], texts[chosen].tolist(), [-1] * int(chosen.sum()), style))
    for name, members, style in (
        ("front", others, {"color": BLUE, "size": 10, "symbol": "circle"}),
        ("default constants", [default], {"color": BLACK, "size": 11, "symbol": "square"}),
        (findings.picked, [best], {"color": VERMILLION, "size": 17, "symbol": "star"}),
    ):
        kinds.append(_of_members(findings, name, members, [member.training for member in members], style))
    unseen = [member for member in (*others, best, default) if member.held_out is not None]
    if unseen:
        judged = [member.held_out for member in unseen if member.held_out is not None]
        style = {"color": BLUE, "size": 9, "symbol": "circle-open"}
        kinds.append(_of_members(findings, "held out", unseen, judged, style))
    return kinds


def _of_members(findings: Findings, name: str, members: Sequence[Member], judged: Sequence[Judgement],
                style: dict[str, Any]) -> _Kind:
    return _Kind(name, _points(findings.goals, judged), [_member_text(findings, member) for member in members],
                 [_number(findings, member) for member in members], style)  # fmt: skip


def _points(goals: Goals, judgements: Sequence[Judgement]) -> np.ndarray:
    """[N, O], also of none."""
    return np.array([[float(in_units(statistic, part.value))
                      for statistic, part in zip(goals.objectives, judged.objectives, strict=True)]
                     for judged in judgements]).reshape(-1, len(goals.objectives))  # fmt: skip


def _scatter(kind: _Kind, across: int, up: int) -> Any:
    import plotly.graph_objects as go

    return go.Scatter(x=_column(kind.points, across), y=_column(kind.points, up), mode="markers", name=kind.name,
                      text=kind.texts, customdata=kind.numbers, marker=kind.style,
                      hovertemplate=f"<b>{kind.name}</b><br>%{{text}}<extra></extra>")  # fmt: skip


def _menu(axis: str, objectives: Sequence[Statistic], kinds: list[_Kind], ranges: list[list[float]], active: int,
          place: float) -> dict[str, Any]:
    """A list of objectives for one axis."""
    buttons = [{"label": f"{axis}: {measure_name(statistic)}", "method": "update",
                "args": [{axis: [_column(kind.points, index) for kind in kinds]},
                         {f"{axis}axis.title.text": axis_label(statistic), f"{axis}axis.range": ranges[index]}]}
               for index, statistic in enumerate(objectives)]  # fmt: skip
    return {"buttons": buttons, "active": active, "x": place, "xanchor": "left", "y": 1.14, "yanchor": "top"}


def _range(statistic: Statistic, kinds: list[_Kind], index: int) -> list[float]:
    """Of an axis: that of the members, as candidates far off would press them into a corner."""
    values = np.concatenate([kind.points[:, index] for kind in kinds if kind.name not in (CANDIDATES, VIOLATING)])
    return list(view_of(statistic, values, share=0.1))


def _column(points: np.ndarray, index: int) -> list[float | None]:
    """JSON has no NaN."""
    return [float(value) if np.isfinite(value) else None for value in points[:, index]]


def _member_text(findings: Findings, member: Member) -> str:
    lines = []
    for index, statistic in enumerate(findings.goals.objectives):
        parts = [("training", member.training), ("held out", member.held_out)]
        shown = [f"{float(in_units(statistic, judged.objectives[index].value)):.4g}{unit_of(statistic)} {suite}"
                 for suite, judged in parts if judged is not None]  # fmt: skip
        lines.append(f"{escape(measure_name(statistic))}: {', '.join(shown)}")
    return "<br>".join([f"member {_number(findings, member)}", *lines, _constants(findings, member.values)])


def _number(findings: Findings, member: Member) -> int:
    """As the tables number them; 0: the default."""
    rows = [one.row for one in findings.front]
    return rows.index(member.row) + 1 if member.row in rows else 0


def _constants(findings: Findings, values: np.ndarray) -> str:
    return "<br>".join(f"{escape(name)} = {value:.4g}" for name, value in zip(findings.parameters, values, strict=True))
