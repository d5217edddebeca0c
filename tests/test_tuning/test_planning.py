import json
import math
import re

import numpy as np
import pytest

from adwa_jax.astar import Status
from adwa_jax.heuristic_weight import WeightRule
from scenarios.formats import load_map, load_scen
from tests.test_tuning.worlds import map_file
from tuning.planning import as_json, plan_paths, planner_constants, planner_options, why_blocked

BANDS = map_file("......", ".####.", "......", ".####.", "......")
CORNER = map_file("....", ".##.", "....")


def answers_on(drawn, *queries, planner="improved", radius=0.0, unknown="occupied", **options):
    """Answers to queries ((start), (goal)) in the world frame."""
    points = drawn.to_grid_frame(np.array(queries, np.float64))
    constants = planner_constants(None, radius)
    return list(plan_paths(drawn.grid(unknown), points, constants, planner_options(planner, **options)))


def test_a_way_round_two_walls_by_hand():
    (answer,) = answers_on(BANDS, ((0.5, 0.5), (5.5, 4.5)))
    assert (answer.status, answer.length) == (Status.FOUND, 9.0)
    assert answer.measures == {"breaking_points": 2, "danger_points": 0, "key_point_breaking_points": 2,
                               "key_point_danger_points": 0}  # fmt: skip
    assert len(answer.path) == 10
    assert answer.key_points.tolist() in ([[0.5, 0.5], [0.5, 2.5], [5.5, 2.5], [5.5, 4.5]],
                                          [[0.5, 0.5], [5.5, 0.5], [5.5, 4.5]])  # fmt: skip


def test_answers_come_in_the_order_of_the_queries_whatever_their_effort():
    queries = [((0.5, 0.5), (5.5, 4.5)), ((0.5, 0.5), (0.5, 0.5)), ((0.5, 0.5), (1.5, 1.5)), ((1.5, 1.5), (0.5, 0.5)),
               ((9.5, 0.5), (0.5, 0.5)), ((0.5, 0.5), (1.5, 0.5))]  # fmt: skip
    answers = answers_on(BANDS, *queries)
    assert [answer.status.name for answer in answers] == [
        "FOUND", "FOUND", "BAD_GOAL", "BAD_START", "BAD_START", "FOUND"]  # fmt: skip
    assert [(answer.start, answer.goal) for answer in answers] == queries
    assert [answer.length for answer in answers] == [9.0, 0.0, 0.0, 0.0, 0.0, 1.0]


def test_progress_counts_the_queries():
    calls = []
    queries = np.array([[(0.5, 0.5), (1.5, 0.5)]] * 3)
    list(plan_paths(BANDS.grid(), queries, planner_constants(), planner_options("improved"),
                    lambda done, total: calls.append((done, total))))  # fmt: skip
    assert calls == [(1, 3), (2, 3), (3, 3)]


def test_a_start_at_the_goal_is_a_path_of_one_cell():
    (answer,) = answers_on(BANDS, ((0.2, 0.7), (0.9, 0.1)))
    assert (answer.status, answer.length, answer.expansions) == (Status.FOUND, 0.0, 0)
    assert answer.path.tolist() == [[0.5, 0.5]]


def test_a_point_on_the_maps_lower_edge_is_on_it_and_on_the_upper_edge_is_not():
    answers = answers_on(BANDS, ((0.0, 0.0), (5.999, 4.999)), ((0.0, 0.0), (6.0, 4.5)))
    assert [answer.status for answer in answers] == [Status.FOUND, Status.BAD_GOAL]


def test_without_a_path_everything_is_empty_or_0():
    sealed = map_file("..#..", "..#..")
    (answer,) = answers_on(sealed, ((0.5, 0.5), (4.5, 0.5)))
    assert answer.status == Status.UNREACHABLE
    assert (answer.length, answer.key_point_length, len(answer.path), len(answer.key_points)) == (0.0, 0.0, 0, 0)
    assert set(answer.measures.values()) == {0}
    assert answer.expansions == 4  # all that can be reached


def test_the_budget_ends_a_search():
    (answer,) = answers_on(BANDS, ((0.5, 0.5), (5.5, 4.5)), budget=3)
    assert (answer.status, answer.expansions) == (Status.BUDGET_EXHAUSTED, 3)


def test_traditional_cuts_corners_and_the_others_do_not():
    query = ((0.5, 1.5), (3.5, 1.5))
    (improved,), (traditional,), (dijkstra,) = (
        answers_on(CORNER, query, planner=planner) for planner in ("improved", "traditional", "dijkstra"))  # fmt: skip
    assert traditional.length == pytest.approx(1 + 2 * math.sqrt(2), abs=1e-12)
    assert traditional.measures["danger_points"] == 2
    assert (improved.length, dijkstra.length) == (5.0, 5.0)
    assert improved.measures["danger_points"] == dijkstra.measures["danger_points"] == 0


def test_dijkstra_expands_every_cell_nearer_than_the_goal():
    empty = map_file(*["......"] * 5)
    (dijkstra,) = answers_on(empty, ((0.5, 0.5), (5.5, 0.5)), planner="dijkstra")
    (improved,) = answers_on(empty, ((0.5, 0.5), (5.5, 0.5)))
    nearer = sum(max(r, c) + (math.sqrt(2) - 1) * min(r, c) < 5 for r in range(5) for c in range(6))
    assert nearer <= dijkstra.expansions <= nearer + 1  # and perhaps the other cell at distance 5
    assert improved.expansions == 5


def test_lengths_are_those_of_double_precision():
    """float32 holds 400 cells to 3e-5, where benchmarks list 8 decimals."""
    diagonal = map_file(*["." * 20] * 20, resolution=100.0)
    (answer,) = answers_on(diagonal, ((50, 50), (1950, 1950)))
    assert answer.length == pytest.approx(1900 * math.sqrt(2), abs=1e-9)


def test_inflation_blocks_cells_whose_disc_meets_an_obstacle_and_touching_is_meeting():
    corridor = map_file("#####", ".....", "#####")
    for radius, status in ((0.49, Status.FOUND), (0.5, Status.BAD_START)):
        (answer,) = answers_on(corridor, ((1.5, 1.5), (3.5, 1.5)), radius=radius)
        assert answer.status == status


def test_the_robots_radius_is_the_margin_of_key_points_too():
    constants = planner_constants(WeightRule(0.1, 0.2, 1.0, 0.0), robot_radius=0.3)
    assert (constants.robot.radius, constants.behaviour.clearance_margin) == (0.3, 0.3)
    assert constants.weight_rule == WeightRule(0.1, 0.2, 1.0, 0.0)


def test_key_points_of_a_robot_keep_clear_of_the_corner_that_a_point_may_graze():
    bend = map_file("......", "......", "..##..", "..##..")
    (point,) = answers_on(bend, ((1.5, 3.5), (4.5, 3.5)))
    (robot,) = answers_on(bend, ((1.5, 3.5), (4.5, 3.5)), radius=0.45)
    for answer, radius in ((point, 0.0), (robot, 0.45)):
        for a, b in zip(answer.key_points[:-1], answer.key_points[1:], strict=True):
            along = np.linspace(a, b, 400)
            away = np.maximum(np.maximum([2, 2] - along, along - [4, 4]), 0)
            assert np.hypot(*away.T).min() > radius


def test_json_of_a_turned_map_is_in_the_world_frame():
    """Turned by 90°: the map's x axis points along the world's y, its y axis along -x."""
    turned = map_file("....", "....", "....", resolution=0.5, origin=(10.0, 20.0), yaw=math.pi / 2)
    (answer,) = answers_on(turned, ((9.75, 20.25), (9.75, 21.75)))
    record = as_json(answer, turned)
    assert (record["start"], record["goal"]) == ([9.75, 20.25], [9.75, 21.75])
    assert record["path"] == [[9.75, 20.25], [9.75, 20.75], [9.75, 21.25], [9.75, 21.75]]
    assert record["key_points"] == [[9.75, 20.25], [9.75, 21.75]]
    (outside,) = answers_on(turned, ((10.25, 20.25), (9.75, 21.75)))
    assert outside.status == Status.BAD_START


def test_json_has_the_contracts_fields_and_expected_only_where_a_file_lists_it():
    (answer,) = answers_on(BANDS, ((0.5, 0.5), (5.5, 4.5)))
    record = json.loads(json.dumps(as_json(answer, BANDS)))
    assert {"start", "goal", "status", "length", "expansions", "breaking_points", "danger_points", "path", "key_points",
            "key_point_length"} <= set(record)  # fmt: skip
    assert "expected" not in record
    assert record["status"] == "FOUND"
    assert as_json(answer, BANDS, 9.0, listed=True)["expected"] == 9.0
    assert as_json(answer, BANDS, None, listed=True)["expected"] is None


def test_json_of_a_map_in_nanometres_keeps_its_cells_apart():
    fine = map_file("....", "....", resolution=1e-9)
    (answer,) = answers_on(fine, ((0.5e-9, 0.5e-9), (3.5e-9, 0.5e-9)))
    xs = [x for x, _ in as_json(answer, fine)["path"]]
    assert xs == pytest.approx([0.5e-9, 1.5e-9, 2.5e-9, 3.5e-9])


@pytest.mark.parametrize(("point", "radius", "reason"), [
    ((-0.1, 1.0), 0.0, "lies outside the map, which spans x 0..5, y 0..3 m; choose a point on it"),
    ((5.0, 1.0), 0.0, "lies outside the map"),
    ((1.0, 3.5), 0.0, "lies outside the map"),
    ((0.5, 0.5), 0.0, "lies in an obstacle; choose a free point"),
    ((4.5, 1.5), 0.0, "lies in an unknown cell; choose a known one, or count them as free with --unknown free"),
    ((1.5, 1.5), 0.8, "is too near to an obstacle or the border for --robot-radius 0.8; choose a point with more room"),
])  # fmt: skip
def test_why_a_point_is_blocked_agrees_with_the_search(point, radius, reason):
    drawn = map_file("#....", "....?", "#....")
    assert why_blocked(drawn, np.array(point), radius).startswith(reason)
    (answer,) = answers_on(drawn, (point, (2.5, 1.5)), radius=radius)
    assert answer.status == Status.BAD_START


def poses(folder):
    """[Q, 2, 2] starts and goals of an MRPB map's tests."""
    text = (folder / "config.txt").read_text()
    names = [f"{end}_pose_{axis}" for end in ("initial", "goal") for axis in "xy"]
    columns = [re.findall(rf'name="{name}" default="([^"]+)"', text) for name in names]
    return np.array(columns, np.float64).T.reshape(-1, 2, 2)


@pytest.mark.realdata
@pytest.mark.parametrize(("name", "unknown", "statuses"), [
    ("mrpb_maze", "occupied", {"FOUND"}),
    ("mrpb_office02", "occupied", {"FOUND"}),
    ("mrpb_office02_partially_unknown", "occupied", {"BAD_GOAL"}),
    ("mrpb_office02_partially_unknown", "free", {"FOUND"}),
])  # fmt: skip
def test_paths_between_the_mrpb_poses_for_a_robot_of_20_cm(data_folder, name, unknown, statuses):
    """On the partially known map all three goals lie in unknown cells."""
    folder = data_folder / "ros_maps" / name
    room = load_map(folder / "map.yaml")
    answers = answers_on(room, *poses(folder), radius=0.2, unknown=unknown)
    assert len(answers) == 3
    assert {answer.status.name for answer in answers} == statuses
    for answer in answers:
        if answer.status == Status.BAD_GOAL:
            assert why_blocked(room, np.array(answer.goal), 0.2).startswith("lies in an unknown cell")
        else:
            straight = math.dist(answer.start, answer.goal)
            assert straight - 0.1 < answer.key_point_length <= answer.length + 1e-3


SMALL_MAPS = ("da2/ht_store", "da2/lt_house", "dao/arena", "dao/hrt002d", "dao/lak103d", "mapf/empty-8-8",
              "mapf/empty-32-32", "mapf/maze-32-32-2", "mapf/maze-32-32-4", "mapf/random-32-32-10",
              "mapf/random-32-32-20", "mapf/random-64-64-20", "mapf/room-32-32-4", "mapf/room-64-64-8")  # fmt: skip


@pytest.mark.realdata
@pytest.mark.parametrize("name", SMALL_MAPS)
def test_dijkstra_finds_the_listed_lengths_of_movingai_maps(data_folder, name):
    folder, stem = name.split("/")
    grid_map = load_map(data_folder / "movingai" / folder / f"{stem}.map")
    scen = f"{stem}-random-1.scen" if folder == "mapf" else f"{stem}.map.scen"
    entries = load_scen(data_folder / "movingai" / folder / scen)
    spread = [entries[index] for index in np.linspace(0, len(entries) - 1, 6).astype(int)]
    answers = answers_on(grid_map, *((entry.start_point, entry.goal_point) for entry in spread), planner="dijkstra")
    for entry, answer in zip(spread, answers, strict=True):
        assert (answer.status == Status.UNREACHABLE) == entry.expected_unreachable, entry.line
        if entry.expected is not None:
            assert answer.length == pytest.approx(entry.expected, abs=entry.tolerance), entry.line
