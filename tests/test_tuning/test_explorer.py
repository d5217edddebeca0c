"""The front in a notebook: members are clicked and brushed; without the packages for it the pictures stand still."""

import sys

import pytest

from scenarios.errors import InputError
from tests.test_tuning.findings_by_hand import VALUES, evaluations, findings
from tuning import explorer
from tuning.report_interactive import front_plot, parallel_plot

needs_plotly = pytest.mark.skipif(not explorer.available(), reason="plotly, the extra `report`, is not installed")
needs_widgets = pytest.mark.skipif(not explorer.clickable(), reason="anywidget, the extra `explore`, is not installed")


def click(picker, name, index):
    """As the browser tells of it: the trace's number and the point's."""
    plot = picker._shown.children[0]
    trace = [trace.name for trace in plot.data].index(name)
    device = {"alt": False, "ctrl": False, "meta": False, "shift": False, "button": 0, "buttons": 1}
    plot._js2py_pointsCallback = {
        "event_type": "plotly_click", "device_state": device, "selector": None,
        "points": {"trace_indexes": [trace], "point_indexes": [index], "xs": [0.0], "ys": [0.0]},
    }  # fmt: skip


@needs_widgets
def test_a_click_on_a_member_makes_it_the_picked_one_and_shows_it():
    shown = []
    picker = explorer.MemberPicker(findings(), evaluations(), shown.append)
    assert picker.member == 1
    click(picker, "front", 1)
    assert picker.member == 3
    click(picker, "recommended", 0)
    click(picker, "held out", 0)
    assert shown == [3, 1, 2]
    assert picker._shown.children[1].value == "<b>Member 2</b>"


@needs_widgets
def test_a_click_on_the_default_picks_nothing_and_candidates_take_no_clicks():
    shown = []
    picker = explorer.MemberPicker(findings(), evaluations(), shown.append)
    click(picker, "default constants", 0)
    (candidates,) = (trace for trace in picker._shown.children[0].data if trace.name == "candidates")
    assert (candidates.hoverinfo, candidates.hovertemplate) == ("skip", None)
    assert (picker.member, shown) == (1, [])
    assert picker._shown.children[1].value == explorer.DEFAULT_CLICKED


@needs_widgets
def test_what_fails_while_a_member_is_shown_is_told_below_the_plot(capsys):
    def fail(number):
        raise ValueError(f"no member {number}")

    picker = explorer.MemberPicker(findings(), evaluations(), fail)
    with pytest.raises(ValueError, match="no member 2"):  # outside a notebook; there it is an output
        click(picker, "front", 0)
    assert picker.member == 2


@needs_widgets
def test_brushed_ranges_list_the_members_that_pass_in_all_of_them():
    plot, table = explorer.brush_members(findings()).children
    plot._js2py_restyle = {"source_view_id": None, "style_traces": 0,
                           "style_data": {"dimensions[1].constraintrange": [[0.0, 0.35]]}}  # fmt: skip
    rows = [row.split("</th>")[0] for row in table.value.split('<th scope="row">')[1:]]
    assert rows == ["1", "3", "default"]
    plot._js2py_restyle = {"source_view_id": None, "style_traces": 0,
                           "style_data": {"dimensions[1].constraintrange": [[0.32, 0.33]]}}  # fmt: skip
    assert table.value == explorer.NONE_PASSES


@needs_plotly
@pytest.mark.parametrize(("ranges", "members"), [
    ({}, [1, 2, 3]),
    ({1: (0.0, 0.35)}, [1, 3]),  # VALUES[4:7, 0]: 0.3125, 0.4, 0.05
    ({1: [(0.0, 0.1), (0.35, 0.5)]}, [2, 3]),  # two ranges of one axis: either
    ({1: (0.0, 0.35), 0: (2, 3)}, [3]),  # of two axes: both
    ({0: (-0.5, 0.5)}, []),  # the default is no member
])  # fmt: skip
def test_a_member_passes_where_every_brushed_axis_lets_it(ranges, members):
    dimensions = parallel_plot(findings()).data[0].dimensions
    for axis, kept in ranges.items():
        dimensions[axis].constraintrange = kept
    assert explorer.passing(dimensions) == members


def test_without_plotly_the_pictures_stand_still_and_the_recommended_member_is_picked(monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly", None)  # as if it were not installed
    shown = []
    picker = explorer.MemberPicker(findings(), evaluations(), shown.append)
    assert picker.member == 1
    picker.choose(2)
    assert (picker.member, shown) == (2, [2])
    with pytest.raises(InputError, match=r"^member: 4; must be from 1 to 3; choose one of them$"):
        picker.choose(4)
    assert [text.get_text() for text in picker._shown.axes[0].texts] == ["1", "2", "3"]
    assert explorer.brush_members(findings()).axes[0].get_xlabel() == ""


@needs_plotly
def test_without_anywidget_a_point_names_its_member_and_axes_can_be_brushed(monkeypatch):
    monkeypatch.setattr(explorer, "clickable", lambda: False)
    plot = explorer.MemberPicker(findings(), evaluations())._shown
    assert plot.to_json() == front_plot(findings(), evaluations()).to_json()
    texts = {trace.name: trace.text for trace in plot.data}
    assert [text.split("<br>")[0] for text in (*texts["front"], *texts["recommended"])] == [
        "member 2", "member 3", "member 1"]  # fmt: skip
    (lines,) = explorer.brush_members(findings()).data
    assert list(lines.dimensions[0]["values"]) == [1, 2, 3, 0]
    assert list(lines.dimensions[0].ticktext) == ["default", "★ 1 recommended", "2", "3"]
    assert list(lines.dimensions[1]["values"]) == [*VALUES[[4, 5, 6, 0], 0]]
    assert lines.dimensions[4].label == "success rate [%]"
