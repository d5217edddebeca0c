from dataclasses import replace
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.patches import Circle, Rectangle
from PIL import Image

from adwa_jax.astar import SearchResult, Status
from adwa_jax.episode import Episode, Outcome
from adwa_jax.lanes import Trace
from adwa_jax.metrics import Measures, PlannedMeasures
from adwa_jax.obstacles import MoverStates
from adwa_jax.plan import Plan
from adwa_jax.presets import jackal
from adwa_jax.rollout import RobotState
from adwa_jax.route import Route
from scenarios.drawing import ORANGE, new_figure
from scenarios.errors import InputError
from scenarios.generators import toy
from scenarios.generators.assembly import grid_of
from tuning import animation
from tuning.animation import animate_drive
from tuning.figures import (
    MARGIN,
    Comparison,
    compare_drives,
    compare_plans,
    danger_points,
    drive_figure,
    outcome_figure,
    plan_figure,
    success_figure,
)
from tuning.intervals import wilson
from tuning.planning import PlannedPath, plan_paths, planner_constants, planner_options
from tuning.replay import Replay
from tuning.results import Results

# Two cells touch at the corner (2, 2), a third lies beside the last diagonal step, which ends at (4, 4).
GRID = grid_of(np.array([[cell == "#" for cell in row] for row in ("....", "..#.", ".#..", "..#.")]), 1.0)
CUTTING = np.array([[0, 0], [1, 1], [2, 2], [3, 3]])
AROUND = np.array([[0, 0], [0, 1], [0, 2], [0, 3], [1, 3], [2, 3], [3, 3]])


def centres(cells):
    return cells[:, ::-1].astype(np.float32) + 0.5


def planned(cells, key_cells, **measures):
    names = (*PlannedMeasures._fields,)
    return PlannedPath(start=tuple(centres(cells)[0].tolist()), goal=tuple(centres(cells)[-1].tolist()),
                       status=Status.FOUND, length=4.5, expansions=7, path=centres(cells),
                       measures={name: measures.get(name, 0) for name in names},
                       key_points=centres(key_cells), key_point_length=6.0)  # fmt: skip


TRADITIONAL = planned(CUTTING, CUTTING[[0, -1]], danger_points=2, key_point_danger_points=2)
IMPROVED = planned(AROUND, AROUND[[0, 3, 6]], breaking_points=1, key_point_breaking_points=1)


def hand_made_plan(cells, key_cells):
    """As the kernel gives it: padded beyond its counts."""
    pad = np.repeat(cells[-1:], 3, axis=0)
    search = SearchResult(np.int32(0), np.concatenate([cells, pad]).astype(np.int32), np.int32(len(cells)),
                          np.int32(0), np.int32(0), np.int32(7), np.zeros((4, 4), np.int32))  # fmt: skip
    points = centres(np.concatenate([key_cells, pad]))
    return Plan(search, np.float32(4.5), points, np.int32(len(key_cells)), np.float32(6.0),
                PlannedMeasures(*map(np.int32, (1, 2, 3, 4))), np.float32(4.2), None)  # fmt: skip


def the(ax, label):
    (line,) = (line for line in ax.lines if line.get_label() == label)
    return line


def absent(ax, label):
    return all(line.get_label() != label for line in ax.lines)


def test_rings_lie_where_diagonal_steps_pass_corners():
    # (1,1)→(2,2) goes between (1,2) and (2,1); (2,2)→(3,3) passes (3,2); (0,0)→(1,1) touches nothing.
    assert danger_points(GRID, TRADITIONAL, "path").tolist() == [[2.0, 2.0], [3.0, 3.0]]
    assert danger_points(GRID, IMPROVED, "path").tolist() == []


def test_rings_of_a_polyline_lie_at_the_corners_it_nearly_touches():
    # The straight line from corner to corner passes through (2, 2) and (3, 3), corners of occupied cells, and misses
    # the other corners by 0.7 and more.
    assert danger_points(GRID, TRADITIONAL, "key points").tolist() == [[2.0, 2.0], [3.0, 3.0]]


@pytest.mark.parametrize("planner", ["traditional", "improved"])
def test_there_are_as_many_rings_as_the_plan_counts_danger_points(planner):
    counted = 0
    for seed in range(4):
        occupied = np.random.default_rng(seed).random((12, 12)) < 0.3
        occupied[0, 0] = occupied[-1, -1] = False
        grid = grid_of(occupied, 0.5, (2.0, -3.0))
        query = np.array([[[2.25, -2.75], [7.75, 2.75]]])
        (found,) = plan_paths(grid, query, planner_constants(), planner_options(planner))
        assert len(danger_points(grid, found, "path")) == found.measures["danger_points"]
        assert len(danger_points(grid, found, "key points")) == found.measures["key_point_danger_points"]
        counted += found.measures["danger_points"]
    assert (counted > 0) == (planner == "traditional")


def test_rings_follow_resolution_and_origin():
    grid = grid_of(np.asarray(GRID.occupied), 0.25, (-1.0, 5.0))
    moved = TRADITIONAL.path * 0.25 + np.array([-1.0, 5.0], np.float32)
    points = danger_points(grid, SimpleNamespace(path=moved), "path")
    assert points.tolist() == [[-0.5, 5.5], [-0.25, 5.75]]


def test_the_comparison_rings_the_traditional_paths_danger_points_only():
    figure = compare_plans([Comparison("4 x 4", GRID, TRADITIONAL, IMPROVED)])
    left, right = figure.axes
    assert the(left, "danger point").get_xydata().tolist() == [[2.0, 2.0], [3.0, 3.0]]
    assert absent(right, "danger point")
    np.testing.assert_array_equal(the(left, "grid path").get_xydata(), TRADITIONAL.path)
    np.testing.assert_array_equal(the(right, "key-point path").get_xydata(), IMPROVED.key_points)
    assert the(right, "key point").get_xydata().tolist() == [[3.5, 0.5]]
    assert left.get_title() == "4 x 4, traditional A*\n4.50 m, 0 breaking and 2 danger points"
    assert right.get_title() == "4 x 4, improved A*\n6.00 m, 1 breaking and 0 danger points"


def test_comparisons_are_drawn_on_given_axes_with_one_legend_under_the_last():
    axes = new_figure((8.0, 8.0)).subplots(2, 2)
    compare_plans([Comparison("4 x 4", GRID, TRADITIONAL, IMPROVED)], axes[0])
    driven = Replay(SCENARIO, PLAN, episode_of(Outcome.REACHED), trace_of(), jackal())
    compare_drives({"one": driven, "other": driven}, axes=axes[1].tolist())
    assert [ax.get_title().split("\n")[0] for ax in axes[0]] == ["4 x 4, traditional A*", "4 x 4, improved A*"]
    assert [ax.get_title().split(":")[0] for ax in axes[1]] == ["one", "other"]
    assert [ax.get_legend() is not None for ax in axes.flat] == [False, True] * 2
    labels = [text.get_text() for text in axes[1, 1].get_legend().get_texts()]
    assert len(labels) == len(set(labels)) > 5
    assert not axes[0, 0].get_figure().legends


def test_other_axes_than_a_figure_has_panels_are_refused():
    axes = new_figure((8.0, 8.0)).subplots(2, 2)
    with pytest.raises(InputError, match=r"^axes: 4; this figure has 2 panels; give as many, or none$"):
        compare_plans([Comparison("4 x 4", GRID, TRADITIONAL, IMPROVED)], axes)


def test_several_maps_stand_in_columns():
    figure = compare_plans([Comparison(name, GRID, TRADITIONAL, IMPROVED) for name in "abc"])
    titles = [ax.get_title().split("\n")[0] for ax in figure.axes]
    assert titles == [f"{name}, {planner} A*" for planner in ("traditional", "improved") for name in "abc"]
    figure.canvas.draw()
    boxes = [ax.title.get_window_extent() for ax in figure.axes] + [figure.legends[0].get_window_extent()]
    assert not any(box.overlaps(other) for k, box in enumerate(boxes) for other in boxes[k + 1 :])


def test_a_plan_shows_path_turns_and_key_points():
    ax = plan_figure(GRID, IMPROVED, "improved").axes[0]
    np.testing.assert_array_equal(the(ax, "grid path").get_xydata(), IMPROVED.path)
    assert the(ax, "breaking point").get_xydata().tolist() == [[3.5, 0.5]]
    assert the(ax, "key-point path").get_linestyle() == "--"
    assert ax.get_title().splitlines() == [
        "Improved A*", "path: 4.50 m, 1 breaking and 0 danger points",
        "key points: 6.00 m, 1 breaking and 0 danger points"]  # fmt: skip


def test_a_plan_of_the_kernel_is_drawn_to_its_counts():
    ax = plan_figure(GRID, hand_made_plan(AROUND, AROUND[[0, 3, 6]])).axes[0]
    np.testing.assert_array_equal(the(ax, "grid path").get_xydata(), IMPROVED.path)
    np.testing.assert_array_equal(the(ax, "key-point path").get_xydata(), IMPROVED.key_points)
    assert "path: 4.50 m, 1 breaking and 2 danger points" in ax.get_title()
    assert "key points: 6.00 m, 3 breaking and 4 danger points" in ax.get_title()


def test_a_plan_without_a_path_says_why():
    nothing = np.zeros((0, 2), np.float32)
    lost = PlannedPath((0.5, 0.5), (3.5, 3.5), Status.UNREACHABLE, 0.0, 9, dict.fromkeys(PlannedMeasures._fields, 0),
                       nothing, nothing, 0.0)  # fmt: skip
    for ax in (plan_figure(GRID, lost).axes[0], *compare_plans([Comparison("", GRID, lost, lost)]).axes):
        assert ax.get_title().endswith("no path: UNREACHABLE")
        assert the(ax, "start").get_xydata().tolist() == [[0.5, 0.5]]


def test_a_wide_margin_of_obstacles_is_cropped_but_no_end_or_path():
    occupied = np.ones((60, 80), bool)
    occupied[20:30, 30:50] = False
    grid = grid_of(occupied, 0.5, (-1.0, 2.0))
    within = planned(np.array([[22, 35], [22, 36]]), np.array([[22, 35], [22, 36]]))
    path = within.path * 0.5 + np.float32([-1.0, 2.0])
    within = replace(within, start=tuple(path[0]), goal=tuple(path[1]), path=path, key_points=path)
    ax = plan_figure(grid, within).axes[0]
    assert ax.get_xlim() == (-1 + 0.5 * (30 - MARGIN), -1 + 0.5 * (50 + MARGIN))
    assert ax.get_ylim() == (2 + 0.5 * (20 - MARGIN), 2 + 0.5 * (30 + MARGIN))
    assert plan_figure(grid, within, y_down=True).axes[0].get_ylim() == ax.get_ylim()[::-1]
    left, right = plan_figure(grid, replace(within, goal=(1.0, 13.0))).axes[0].get_xlim()
    assert left < 1.0
    assert right == ax.get_xlim()[1]


def test_the_goal_lies_below_key_points_and_danger_points_near_it():
    for found, label in ((TRADITIONAL, "danger point"), (IMPROVED, "key point")):
        ax = plan_figure(GRID, found).axes[0]
        assert the(ax, "grid path").get_zorder() < the(ax, "goal").get_zorder() < the(ax, label).get_zorder()


def test_a_map_that_counts_rows_downwards_is_drawn_so():
    assert plan_figure(GRID, IMPROVED, y_down=True).axes[0].get_ylim() == (4.0, 0.0)


SCENARIO = toy.generate(jax.random.key(0), toy.ToySpec(drawing="S..o\n.##.\n>.oG"))
NONE_HIDDEN = np.zeros((0, 0), bool)
X, Y = np.array([0.5, 1.0, 1.5]), np.array([2.0, 1.5, 1.5])


def trace_of(steps=3, rows=5, seen=NONE_HIDDEN):
    """A drive of `steps` steps in arrays of `rows`, its movers and squares padded to 3."""
    def column(values):
        return np.concatenate([values, np.repeat(values[-1:], rows - len(values))]).astype(np.float32)

    zero = np.zeros(rows, np.float32)
    robot = RobotState(column(X), column(Y), zero, zero, zero)
    mover = np.zeros((rows, 3, 2), np.float32)
    mover[:, 0] = np.stack([0.5 + 0.5 * np.arange(1, rows + 1), np.full(rows, 0.5)], axis=-1)
    present = np.tile([True, False, False], (rows, 1))
    known = np.zeros((rows, 3), bool)
    known[1:, 0] = True
    target = np.tile(np.float32([3.5, 0.5]), (rows, 1))
    route = Route(np.float32([[0.5, 2.5], [0.5, 0.5], [3.5, 0.5], [3.5, 0.5]]), np.int32(3), np.zeros(4, np.float32))
    return Trace(robot, MoverStates(mover, mover, present), known, target, zero, np.int32(steps), route, seen)


def episode_of(outcome, stopped=False, time=0.3, replans=0):
    measures = Measures(*[np.float32(0.0)] * len(Measures._fields))
    measures = measures._replace(time=np.float32(time), length=np.float32(1.7), least_clearance=np.float32(0.25))
    return Episode(np.int32(outcome), np.bool_(stopped), np.int32(0), np.int32(replans), measures)


PLAN = hand_made_plan(np.array([[2, 0], [0, 3]]), np.array([[2, 0], [1, 3], [0, 3]]))


def test_a_drive_shows_the_planned_path_dashed_and_the_driven_one_solid():
    ax = drive_figure(SCENARIO, PLAN, episode_of(Outcome.REACHED), trace_of()).axes[0]
    assert the(ax, "driven path").get_xydata().tolist() == [[0.5, 2.5], [0.5, 2.0], [1.0, 1.5], [1.5, 1.5]]
    assert the(ax, "driven path").get_linestyle() == "-"
    assert the(ax, "planned path").get_xydata().tolist() == [[0.5, 2.5], [3.5, 1.5], [3.5, 0.5]]
    assert the(ax, "planned path").get_linestyle() == "--"
    assert the(ax, "key point").get_xydata().tolist() == [[3.5, 1.5]]
    assert absent(ax, "collision")


def test_movers_are_shown_where_they_began_and_ended_with_the_way_between():
    ax = drive_figure(SCENARIO, PLAN, episode_of(Outcome.REACHED), trace_of()).axes[0]
    discs = [patch for patch in ax.patches if isinstance(patch, Circle)]
    assert [disc.get_center() for disc in discs] == [pytest.approx((0.5, 0.5)), pytest.approx((2.0, 0.5))]
    assert the(ax, "way of a mover").get_xydata().tolist() == [[0.5, 0.5], [1.0, 0.5], [1.5, 0.5], [2.0, 0.5]]


def test_only_squares_that_were_sensed_are_filled():
    ax = drive_figure(SCENARIO, PLAN, episode_of(Outcome.REACHED), trace_of()).axes[0]
    squares = [patch for patch in ax.patches if isinstance(patch, Rectangle)]
    assert [to_hex(square.get_facecolor()) for square in squares] == [ORANGE.lower(), "#ffffff"]
    assert [square.get_label() for square in squares] == ["unknown square", "square never sensed"]


def test_hidden_cells_are_filled_where_they_were_seen():
    hidden = np.zeros((3, 4), bool)
    hidden[0, 1] = hidden[2, 2] = True
    seen = np.zeros((16, 16), bool)  # padded, as the kernel gives it
    seen[0, 1] = True
    ax = drive_figure(replace(SCENARIO, hidden=hidden), PLAN, episode_of(Outcome.REACHED), trace_of(seen=seen)).axes[0]
    (filled,), (pale,) = ([drawn for drawn in ax.collections if drawn.get_label() == label]
                          for label in ("hidden cell", "hidden cell never seen"))  # fmt: skip
    assert filled.get_paths()[0].vertices[0].tolist() == [1.0, 0.0]
    assert pale.get_paths()[0].vertices[0].tolist() == [2.0, 2.0]
    assert to_hex(filled.get_facecolor()[0]) == ORANGE.lower()
    assert to_hex(pale.get_facecolor()[0]) == "#ffffff"


def test_the_last_route_is_drawn_only_if_it_was_planned_under_way():
    once, again = (drive_figure(SCENARIO, PLAN, episode_of(Outcome.REACHED, replans=count), trace_of()).axes[0]
                   for count in (0, 2))  # fmt: skip
    assert absent(once, "last route")
    assert the(again, "last route").get_xydata().tolist() == [[0.5, 2.5], [0.5, 0.5], [3.5, 0.5]]


def test_a_robot_of_several_discs_is_drawn_along_its_heading():
    robot = replace(jackal(), radius=0.25, disc_offsets=(-0.5, 0.5))
    trace = trace_of()
    trace = trace._replace(robot=trace.robot._replace(heading=np.full(5, np.pi / 2, np.float32)))
    ax = drive_figure(SCENARIO, PLAN, episode_of(Outcome.STUCK), trace, robot=robot).axes[0]
    discs = [patch for patch in ax.patches if isinstance(patch, Circle)][2:]
    assert [disc.get_center() for disc in discs] == [pytest.approx((1.5, 1.0)), pytest.approx((1.5, 2.0))]
    assert [disc.get_label() for disc in discs] == ["robot, end", "_"]


@pytest.mark.parametrize("outcome", [Outcome.HIT_KNOWN, Outcome.HIT_UNKNOWN, Outcome.HIT_MOVER])
def test_a_collision_is_crossed(outcome):
    ax = drive_figure(SCENARIO, PLAN, episode_of(outcome), trace_of()).axes[0]
    assert the(ax, "collision").get_xydata().tolist() == [[1.5, 1.5]]
    assert the(ax, "collision").get_marker() == "X"


def test_the_title_says_how_the_drive_ended():
    def title(*given):
        return drive_figure(SCENARIO, PLAN, episode_of(*given), trace_of(), title="toy").axes[0].get_title()

    assert title(Outcome.REACHED) == (
        "toy: reached the goal after 0.3 s\n1.70 m driven, 6.00 m planned, least clearance 0.25 m")  # fmt: skip
    endings = [title(outcome).splitlines()[0] for outcome in Outcome]
    assert len(set(endings)) == len(Outcome)
    assert "ran into the standing robot" in title(Outcome.HIT_MOVER, True)


def test_a_drive_that_never_began_is_drawn():
    plan = PLAN._replace(key_point_count=np.int32(0))
    ax = drive_figure(SCENARIO, plan, episode_of(Outcome.NO_PATH, time=0.0), trace_of(steps=0)).axes[0]
    assert ax.get_title() == "found no path"
    assert the(ax, "driven path").get_xydata().tolist() == [[0.5, 2.5]]
    assert absent(ax, "planned path")


def test_bars_carry_wilson_intervals_beside_the_papers_rate():
    ax = success_figure({"15": (171, 200), "25": (200, 200)}).axes[0]
    assert [bar.get_height() for bar in ax.patches] == pytest.approx([85.5, 100.0])
    segments = ax.collections[0].get_segments()
    low, high = wilson(171, 200)
    assert segments[0][:, 1] == pytest.approx([100 * low, 100 * high])
    assert the(ax, "paper: 95.6 % in “the test scenario”").get_ydata() == pytest.approx([95.6, 95.6])
    assert ax.get_xticklabels()[0].get_text() == "15\n85.5 %\n171 of 200"


def test_drives_stand_side_by_side_under_their_names_with_one_legend():
    driven = Replay(SCENARIO, PLAN, episode_of(Outcome.REACHED), trace_of(), jackal())
    figure = compare_drives({"one": driven, "other": driven})
    assert [ax.get_title().split(":")[0] for ax in figure.axes] == ["one", "other"]
    assert all(ax.get_legend() is None for ax in figure.axes)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts.count("driven path") == 1


def results_of(*outcomes):
    return Results("drawn", tuple(map(str, range(len(outcomes)))), np.array(outcomes, np.int32), {})


def test_outcomes_are_stacked_to_100_percent_beside_the_rate_of_success():
    results = {"a": results_of(Outcome.REACHED, Outcome.REACHED, Outcome.STUCK, Outcome.HIT_MOVER),
               "b": results_of(Outcome.REACHED)}  # fmt: skip
    ax = outcome_figure(results).axes[0]
    widths = {bars.get_label(): [bar.get_width() for bar in bars] for bars in ax.containers}
    assert widths == {"reached the goal": [50.0, 100.0], "hit a mover": [25.0, 0.0], "got stuck": [25.0, 0.0]}
    low, high = wilson(2, 4)
    assert ax.get_yticklabels()[0].get_text() == f"a\n50.0 % [{100 * low:.1f}, {100 * high:.1f}]"
    looks = {(to_hex(bars[0].get_facecolor()), bars[0].get_hatch()) for bars in ax.containers}
    assert len(looks) == 3


def test_a_film_shows_the_drive_and_holds_its_end(tmp_path):
    path = animate_drive(tmp_path / "drive.gif", SCENARIO, PLAN, episode_of(Outcome.REACHED), trace_of(), speed=0.1,
                         robot=jackal())  # fmt: skip
    with Image.open(path) as film:
        assert film.n_frames == 4  # the start and three steps
        film.seek(3)
        assert film.info["duration"] == 2000


def test_a_long_drive_is_thinned_to_the_most_frames(tmp_path, monkeypatch):
    monkeypatch.setattr(animation, "MOST_FRAMES", 3)
    done = []
    animate_drive(tmp_path / "drive.gif", SCENARIO, PLAN, episode_of(Outcome.HIT_MOVER), trace_of(), speed=0.1,
                  progress=lambda count, of: done.append((count, of)))  # fmt: skip
    assert done == [(1, 3), (2, 3), (3, 3)]


def test_a_film_of_no_drive_is_one_picture(tmp_path):
    plan = PLAN._replace(key_point_count=np.int32(0))
    path = animate_drive(tmp_path / "drive.gif", SCENARIO, plan, episode_of(Outcome.NO_PATH, time=0.0),
                         trace_of(steps=0))  # fmt: skip
    with Image.open(path) as film:
        assert film.n_frames == 1


@pytest.mark.parametrize(("name", "complaint"), [("drive.mp4", "ffmpeg"), ("drive.avi", "suffix '.avi'")])
def test_a_film_that_cannot_be_written_is_refused_before_it_is_drawn(name, complaint, tmp_path, monkeypatch):
    monkeypatch.setattr("matplotlib.animation.FFMpegWriter.isAvailable", lambda: False)
    with pytest.raises(ValueError, match=complaint):
        animate_drive(tmp_path / name, SCENARIO, PLAN, episode_of(Outcome.REACHED), trace_of())
    assert not list(tmp_path.iterdir())


def test_arrays_of_jax_are_drawn_as_those_of_numpy():
    on_device = jax.tree.map(jnp.asarray, (SCENARIO, trace_of()))
    ax = drive_figure(on_device[0], PLAN, episode_of(Outcome.STUCK), on_device[1]).axes[0]
    assert the(ax, "robot, end").get_xydata().tolist() == [[1.5, 1.5]]


def test_figures_drawn_on_given_axes_keep_their_legends_apart_and_below_their_own_labels():
    figure = new_figure((9.0, 6.0))
    axes = figure.subplots(2, 2)
    results = {"a": results_of(Outcome.REACHED, Outcome.STUCK, Outcome.HIT_MOVER), "b": results_of(Outcome.TIMEOUT)}
    for ax in axes[0]:
        outcome_figure(results, ax)
    for ax in axes[1]:
        success_figure({"15": (171, 200), "25": (200, 200)}, ax=ax)
    figure.draw_without_rendering()
    assert not figure.legends
    legends = [ax.get_legend().get_window_extent() for ax in axes.flat]
    plots = [ax.get_window_extent() for ax in axes.flat] + [ax.xaxis.get_tightbbox() for ax in axes.flat]
    assert not any(one.overlaps(other) for k, one in enumerate(legends) for other in (*legends[k + 1 :], *plots))
