import numpy as np
import pytest

from scenarios.drawing import new_figure
from tests.test_tuning.test_table1 import MAPS
from tuning.search_figures import draw_tradeoff, table1_figure, verdict_figure, weight_study_figure
from tuning.search_study import Tradeoff
from tuning.table1 import PAPER_TABLE, QUANTITIES


def tradeoff(expansions, length):
    return Tradeoff((expansions, expansions - 0.1, expansions + 0.1), (length, length, length + 0.01), 0.5, 0.5)


CONSTANT = {0.0: tradeoff(3.0, 1.0), 0.01: tradeoff(2.99, 1.0), 1.0: tradeoff(1.0, 1.0), 2.0: tradeoff(0.4, 1.05)}
SHAPES = {"eq. 5": tradeoff(1.4, 1.01)}


def the(ax, label):
    (line,) = (line for line in ax.lines if line.get_label() == label)
    return line


def test_table_1_has_a_panel_a_quantity_with_means_and_the_papers_map():
    figure = table1_figure({15: MAPS, 20: MAPS})
    assert [ax.get_ylabel() for ax in figure.axes] == ["path length [m]", "breaking points [1]", "danger points [1]"]
    for ax, place in zip(figure.axes, range(len(QUANTITIES)), strict=True):
        printed = [PAPER_TABLE[size][place][0] for size in (15, 20)]
        assert the(ax, "improved A*, the paper's map").get_ydata().tolist() == printed
    means = {bar.get_label(): bar.lines[0].get_ydata() for bar in figure.axes[1].containers}
    assert means["improved A*, mean of many maps"] == pytest.approx([2.25, 2.25])
    assert means["traditional A*, mean of many maps"] == pytest.approx([2.25, 2.25])
    assert figure.axes[0].get_xticklabels()[1].get_text() == "20 × 20\n4 maps"
    assert all(ax.get_ylim()[0] < 0 for ax in figure.axes)  # so that a mean of 0 is not cut in half


def test_verdicts_are_stacked_to_100_percent():
    ax = verdict_figure({"some": MAPS}).axes[0]
    widths = np.array([[bar.get_width() for bar in bars] for bars in ax.containers])
    assert widths.sum(axis=0) == pytest.approx([100.0] * 3)
    assert widths[:, 2] == pytest.approx([75.0, 25.0, 0.0])
    assert [text.get_text() for text in ax.get_yticklabels()] == [
        "path length, some", "breaking points, some", "danger points, some"]  # fmt: skip


def test_what_omega_does_is_shown_over_omega_and_as_a_tradeoff():
    figure = weight_study_figure(CONSTANT, SHAPES)
    searched, found, both = figure.axes
    assert the(searched, "constant ω").get_xydata().tolist() == [[0.0, 3.0], [0.01, 2.99], [1.0, 1.0], [2.0, 0.4]]
    assert the(found, "constant ω").get_ydata().tolist() == [1.0, 1.0, 1.0, 1.05]
    assert the(both, "eq. 5").get_xydata().tolist() == [[1.4, 1.01]]
    assert searched.get_ylabel() == "expansions ÷ those of ω = 1 [1]"
    assert found.get_ylabel() == "path length ÷ that of ω = 1 [1]"


def test_labels_that_would_run_into_each_other_are_left_out():
    ax = draw_tradeoff(CONSTANT, SHAPES)
    assert {text.get_text() for text in ax.texts} == {"ω = 0", "ω = 1", "ω = 2"}


def test_labels_stay_within_the_frame():
    ax = draw_tradeoff(CONSTANT, SHAPES)
    ax.figure.draw_without_rendering()
    frame = ax.get_window_extent()
    boxes = np.array([text.get_window_extent().extents for text in ax.texts])
    assert (boxes[:, :2] > (frame.x0, frame.y0)).all()
    assert (boxes[:, 2:] < (frame.x1, frame.y1)).all()


def test_axes_that_are_given_are_drawn_on():
    axes = new_figure((6.0, 6.0)).subplots(3, 3)
    table1_figure({25: MAPS}, axes[0])
    weight_study_figure(CONSTANT, SHAPES, axes[1])
    verdict_figure({"some": MAPS}, axes[2, 0])
    assert draw_tradeoff(CONSTANT, SHAPES, axes[2, 1]) is axes[2, 1]
    assert all(ax.has_data() for ax in axes.ravel()[:-1])
