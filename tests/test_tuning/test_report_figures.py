from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from scenarios.drawing import new_figure
from tests.test_tuning.findings_by_hand import GOALS, PARAMETERS, VALUES, agreement, evaluations, findings
from tuning.analysis import chosen_by_hand
from tuning.evaluations import Evaluations
from tuning.objectives import Constraint, Goals, Statistic
from tuning.report_figures import (
    agreement_figure,
    axis_label,
    front_figure,
    hypervolume_figure,
    importance_figure,
    in_units,
    line_colours,
    optimism_figure,
    parallel_figure,
    parallel_table,
    stability_figure,
    sweep_figure,
    sweeps,
    view_of,
)


@pytest.fixture(scope="module")
def training():
    return evaluations()


def labels(figure):
    return [(ax.get_xlabel(), ax.get_ylabel()) for ax in figure.axes]


def drawn_points(ax, label):
    return np.concatenate([line.get_xydata() for line in ax.lines if line.get_label() == label])


def test_labels_name_the_unit_and_what_is_better():
    assert axis_label(Statistic("success", "max")) == "success rate [%], more is better"
    assert axis_label(Statistic("time", "min", 0.1)) == "time (worst 10%) [s], less is better"
    assert axis_label(Statistic("length_ratio", "min")) == "length ratio [1], less is better"
    assert in_units(Statistic("collision", "min"), 0.25) == 25.0
    assert in_units(Statistic("time", "min"), 0.25) == 0.25


def test_the_front_is_drawn_for_every_pair_of_objectives_with_default_and_recommended(training):
    found = findings()
    figure = front_figure(found, training)
    assert len(figure.axes) == 6
    first = figure.axes[0]
    assert labels(figure)[0] == ("success rate [%], more is better", "length ratio [1], less is better")
    best = found.front[0].training.objectives
    np.testing.assert_allclose(drawn_points(first, "recommended"), [[100 * best[0].value, best[1].value]])
    assert len(drawn_points(first, "front")) == 3
    assert len(drawn_points(first, "the same, held out")) == 5  # three of the front, the recommended again, the default
    assert len(drawn_points(first, "candidate")) == len(VALUES) - 1  # the last was dropped half way


def test_without_held_out_and_candidates_the_front_stands_alone():
    drawn = front_figure(findings(held_out=False)).axes[0]
    assert {line.get_label() for line in drawn.lines} == {"front", "default constants", "recommended"}


def test_rates_are_marked_up_to_100_percent_and_their_axes_end_there_but_for_a_marker():
    for rates in ([0.0, 100.0], [96.0, 100.0], [100.0, 100.0], [99.7, 99.9]):
        low, high = view_of(Statistic("success", "max"), np.array(rates))
        assert low <= min(rates)
        assert max(rates) < high < 100 + 0.1 * (high - low)
    found = findings()
    best = found.default.training.objectives
    objectives = (best[0]._replace(value=1.0), *best[1:])
    perfect = replace(found.default, training=replace(found.default.training, objectives=objectives))
    for ax in front_figure(replace(found, default=perfect)).axes[:3]:
        assert ax.get_xlim()[1] > 100
        assert 95 < max(ax.get_xticks()) <= 100


def test_candidates_beyond_the_view_are_left_out_and_those_within_are_whole(training):
    values = training.columns["length_ratio"].copy()
    values[3] += 9.0
    strayed = replace(training, columns=training.columns | {"length_ratio": values})
    for ax in front_figure(findings(), strayed).axes:
        (drawn,) = [line for line in ax.lines if line.get_label() == "candidate"]
        points = drawn.get_xydata()[np.isfinite(drawn.get_xydata()).all(axis=1)]
        low, high = np.array([ax.get_xlim(), ax.get_ylim()]).T
        assert len(points)
        assert ((points >= low) & (points <= high)).all()
        assert not drawn.get_clip_on()


def test_the_lines_of_members_are_dark_enough_for_white_paper():
    channels = np.array([[int(colour[place : place + 2], 16) for place in (1, 3, 5)] for colour in line_colours()])
    lightness = channels @ [0.299, 0.587, 0.114] / 255
    assert lightness.max() < 0.65
    assert (np.diff(lightness) > -0.01).all()


def test_numbered_members_carry_the_numbers_of_the_tables():
    found = findings()
    twins = replace(found, front=(*found.front, found.front[0]))
    for ax in front_figure(twins, numbered=True).axes:
        assert [text.get_text() for text in ax.texts] == ["1, 4", "2", "3"]


def test_members_numbers_hide_neither_each_other_nor_the_star_and_the_square():
    figure = front_figure(findings(held_out=False), numbered=True)
    figure.draw_without_rendering()
    for ax in figure.axes:
        texts = [text.get_window_extent() for text in ax.texts]
        marks = [ax.transData.transform(drawn_points(ax, label)[0]) for label in ("recommended", "default constants")]
        assert not any(one.overlaps(other) for k, one in enumerate(texts) for other in texts[k + 1 :])
        assert not any(text.contains(*mark) for text in texts for mark in marks)


def test_a_member_chosen_by_hand_is_drawn_as_chosen():
    found = chosen_by_hand(findings(), 2, evaluations(seed=1), np.arange(len(VALUES)), 0)
    third = found.front[2].training.objectives
    drawn = drawn_points(front_figure(found).axes[0], "chosen")
    np.testing.assert_allclose(drawn, [[100 * third[0].value, third[1].value]])


def test_parallel_coordinates_have_the_default_last_and_units():
    found = findings()
    names, table = parallel_table(replace(found, parameters=("clearance_cap", *PARAMETERS[1:])))
    assert names[0] == "clearance cap [m]"
    np.testing.assert_array_equal(table[:, :3], VALUES[[4, 5, 6, 0]])
    assert table[-1, 3] == 100 * found.default.training.success.value


def test_stability_has_a_row_a_rule_and_frames_what_each_picks():
    ax = stability_figure(findings()).axes[0]
    assert [tick.get_text() for tick in ax.get_yticklabels()] == ["not dominated", "knee", "constraint"]
    assert [tick.get_text() for tick in ax.get_xticklabels()] == ["1", "2", "3"]
    assert [text.get_text() for text in ax.texts] == ["90", "80", "30", "70", "20", "10", "25", "35", "30"]
    frames = [patch.get_xy() for patch in ax.patches]
    assert frames == [(-0.5, 0.5), (0.5, 1.5)]  # knee: member 1; constraint: member 2
    by_hand = chosen_by_hand(findings(), 2, None, np.array([]), 0)
    assert len(stability_figure(by_hand).axes[0].get_yticklabels()) == 3


def test_one_objective_alone_is_drawn_by_candidate(training):
    found = findings()
    alone = type(found)(**vars(found) | {"goals": Goals(GOALS.objectives[:1])})
    (ax,) = front_figure(alone, training).axes
    assert ax.get_ylabel() == "success rate [%], more is better"
    np.testing.assert_allclose(drawn_points(ax, "recommended"), [[4, 100 * found.front[0].training.success.value]])


def test_parallel_coordinates_run_from_the_least_to_the_most_of_what_is_shown():
    ax = parallel_figure(findings()).axes[0]
    assert [tick.get_text() for tick in ax.get_xticklabels()][:4] == [
        "clearance", "local heading", "progress", "success rate [%]"]  # fmt: skip
    texts = [text.get_text() for text in ax.texts]
    assert texts[:2] == ["0.4", "0.05"]  # clearance of rows 0, 4, 5, 6: 0.1, 0.3125, 0.4, 0.05
    default = drawn_points(ax, "default constants")
    assert default[0, 1] == pytest.approx((0.1 - 0.05) / 0.35)


def test_a_sweep_is_found_where_one_parameter_varies_alone(training):
    (sweep,) = sweeps(training)
    assert PARAMETERS[sweep.parameter] == "clearance"
    assert sweep.rows.tolist() == [1, 0, 2, 3]  # 0.0, 0.1 (the default), 0.2, 0.3


def test_a_sweep_about_a_default_out_of_range_is_found_at_the_end_of_the_range():
    values = np.array([[0.1, 2.0], [0.0, 1.0], [0.5, 1.0], [0.9, 1.0], [0.1, 0.0], [0.1, 0.5], [0.1, 1.0]])
    done = np.ones((7, 1), bool)
    curves = sweeps(Evaluations(("a", "b"), values, np.zeros(7, np.int32), {}, done))
    assert [curve.rows.tolist() for curve in curves] == [[1, 6, 2, 3], [4, 5, 6, 0]]


def test_random_candidates_are_no_sweep():
    values = np.random.default_rng(0).random((9, 3))
    assert sweeps(Evaluations(PARAMETERS, values, np.zeros(9, np.int32), {}, np.ones((9, 1), bool))) == []


def test_sweeps_have_a_row_a_parameter_and_a_column_an_objective_with_intervals(training):
    figure = sweep_figure(GOALS, training, sweeps(training))
    assert [across for across, _ in labels(figure)] == ["clearance"] * 4
    assert [up for _, up in labels(figure)] == [
        "success rate [%]", "length ratio [1]", "breaking points [1]", "danger points [1]"]  # fmt: skip
    for ax in figure.axes:
        (curve, default) = ax.lines
        (band,) = ax.collections
        low, high = band.get_datalim(ax.transData).intervaly
        assert low < curve.get_ydata().min()
        assert high > curve.get_ydata().max()
        assert default.get_xdata()[0] == 0.1


def test_axes_that_are_given_are_drawn_on(training):
    axes = new_figure((9.0, 12.0)).subplots(4, 4)
    front_figure(findings(), training, axes=axes.ravel()[:6])
    optimism_figure(findings(), axes[2])
    sweep_figure(GOALS, training, sweeps(training), axes[3])
    one = Goals(GOALS.objectives[:1])
    judged = [replace(member, training=replace(member.training, objectives=member.training.objectives[:1]),
                      held_out=None) for member in (findings().default, *findings().front)]  # fmt: skip
    front_figure(replace(findings(), goals=one, default=judged[0], front=tuple(judged[1:])), training, axes=axes[1, 2])
    assert [ax.has_data() for ax in axes.ravel()] == [True] * 7 + [False] + [True] * 8
    assert not axes[0, 0].get_figure().legends
    labels = [text.get_text() for text in axes[1, 1].get_legend().get_texts()]  # of the front's last panel
    assert sorted(labels) == sorted({"candidate", "front", "default constants", "recommended", "the same, held out"})


def test_candidates_that_break_a_constraint_are_crosses(training):
    found = replace(findings(), goals=replace(GOALS, constraints=(Constraint(Statistic("success", "max"), 0.9),)))
    ax = front_figure(found, training).axes[0]
    whole = training.complete
    rate = 100 * (training.columns["outcome"][whole] == 0).mean(axis=1)
    (dots,), (crosses,) = ([line for line in ax.lines if line.get_label() == kind]
                           for kind in ("candidate", "breaks a constraint"))  # fmt: skip
    for line, expected in ((dots, rate >= 90), (crosses, rate < 90)):
        shown = line.get_xdata()[np.isfinite(line.get_xdata())]
        assert set(shown) <= set(rate[expected])
        assert len(shown)


def test_hypervolume_holds_its_value_until_the_next_generation():
    ax = new_figure((4, 3)).subplots()
    hypervolume_figure(findings().hypervolume, ax)
    assert ax.lines[0].get_drawstyle() == "steps-post"
    np.testing.assert_array_equal(ax.lines[0].get_xydata(), [[40, 0.1], [160, 0.25], [300, 0.4]])


def test_importance_is_written_in_percent_into_every_cell():
    ax = importance_figure(findings()).axes[0]
    assert [text.get_text() for text in ax.texts] == [
        "50",
        "80",
        "10",
        "90",
        "10",
        "5",
        "20",
        "0",
        "20",
        "10",
        "5",
        "2",
    ]


def test_optimism_shows_training_against_held_out():
    found = findings()
    figure = optimism_figure(found)
    assert len(figure.axes) == 4
    success = figure.axes[0]
    assert success.get_xlabel() == "training: success rate [%]"
    assert success.get_title() == "more is better"
    containers = {container.get_label(): container for container in success.containers}
    default = found.default
    np.testing.assert_allclose(
        containers["default constants"].lines[0].get_xydata(),
        [[100 * default.training.success.value, 100 * default.held_out.success.value]],
    )


def test_agreement_has_a_place_a_start():
    ax = agreement_figure(agreement(3)).axes[0]
    assert [tick.get_text() for tick in ax.get_xticklabels()] == ["1", "2", "3"]
    (signs,) = [line for line in ax.lines if line.get_label() == "share of signs that agree"]
    np.testing.assert_allclose(signs.get_ydata(), 2 / 3)
    (chance,) = [line for line in ax.lines if line.get_label() == "signs that agree by chance"]
    assert set(chance.get_ydata()) == {0.5}
    assert ax.get_ylabel() == "agreement [1]"


def test_what_is_not_known_is_drawn_as_nothing_rather_than_refused():
    found = findings(held_out=False)
    nan = np.full_like(found.importance, np.nan)
    figure = importance_figure(type(found)(**vars(found) | {"importance": nan}))
    assert {text.get_text() for text in figure.axes[0].texts} == {"–"}
    assert isinstance(optimism_figure(found), Figure)


def test_figures_drawn_on_given_axes_keep_their_legends_apart_and_below_their_own_labels():
    figure = new_figure((12.0, 8.0))
    axes = figure.subplots(2, 2)
    for ax in axes[0]:
        parallel_figure(findings(), ax)
    for ax in axes[1]:
        agreement_figure(agreement(3), ax=ax)
    figure.draw_without_rendering()
    assert not figure.legends
    legends = [ax.get_legend().get_window_extent() for ax in axes.flat]
    plots = [ax.get_window_extent() for ax in axes.flat] + [ax.xaxis.get_tightbbox() for ax in axes.flat]
    assert not any(one.overlaps(other) for k, one in enumerate(legends) for other in (*legends[k + 1 :], *plots))
