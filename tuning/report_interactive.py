"""The front as plots that answer to the mouse: axes can be chosen and brushed, a point shows its constants.

Needs plotly, the `report` extra; a report has all of it inlined, so that the page works offline.
"""

import json
from html import escape
from importlib.util import find_spec
from typing import Any

import numpy as np

from scenarios.drawing import BLACK, BLUE, ORANGE, VERMILLION
from tuning.evaluations import Evaluations
from tuning.findings import Findings, Judgement, Member
from tuning.objectives import Goals, Statistic
from tuning.report_figures import (
    GREY,
    axis_label,
    candidate_objectives,
    front_figure,
    in_units,
    line_colours,
    measure_name,
    name_and_unit,
    parallel_figure,
    parallel_table,
    recommended,
    telling_objective,
    unit_of,
    view_of,
)

PLACE = "front-plot"  # id of the plot's element


def available() -> bool:
    """Whether plotly is installed."""
    return find_spec("plotly") is not None


def interactive_front(findings: Findings, training: Evaluations) -> tuple[str, str]:
    """The plot's element, and the scripts that fill it, which belong to the end of the page."""
    from plotly.offline import get_plotlyjs

    figure = _figure(findings, training).to_json().replace("<", "\\u003c")  # no tag ends the script
    element = f'<div class="plot" id="{PLACE}" role="img" aria-label="Interactive scatter plot of the front"></div>'
    fill = f'{{ const figure = {figure}; Plotly.newPlot("{PLACE}", figure.data, figure.layout, {json.dumps(CONFIG)}) }}'
    return element, f"<script>{get_plotlyjs()}</script>\n<script>{fill}</script>"


def explore_front(findings: Findings, training: Evaluations) -> Any:
    """A plotly figure: choose its axes, point at a member for its number and constants. Without plotly `front_figure`
    with the members' numbers.
    """
    return _figure(findings, training) if available() else front_figure(findings, training, numbered=True)


def explore_parallel(findings: Findings) -> Any:
    """Parallel coordinates as a plotly figure, in which a range of an axis can be brushed; the first axis is the
    member's number, at which the recommended one (a star) and the default are named. Without plotly `parallel_figure`.
    """
    if not available():
        return parallel_figure(findings)
    import plotly.graph_objects as go

    names, table = parallel_table(findings)
    numbers = [*range(1, len(findings.front) + 1), 0]
    shade = telling_objective(findings)
    best = findings.choices[findings.recommended].member + 1
    named = {0: "default", best: f"★ {best} {findings.picked}"}
    ticks = sorted(numbers)
    lines = {"color": table[:, len(findings.parameters) + shade], "colorscale": line_colours(9), "showscale": True,
             "colorbar": {"title": {"text": name_and_unit(findings.goals.objectives[shade]), "side": "right"}}}
    axes = [{"label": "member", "values": numbers, "tickvals": ticks,
             "ticktext": [named.get(number, str(number)) for number in ticks]},
            *({"label": name, "values": table[:, index]} for index, name in enumerate(names))]  # fmt: skip
    figure = go.Figure(go.Parcoords(line=lines, dimensions=axes, labelangle=-20))
    figure.update_layout(template="plotly_white", height=460, margin={"l": 60, "r": 20, "t": 110, "b": 30})
    return figure


CONFIG = {"displaylogo": False, "responsive": True, "modeBarButtonsToRemove": ["lasso2d", "select2d"]}


def _figure(findings: Findings, training: Evaluations) -> Any:
    import plotly.graph_objects as go

    traces = _traces(findings, training)
    up = min(1, len(findings.goals.objectives) - 1)
    figure = go.Figure([_scatter(name, points, texts, style, up) for name, points, texts, style in traces])
    labels = [axis_label(statistic) for statistic in findings.goals.objectives]
    ranges = [_range(statistic, traces, index) for index, statistic in enumerate(findings.goals.objectives)]
    figure.update_layout(
        template="plotly_white", height=520, margin={"l": 60, "r": 20, "t": 70, "b": 60}, hovermode="closest",
        paper_bgcolor="white", legend={"orientation": "h", "y": -0.16}, hoverlabel={"align": "left"},
        xaxis={"title": {"text": labels[0]}, "range": ranges[0]},
        yaxis={"title": {"text": labels[up]}, "range": ranges[up]},
        updatemenus=[_menu("x", labels, traces, ranges, 0, 0.0), _menu("y", labels, traces, ranges, up, 0.5)],
    )  # fmt: skip
    return figure


def _traces(findings: Findings, training: Evaluations) -> list[tuple[str, np.ndarray, list[str], dict[str, Any]]]:
    """Name, points [N, O], texts N and style of each kind of candidate."""
    goals, best, default = findings.goals, recommended(findings), findings.default
    others = [member for member in findings.front if member.row not in (best.row, default.row)]
    rest = np.isin(np.flatnonzero(training.complete), [member.row for member in (*others, best, default)], invert=True)
    texts = [_constants(findings, values) for values in training.values[training.complete][rest]]
    kinds = [("candidates", candidate_objectives(goals, training)[rest], texts,
              {"color": GREY, "size": 5, "symbol": "circle"})]  # fmt: skip
    for name, members, style in (
        ("front", others, {"color": BLUE, "size": 10, "symbol": "circle"}),
        ("default constants", [default], {"color": BLACK, "size": 11, "symbol": "square"}),
        (findings.picked, [best], {"color": VERMILLION, "size": 17, "symbol": "star"}),
    ):
        kinds.append((name, _points(goals, [member.training for member in members]),
                      [_member_text(findings, member) for member in members], style))  # fmt: skip
    unseen = [member for member in (*others, best, default) if member.held_out is not None]
    if unseen:
        kinds.append(("held out", _points(goals, [member.held_out for member in unseen if member.held_out is not None]),
                      [_member_text(findings, member) for member in unseen],
                      {"color": ORANGE, "size": 9, "symbol": "circle-open"}))  # fmt: skip
    return kinds


def _points(goals: Goals, judgements: list[Judgement]) -> np.ndarray:
    """[N, O], also of none."""
    return np.array([[float(in_units(statistic, part.value))
                      for statistic, part in zip(goals.objectives, judged.objectives, strict=True)]
                     for judged in judgements]).reshape(-1, len(goals.objectives))  # fmt: skip


def _scatter(name: str, points: np.ndarray, texts: list[str], style: dict[str, Any], up: int) -> Any:
    import plotly.graph_objects as go

    return go.Scatter(x=_column(points, 0), y=_column(points, up), mode="markers", name=name, text=texts, marker=style,
                      hovertemplate=f"<b>{name}</b><br>%{{text}}<extra></extra>")  # fmt: skip


def _menu(axis: str, labels: list[str], traces: list[Any], ranges: list[list[float]], active: int,
          place: float) -> dict[str, Any]:
    """A list of objectives for one axis."""
    buttons = [{"label": f"{axis}: {label}", "method": "update",
                "args": [{axis: [_column(points, index) for _, points, _, _ in traces]},
                         {f"{axis}axis.title.text": label, f"{axis}axis.range": ranges[index]}]}
               for index, label in enumerate(labels)]  # fmt: skip
    return {"buttons": buttons, "active": active, "x": place, "xanchor": "left", "y": 1.14, "yanchor": "top"}


def _range(statistic: Statistic, traces: list[Any], index: int) -> list[float]:
    """Of an axis: that of the members, as candidates far off would press them into a corner."""
    values = np.concatenate([points[:, index] for _, points, _, _ in traces[1:]])
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
    return "<br>".join([_number(findings, member), *lines, _constants(findings, member.values)])


def _number(findings: Findings, member: Member) -> str:
    """As the tables number them."""
    rows = [one.row for one in findings.front]
    return f"member {rows.index(member.row) + 1}" if member.row in rows else "member 0"


def _constants(findings: Findings, values: np.ndarray) -> str:
    return "<br>".join(f"{escape(name)} = {value:.4g}" for name, value in zip(findings.parameters, values, strict=True))
