"""The front in a notebook that answers to the mouse: brush its members, click one to see all of it.

Needs plotly and anywidget, the extra `explore`; without anywidget plotly's figures answer by
themselves, without plotly the pictures stand still.
"""

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np

from scenarios.errors import InputError
from tuning.evaluations import Evaluations
from tuning.findings import Findings
from tuning.report_figures import VIOLATING, front_figure, parallel_figure
from tuning.report_interactive import CANDIDATES, available, front_plot, parallel_plot
from tuning.report_summary import front_table

HOW_TO_BRUSH = "Drag along an axis: the members that pass there are listed here."
NONE_PASSES = "No member passes in all of the brushed ranges."
DEFAULT_CLICKED = "The default constants, with which the tables compare. Click a blue point or the star."
WIDTH = 900  # [px]
LIKE_TABLES = "jp-RenderedHTMLCommon"  # the style of a notebook's tables


class MemberPicker:
    """The front as a notebook shows it. A click on a member makes it `member`, its number in the tables, and shows what
    `show` has to show of it below the plot. `member` is the recommended one until then; it may be set.
    """

    def __init__(self, findings: Findings, training: Evaluations, show: Callable[[int], Any] | None = None):
        self.member = findings.choices[findings.recommended].member + 1
        self._show, self._count = show, len(findings.front)
        self._output: Any = None
        if not clickable():
            self._shown: Any = (front_plot(findings, training) if available() else
                                front_figure(findings, training, numbered=True))  # fmt: skip
            return
        import ipywidgets
        import plotly.graph_objects as go

        plot: Any = go.FigureWidget(front_plot(findings, training))
        plot.layout.width = WIDTH
        for trace in plot.data:
            trace.on_click(self._clicked)
            if trace.name in (CANDIDATES, VIOLATING):  # or they would catch clicks on members that lie on them
                trace.update(hoverinfo="skip", hovertemplate=None)
        self._heading = ipywidgets.HTML("Click a member.")
        self._output = ipywidgets.Output()
        self._shown = ipywidgets.VBox([plot, self._heading, self._output])

    def choose(self, number: int) -> None:
        """What a click on the member does. InputError for a number that the tables do not have."""
        if not 1 <= number <= self._count:
            raise InputError(f"member: {number}; must be from 1 to {self._count}; choose one of them")
        self.member = number
        if self._show is None:
            return
        if self._output is None:
            self._show(number)
            return
        self._output.clear_output()
        self._heading.value = f"<b>Member {number}</b> …"
        with self._output:
            self._show(number)
        self._heading.value = f"<b>Member {number}</b>"

    def _clicked(self, trace: Any, points: Any, state: Any) -> None:
        for index in points.point_inds[:1]:  # called for every trace, of which one was hit
            number = int(trace.customdata[index])
            if number > 0:
                self.choose(number)
            else:
                self._output.clear_output()
                self._heading.value = DEFAULT_CLICKED

    def _ipython_display_(self) -> None:
        from IPython.display import display

        display(self._shown)


def brush_members(findings: Findings) -> Any:
    """Parallel coordinates in which ranges of axes can be brushed, and below it the table of the members that pass."""
    if not clickable():
        return parallel_plot(findings) if available() else parallel_figure(findings)
    import ipywidgets
    import plotly.graph_objects as go

    plot: Any = go.FigureWidget(parallel_plot(findings))
    plot.layout.width = max(WIDTH, 65 * len(plot.data[0].dimensions) + 200)  # drawn out of sight, it would be narrow
    table = ipywidgets.HTML(HOW_TO_BRUSH).add_class(LIKE_TABLES)
    lines = plot.data[0]

    def brushed(*_: Any) -> None:
        kept = passing(lines.dimensions)
        whole = len(kept) == len(findings.front)
        table.value = HOW_TO_BRUSH if whole else front_table(findings, kept) if kept else NONE_PASSES

    lines.on_change(brushed, "dimensions")
    return ipywidgets.VBox([plot, table])


def passing(dimensions: Any) -> list[int]:
    """Numbers of the members, the first axis, that lie within the brushed ranges of every axis."""
    kept = np.ones(len(dimensions[0]["values"]), np.bool_)
    for axis in dimensions:
        if axis.constraintrange:
            values = np.asarray(axis["values"], np.float64)[:, None]
            low, high = np.reshape(axis.constraintrange, (-1, 2)).T
            kept &= ((values >= low) & (values <= high)).any(axis=1)
    return [int(number) for number in np.asarray(dimensions[0]["values"])[kept] if number > 0]


def clickable() -> bool:
    """Whether what is clicked can be answered: plotly and anywidget are installed."""
    return available() and find_spec("anywidget") is not None
