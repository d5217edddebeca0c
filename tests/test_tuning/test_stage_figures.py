import jax
import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle, Rectangle

from adwa_jax.astar import SearchResult
from adwa_jax.presets import paper
from adwa_jax.rollout import RobotState
from scenarios.drawing import new_figure
from scenarios.generators import toy
from tuning.stage_figures import (
    decision_figure,
    density_figure,
    draw_candidates,
    draw_terms,
    draw_window,
    expansion_figure,
    weight_figure,
)
from tuning.stages import TERMS, Densities, Moment

SCENARIO = toy.generate(jax.random.key(0), toy.ToySpec(drawing="S..o\n.##.\n>.oG"))  # start (0.5, 2.5), goal (3.5, 0.5)
ROBOT = paper().constants.robot
OCCUPIED = np.array([[0, 0, 0, 0], [0, 1, 1, 0], [0, 0, 0, 0]], bool)
DENSITIES = Densities(np.full((3, 4), 0.1), 0.2, np.where(np.arange(4) < 1, 0.8, np.where(np.arange(4) < 3, 1.0, 1.4))
                      * np.ones((3, 1)))  # fmt: skip


def moment_of(admissible=((True, False), (True, True)), chosen=(1, 0), target=(3.5, 0.5), movers=1):
    """Two speeds, two yaw rates, two predicted points; the score grows with the index."""
    ahead = np.array([0.0, 0.2, 0.4])[:, None, None]
    speed = np.array([0.5, 1.0])[None, :, None]
    aside = np.array([-0.1, 0.1])[None, None, :]
    arcs = np.stack([0.5 + ahead * speed + 0 * aside, 2.0 + ahead * speed * aside], axis=-1)
    ways = np.stack([np.array([[0.5 + step, 0.5]] * movers).reshape(movers, 2) for step in (0.0, 0.1, 0.2)])
    score = np.arange(4.0).reshape(2, 2)
    return Moment(time=1.5, robot=RobotState(*map(np.float32, (0.5, 2.0, 0.0, 0.5, 0.0))), target=np.array(target),
                  square_known=np.array([True, False]), movers=ways, v=np.array([0.5, 1.0]),
                  yaw_rate=np.array([-0.5, 0.5]), arcs=arcs, admissible=np.array(admissible), score=score,
                  terms={name: 0.25 * score for name in TERMS.values()}, chosen=chosen)  # fmt: skip


def the(ax, label):
    (line,) = (line for line in ax.lines if line.get_label() == label)
    return line


def labels(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def field_of(figure):
    """The values drawn over the map, which is drawn before them."""
    return figure.axes[0].images[1].get_array()


def test_density_is_shown_beside_the_maps_over_the_free_cells():
    figure = density_figure(SCENARIO, DENSITIES, cell=(2, 0))
    assert field_of(figure).mask.tolist() == OCCUPIED.tolist()
    np.testing.assert_allclose(field_of(figure).compressed(), 0.5)
    assert figure.axes[1].get_ylabel() == "density to the goal ÷ map's, P/Q [1]"
    assert figure.axes[0].get_title() == "Obstacle density; Q = 0.200"


def test_a_cells_rectangle_spans_it_and_the_goal():
    (outline,) = (patch for patch in density_figure(SCENARIO, DENSITIES, cell=(1, 3)).axes[0].patches
                  if isinstance(patch, Rectangle))  # fmt: skip
    assert outline.get_bbox().bounds == (3.0, 0.0, 1.0, 2.0)
    assert outline.get_label() == "a cell's rectangle: P/Q = 0.50"


def test_weights_below_and_above_1_carry_signs():
    ax = weight_figure(SCENARIO, DENSITIES).axes[0]
    assert the(ax, "dense, ω < 1").get_xydata().tolist() == [[0.5, 0.5], [0.5, 1.5], [0.5, 2.5]]
    assert the(ax, "sparse, ω > 1").get_xydata().tolist() == [[3.5, 0.5], [3.5, 1.5], [3.5, 2.5]]
    assert ax.get_title() == "Heuristic weight; ω < 1 in 30 %, ω > 1 in 30 % of the free cells"


def search_of(cells, order):
    pad = np.repeat(cells[-1:], 2, axis=0)
    return SearchResult(np.int32(0), np.concatenate([cells, pad]), np.int32(len(cells)), np.int32(3), np.int32(1),
                        np.int32(3), np.pad(order, ((0, 2), (0, 1)), constant_values=-1))  # fmt: skip


def test_expansions_are_numbered_from_1_and_the_rest_is_white():
    order = np.full((3, 4), -1)
    order[2, 0], order[2, 1], order[0, 3] = 0, 1, 2
    figure = expansion_figure(SCENARIO.grid, search_of(np.array([[2, 0], [2, 1], [0, 3]]), order), "mine")
    shown = field_of(figure)
    assert shown.compressed().tolist() == [3.0, 1.0, 2.0]
    assert the(figure.axes[0], "grid path").get_xydata().tolist() == [[0.5, 2.5], [1.5, 2.5], [3.5, 0.5]]
    assert figure.axes[0].get_title() == "mine: 3 of 10 free cells expanded, path 4.41 m"


def test_searches_to_be_compared_have_one_scale():
    order = np.full((3, 4), -1)
    order[2, 0], order[2, 1] = 0, 1
    found = search_of(np.array([[2, 0], [2, 1]]), order)
    assert expansion_figure(SCENARIO.grid, found, most=9).axes[0].images[1].get_clim() == (1.0, 9.0)
    assert expansion_figure(SCENARIO.grid, found).axes[0].images[1].get_clim() == (1.0, 2.0)


def test_candidates_are_coloured_by_score_with_the_best_on_top():
    ax = draw_candidates(SCENARIO, moment_of(), ROBOT)
    arcs = {lines.get_label(): lines for lines in ax.collections if isinstance(lines, LineCollection)}
    assert arcs["admissible, by score"].get_array().tolist() == [0.0, 2.0, 3.0]
    assert arcs["admissible, by score"].get_segments()[-1].tolist() == moment_of().arcs[:, 1, 1].tolist()
    assert len(arcs["inadmissible"].get_segments()) == 1
    np.testing.assert_allclose(the(ax, "chosen").get_xydata(), moment_of().arcs[:, 1, 0])
    assert ax.get_title() == "1.5 s: 3 of 4 candidates admissible"


def test_the_legend_shows_scored_candidates_in_a_colour_that_they_have():
    ax = draw_candidates(SCENARIO, moment_of(), ROBOT)
    (entry,) = [handle for handle, label in zip(ax.get_legend().legend_handles, labels(ax), strict=True)
                if label == "admissible, by score"]  # fmt: skip
    (drawn,) = [lines for lines in ax.collections if lines.get_label() == "admissible, by score"]
    assert entry.get_color() == drawn.get_cmap()(0.5)


def test_robot_and_movers_are_drawn_to_scale_and_movers_also_where_they_are_expected():
    ax = draw_candidates(SCENARIO, moment_of(), ROBOT)
    discs = {patch.get_label(): patch for patch in ax.patches if isinstance(patch, Circle)}
    assert discs["robot"].get_center() == (0.5, 2.0)
    assert discs["robot"].get_radius() == ROBOT.radius
    assert discs["mover"].get_center() == pytest.approx((0.5, 0.5))
    assert discs["mover at the horizon"].get_center() == pytest.approx((0.7, 0.5))


def test_what_is_out_of_the_picture_is_not_in_the_legend():
    ax = draw_candidates(SCENARIO, moment_of(target=(9.0, 0.5), movers=0), ROBOT)
    assert "mover" not in labels(ax)
    assert "local target" not in labels(ax)
    assert "to the local target" in labels(ax)


def test_the_window_shows_left_turns_on_the_left():
    ax = draw_window(moment_of())
    assert ax.xaxis_inverted()
    assert the(ax, "chosen").get_xydata().tolist() == [[-0.5, 1.0]]
    assert the(ax, "velocity now").get_xydata().tolist() == [[0.0, 0.5]]
    assert ax.get_xlabel() == "yaw rate [rad/s], to the left > 0"


def test_bars_are_the_chosen_candidates_terms_and_whiskers_span_the_admissible_ones():
    ax = draw_terms(moment_of())
    assert [bar.get_width() for bar in ax.patches] == [0.5] * 4
    (segments,) = (lines.get_segments() for lines in ax.collections)
    assert [segment[:, 0].tolist() for segment in segments] == [[0.0, 0.75]] * 4
    assert [text.get_text() for text in ax.get_yticklabels()] == list(TERMS.values())


def test_a_moment_without_an_admissible_candidate_is_drawn():
    figure = decision_figure(SCENARIO, moment_of(np.zeros((2, 2), bool), None), ROBOT)
    assert figure.axes[0].get_title() == "1.5 s: 0 of 4 candidates admissible"
    assert "chosen" not in labels(figure.axes[0])
    assert not figure.axes[2].patches
    figure.canvas.draw()


def test_axes_that_are_given_are_drawn_on():
    axes = new_figure((6.0, 6.0)).subplots(3, 2).ravel()
    order = np.zeros((3, 4), int)
    density_figure(SCENARIO, DENSITIES, ax=axes[0])
    weight_figure(SCENARIO, DENSITIES, ax=axes[1])
    expansion_figure(SCENARIO.grid, search_of(np.array([[2, 0], [0, 3]]), order), ax=axes[2])
    drawn = [draw_candidates(SCENARIO, moment_of(), ROBOT, axes[3]), draw_window(moment_of(), axes[4]),
             draw_terms(moment_of(), axes[5])]  # fmt: skip
    assert drawn == list(axes[3:])
    assert all(ax.has_data() for ax in axes)
    axes = new_figure((9.0, 3.0)).subplots(1, 3)
    assert decision_figure(SCENARIO, moment_of(), ROBOT, axes=axes).axes[:3] == axes.tolist()
    assert all(ax.has_data() for ax in axes)


def test_a_map_that_counts_rows_downwards_is_drawn_so():
    assert density_figure(SCENARIO, DENSITIES, y_down=True).axes[0].get_ylim() == (3.0, 0.0)
    low, high = draw_candidates(SCENARIO, moment_of(), ROBOT, y_down=True).get_ylim()
    assert low > high
