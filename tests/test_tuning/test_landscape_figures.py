import numpy as np
import pytest

from adwa_jax.presets import paper
from scenarios.drawing import new_figure
from tuning.findings import Interval
from tuning.landscape import lattice
from tuning.landscape_figures import (
    Arrows,
    intervals_figure,
    landscape_figure,
    smoothed_figure,
    softened_figure,
    temperature_figure,
)
from tuning.search_slope import smoothed
from tuning.softened import Softened
from tuning.space import Parameter, Space

SPACE = Space((Parameter("clearance", 0.0, 1.0), Parameter("velocity", 0.0, 2.0)), paper())
UNIT = lattice(3)
ARROWS = Arrows(np.array([[0.5, 0.5]]), np.array([[3.0, 4.0]]), np.array([[0.0, -2.0]]))
SOME = {"this": Interval(0.5, 0.2, 0.9), "that": Interval(-0.3, -0.8, 0.1)}
SOFTENED = Softened(np.array([0.01, 0.1]), np.array([0.2, 0.4]), np.array([-1.0, 1.0]),
                    np.array([[[0.0, 1.0], [0.0, 0.0]], [[0.25, 0.25], [0.25, 0.25]]]), "clearance",
                    np.array([0.0, 1.0]), 0.3, np.array([[0.2, 1.0], [0.2, -1.0]]),
                    np.array([[[0.2, 0.9], [0.2, -0.9]], [[0.3, 0.1], [0.3, 0.0]]]))  # fmt: skip
STEPPED = smoothed(np.linspace(0.0, 2.0, 21), np.stack([np.arange(21.0) // 5, np.zeros(21)]), 0.3)


def the(ax, label):
    (line,) = (line for line in ax.lines if line.get_label() == label)
    return line


def test_a_landscape_is_drawn_over_the_constants_with_its_least_and_the_preset():
    losses = np.arange(9.0)[::-1]
    hard, relaxed = landscape_figure(SPACE, UNIT, losses, 2.0 * losses).axes[:2]
    assert hard.collections[0].get_array().ravel().tolist() == losses.tolist()
    assert relaxed.collections[0].get_array().ravel().tolist() == (2.0 * losses).tolist()
    for ax in (hard, relaxed):
        assert the(ax, "least of the lattice").get_xydata().tolist() == pytest.approx(np.array([[5 / 6, 5 / 3]]))
        assert the(ax, "constants of the preset").get_xydata().tolist() == [[0.3, 0.8]]
        assert (ax.get_xlabel(), ax.get_ylabel()) == ("weight clearance [1]", "weight velocity [1]")


def test_arrows_point_downhill_and_have_one_length():
    ax = landscape_figure(SPACE, UNIT, np.arange(9.0), np.arange(9.0), ARROWS).axes[0]
    down = {arrows.get_label(): (arrows.U[0], arrows.V[0]) for arrows in ax.collections if hasattr(arrows, "U")}
    assert down["downhill by the hard gradient"] == pytest.approx((-0.6, -0.8))
    assert down["downhill by the surrogate's gradient"] == pytest.approx((0.0, 1.0))


def test_intervals_stand_beside_chance():
    ax = intervals_figure(SOME, "mean cosine [1]").axes[0]
    assert [text.get_text() for text in ax.get_yticklabels()] == ["this", "that"]
    assert the(ax, "chance").get_xdata() == [0.0, 0.0]
    assert [segment[:, 0].tolist() for segment in ax.containers[0].lines[2][0].get_segments()] == [
        pytest.approx([0.2, 0.9]), pytest.approx([-0.8, 0.1])]  # fmt: skip


def test_agreement_is_shown_over_the_temperature():
    ax = temperature_figure((0.01, 0.1), list(SOME.values()), list(SOME.values())[::-1]).axes[0]
    assert ax.get_xscale() == "log"
    shown = {bars.get_label(): bars.lines[0].get_ydata().tolist() for bars in ax.containers}
    assert shown == {"mean cosine, 95 % interval": [0.5, -0.3], "share of signs that agree, 95 % interval": [-0.3, 0.5]}


def test_a_softened_decision_shows_shares_their_mean_and_the_command_over_the_weight():
    cold, warm, command = softened_figure(SOFTENED).axes[:3]
    assert the(cold, "mean of the shares").get_xydata().tolist() == [[1.0, 0.2]]
    assert the(warm, "mean of the shares").get_xydata().tolist() == pytest.approx(np.array([[0.0, 0.3]]))
    assert cold.collections[0].get_array().tolist() == [[0.0, 1.0], [0.0, 0.0]]
    assert warm.get_title() == "temperature 0.1, largest share 25.0%"
    assert the(command, "hard planner").get_ydata().tolist() == [1.0, -1.0]
    assert the(command, "temperature 0.1").get_ydata().tolist() == [0.1, 0.0]
    assert command.get_ylabel() == "yaw rate commanded [rad/s]"


def test_a_smoothed_search_shows_one_map_and_the_slope_of_all():
    one, every = smoothed_figure(STEPPED).axes
    assert the(one, "expansions on one map").get_ydata().tolist() == STEPPED.each[0].tolist()
    assert the(one, "mean over ω ± 0.3").get_ydata().tolist() == STEPPED.mean[0].tolist()
    assert the(every, "slope, mean over the maps").get_ydata().tolist() == (STEPPED.slope[0] / 2).tolist()


def test_axes_that_are_given_are_drawn_on():
    axes = new_figure((9.0, 9.0)).subplots(3, 3).ravel()
    landscape_figure(SPACE, UNIT, np.arange(9.0), np.arange(9.0), ARROWS, axes[:2])
    intervals_figure(SOME, "mean cosine [1]", ax=axes[2])
    temperature_figure((0.01, 0.1), list(SOME.values()), list(SOME.values()), axes[3])
    softened_figure(SOFTENED, axes[4:7])
    smoothed_figure(STEPPED, axes=axes[7:])
    assert all(ax.has_data() for ax in axes)
    assert [place for place, ax in enumerate(axes) if ax.get_legend() is not None] == [1, 2, 3, 6, 8]
    assert not axes[0].get_figure().legends
    axes[0].get_figure().canvas.draw()
