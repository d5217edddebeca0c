"""The oracles against numbers worked out by hand."""

import math
from fractions import Fraction

import numpy as np
import pytest

from tests.reference import astar, density, distance, dwa, keypoints, metrics, prediction, route


def drawn(*rows):
    """Occupancy from rows of '#' and '.', first row = row 0."""
    return np.array([[cell == "#" for cell in row] for row in rows])


CORNER = drawn("....", ".#..", "....", "....")  # one square, [1, 2] × [1, 2], in a 4 × 4 map


class TestDistance:
    def test_to_a_side_a_corner_and_the_border(self):
        assert distance.squared_distance(CORNER, 3, Fraction(3, 2)) == 1  # side and border
        assert distance.squared_distance(CORNER, Fraction(5, 2), Fraction(5, 2)) == Fraction(1, 2)  # corner
        assert distance.squared_distance(CORNER, Fraction(7, 2), Fraction(7, 2)) == Fraction(1, 4)  # border
        assert distance.distance(CORNER, 1.5, 1.5) == 0.0
        assert distance.distance(CORNER, -2.0, 1.0) == 0.0

    def test_lattice_has_corners_of_cells(self):
        field = distance.lattice_distance(CORNER, 2)
        assert field.shape == (9, 9)
        assert field[5, 5] == math.sqrt(0.5)
        assert field[2, 2] == field[0, 4] == 0.0
        assert field[6, 3] == 1.0  # (1.5, 3): the square's side at y = 2, the border at y = 4

    def test_inflation_touches_at_exactly_the_radius(self):
        ring = drawn("####", "####", "##.#", "####")  # border cells are within 1/2 of the border
        assert np.array_equal(distance.inflate(CORNER, Fraction(1, 2)), ring)
        assert np.array_equal(distance.inflate(CORNER, Fraction(49, 100)), CORNER)
        assert distance.inflate(CORNER, Fraction(707, 1000))[2, 2] == False  # noqa: E712 - corner at √½ = 0.70711
        assert distance.inflate(CORNER, Fraction(708, 1000)).all()


class TestDensity:
    def test_rectangle_includes_both_corners(self):
        assert density.share(CORNER, (1, 1), (3, 2)) == Fraction(1, 6)
        assert density.share(CORNER, (3, 2), (1, 1)) == Fraction(1, 6)
        assert density.share(CORNER, (2, 2), (2, 2)) == 0
        assert density.map_share(CORNER) == Fraction(1, 16)

    @pytest.mark.parametrize(("p", "q", "weight"), [
        (Fraction(3, 10), Fraction(2, 10), Fraction(5, 6)),  # exactly 1.5 Q: dense, 1/2 + 1/2 · 2/3
        (Fraction(1, 10), Fraction(2, 10), 1),  # exactly 0.5 Q: neither
        (Fraction(1, 20), Fraction(2, 10), Fraction(5, 4)),  # 1 + 1 · 1/4
        (0, Fraction(2, 10), 1),
        (0, 0, 1),
    ])
    def test_weight_rule_at_and_around_its_thresholds(self, p, q, weight):
        assert density.heuristic_weight(p, q, 0.5, 0.5, 1.0, 1.0) == weight


class TestAstar:
    def test_costs_of_equal_mixture_are_equal_whatever_the_route(self):
        assert 2 * astar.ROOT2 + astar.ONE == astar.ONE + astar.ROOT2 + astar.ROOT2
        assert astar.ROOT2 * 985 < 1394 * astar.ONE
        assert astar.ROOT2 * 985 > 1393 * astar.ONE - astar.ONE // 1000
        assert astar.root(8) == 2 * astar.ROOT2
        assert astar.root(25) == 5 * astar.ONE

    def test_straight_corridor(self):
        answer = astar.search(drawn("....."), (0, 0), (0, 4))
        assert answer.path == ((0, 0), (0, 1), (0, 2), (0, 3), (0, 4))
        assert (answer.straight_steps, answer.diagonal_steps, answer.expansions) == (4, 0, 4)

    @pytest.mark.parametrize(("rule", "steps"), [("never", (2, 0)), ("squeeze", (0, 1)), ("always", (0, 1))])
    def test_corner_rules_past_one_corner(self, rule, steps):
        answer = astar.search(drawn(".#", ".."), (0, 0), (1, 1), corner_rule=rule)
        assert (answer.straight_steps, answer.diagonal_steps) == steps

    @pytest.mark.parametrize(("rule", "status"), [
        ("never", "UNREACHABLE"), ("squeeze", "UNREACHABLE"), ("always", "FOUND")])
    def test_corner_rules_between_two_corners(self, rule, status):
        assert astar.search(drawn(".#", "#."), (0, 0), (1, 1), corner_rule=rule).status == status

    def test_ties_go_to_smaller_whole_h_then_to_lower_index(self):
        # Dijkstra: (0, 0), (0, 2) and (1, 1) all cost 1 and have h = 0: index order.
        answer = astar.search(drawn("...", "...", "..."), (0, 1), (2, 1), heuristic="zero")
        assert answer.expanded[:4] == ((0, 1), (0, 0), (0, 2), (1, 1))
        # Manhattan, goal (2, 2) from (0, 0): the diagonal (1, 1) has f = 3.41; (0, 1), (1, 0) have f = 4.
        answer = astar.search(drawn("...", "...", "..."), (0, 0), (2, 2), heuristic="manhattan")
        assert answer.expanded == ((0, 0), (1, 1))
        # Octile around a blocked centre: (0, 1) and (1, 0) tie at 2 + √2, the lower index first; (0, 2) and
        # (2, 0) tie at 4; (1, 2) has f = 4 too and whole h 1 against 2, so it precedes (2, 0).
        answer = astar.search(drawn("...", ".#.", "..."), (0, 0), (2, 2))
        assert answer.expanded == ((0, 0), (0, 1), (1, 0), (0, 2), (1, 2))

    def test_generated_stops_earlier_and_budget_and_bad_ends_are_told_apart(self):
        line = drawn(".....")
        assert astar.search(line, (0, 0), (0, 4), heuristic="zero", stop_rule="generated").expansions == 4
        room = np.zeros((3, 3), bool)
        assert astar.search(room, (1, 0), (1, 1), heuristic="zero").expanded == ((1, 0), (0, 0))
        early = astar.search(room, (1, 0), (1, 1), heuristic="zero", stop_rule="generated")
        assert early.expanded == ((1, 0),)
        assert astar.search(line, (0, 0), (0, 4), budget=3).status == "BUDGET_EXHAUSTED"
        assert astar.search(line, (0, 0), (0, 4), budget=4).status == "FOUND"
        assert astar.search(drawn("..#."), (0, 0), (0, 3)).status == "UNREACHABLE"
        assert astar.search(drawn("#..."), (0, 0), (0, 3)).status == "BAD_START"
        assert astar.search(drawn("...."), (0, 0), (0, 4)).status == "BAD_GOAL"
        assert astar.search(line, (0, 2), (0, 2)).path == ((0, 2),)

    def test_relaxation_agrees_with_a_hand_sum(self):
        blocked = drawn("...", ".#.", "...")
        assert astar.cheapest_cost(blocked, (0, 0), (2, 2)) == 4 * astar.ONE
        assert astar.cheapest_cost(blocked, (0, 0), (2, 2), "squeeze") == 2 * astar.ONE + astar.ROOT2
        assert astar.cheapest_cost(drawn(".#."), (0, 0), (0, 2)) is None


class TestKeyPoints:
    def test_turning_points_are_corners_and_ends(self):
        path = [(0, 0), (0, 1), (0, 2), (1, 3), (2, 4), (3, 4)]
        assert keypoints.turning_points(path) == [(0, 0), (0, 2), (2, 4), (3, 4)]
        assert keypoints.turning_points([(1, 1)]) == [(1, 1)]

    def test_segment_to_square_distances(self):
        def squared(a, b):
            return keypoints.squared_segment_to_square(a, b, 1, 1)

        assert squared((0, 0), (3, 3)) == 0  # through
        assert squared((0, 1), (4, 1)) == 0  # along its side
        assert squared((1, 3), (3, 1)) == 0  # through its corner (2, 2)
        assert squared((0, 0), (3, 0)) == 1  # along, one below
        assert squared((2, 3), (4, 1)) == Fraction(1, 2)  # corner (2, 2) to the line x + y = 5
        assert squared((3, 3), (4, 4)) == 2  # end to corner
        assert squared((Fraction(5, 4), Fraction(5, 4)), (Fraction(3, 2), Fraction(3, 2))) == 0  # within

    def test_margin_must_be_exceeded_and_touching_blocks_at_zero(self):
        a, b = (Fraction(1, 2), Fraction(7, 2)), (Fraction(7, 2), Fraction(1, 2))  # touches (2, 2)
        assert not keypoints.segment_free(CORNER, a, b, 0)
        a, b = (Fraction(1, 2), Fraction(5, 2)), (Fraction(7, 2), Fraction(5, 2))  # at 1/2
        assert keypoints.segment_free(CORNER, a, b, Fraction(499, 1000))
        assert not keypoints.segment_free(CORNER, a, b, Fraction(1, 2))

    def test_anchor_keeps_looking_from_the_last_kept_point_and_literal_does_not(self):
        free = np.zeros((3, 6), bool)
        staircase = [(0, 0), (0, 1), (1, 2), (1, 3), (2, 4), (2, 5)]
        assert keypoints.key_points(free, staircase, 0) == [(0, 0), (2, 5)]
        wall = drawn("......", "......", "...###", "......", "......", "......")
        path = [(0, 0), (1, 1), (2, 1), (3, 1), (4, 2), (4, 3), (4, 4), (4, 5)]
        assert keypoints.turning_points(path) == [(0, 0), (1, 1), (3, 1), (4, 2), (4, 5)]
        # (0, 0)→(3, 1), (0, 0)→(4, 2) are free: drop (1, 1), (3, 1). (0, 0)→(4, 5) is cut: keep (4, 2).
        assert keypoints.key_points(wall, path, 0) == [(0, 0), (4, 2), (4, 5)]
        # literal tests (3, 1)→(4, 5), which is free under the wall, so (4, 2) goes too.
        assert keypoints.key_points(wall, path, 0, "literal") == [(0, 0), (4, 5)]


ROBOT = dwa.Robot(v_min=0.0, v_max=1.0, yaw_rate_max=1.0, a_max=1.0, yaw_a_max=2.0, brake=1.0, yaw_brake=2.0,
                  radius=0.5)


def decide(**changes):
    settings = {"pose": (0.0, 0.0, 0.0), "v": 0.5, "yaw_rate": 0.0, "robot": ROBOT,
                "local_target": (5.0, 0.0), "goal": (5.0, 0.0), "weights": dwa.Weights(1.0, 0.0, 0.0, 0.0),
                "static_distance": lambda x, y: 9.0, "dt": 0.5, "steps": 2,
                "v_count": 3, "yaw_count": 3, "clearance_cap": 2.0}
    return dwa.decide(**(settings | changes))


class TestDwa:
    def test_window_is_cut_by_the_limits(self):
        assert dwa.samples(0.25, 0.5, 0.0, 1.0, 4) == [0.0, 0.25, 0.5, 0.75]
        assert dwa.samples(0.9, 0.5, 0.0, 1.0, 2) == [0.4, 1.0]
        assert dwa.samples(2.0, 0.5, 0.0, 1.0, 2) == [1.5, 1.5]

    def test_euler_turns_after_it_moves(self):
        poses = dwa.rollout((0.0, 0.0, 0.0), 2.0, math.pi, 0.5, 2)
        assert poses[0] == (1.0, 0.0, math.pi / 2)
        assert poses[1] == pytest.approx((1.0, 1.0, math.pi))

    def test_mover_is_met_where_it_will_be(self):
        poses = dwa.rollout((0.0, 0.0, 0.0), 1.0, 0.0, 1.0, 2)  # at (1, 0), then (2, 0)
        mover = ((5.0, 0.0), (-1.0, 0.0), 0.25)  # at (4, 0), then (3, 0)
        assert dwa.rollout_clearance(poses, 1.0, 0.5, lambda x, y: 9.0, [], [mover]) == 1.0 - 0.25 - 0.5
        square = ((2.0, 2.0), 0.5)
        assert dwa.rollout_clearance(poses, 1.0, 0.5, lambda x, y: 9.0, [square], []) == 1.5 - 0.5

    def test_admissible_needs_room_to_stop_and_to_stop_turning(self):
        assert dwa.is_admissible(1.0, 1.0, 0.5, ROBOT)  # √(2 · 0.5 · 1) = 1
        assert not dwa.is_admissible(1.0, 1.0, 0.49, ROBOT)
        assert dwa.is_admissible(0.1, 1.0, 0.25, ROBOT)  # √(2 · 0.25 · 2) = 1
        assert not dwa.is_admissible(0.1, 1.0, 0.24, ROBOT)
        assert not dwa.is_admissible(-1.0, 0.0, 0.49, ROBOT)
        assert not dwa.is_admissible(0.0, 0.0, 0.0, ROBOT)

    def test_heading_term_is_pi_ahead_and_zero_behind(self):
        assert dwa.heading_term((1.0, 1.0, 0.0), (3.0, 1.0)) == math.pi
        assert dwa.heading_term((1.0, 1.0, 7 * math.pi), (3.0, 1.0)) == pytest.approx(0.0)
        assert dwa.heading_term((1.0, 1.0, 2.0), (1.0, 1.0)) == math.pi
        assert dwa.heading_term((1.0, 1.0, 0.0), (1.0, 2.0)) == pytest.approx(math.pi / 2)

    def test_normalisations(self):
        values, good = [1.0, 3.0, 100.0], [True, True, False]
        assert dwa.normalised(values, good, "sum", 2.0)[:2] == [0.25, 0.75]
        assert dwa.normalised(values, good, "minmax", 2.0)[:2] == [0.0, 1.0]
        assert dwa.normalised(values, good, "none", 2.0)[:2] == [0.5, 1.5]
        assert dwa.normalised([2.0, 2.0], [True, True], "minmax", 2.0) == [0.0, 0.0]
        assert dwa.normalised([0.0, 0.0], [True, True], "sum", 2.0) == [0.0, 0.0]

    def test_straight_ahead_wins_and_the_slower_of_equals(self):
        chosen = decide()
        # v in {0, 0.5, 1}, yaw in {-1, 0, 1}: all three straight rollouts face the target, the first wins.
        assert (chosen.index, chosen.v, chosen.yaw_rate) == (1, 0.0, 0.0)
        chosen = decide(weights=dwa.Weights(0.0, 0.0, 1.0, 0.0))
        assert (chosen.index, chosen.v, chosen.yaw_rate) == (6, 1.0, -1.0)

    def test_nothing_admissible_brakes_and_turns_to_the_target(self):
        chosen = decide(static_distance=lambda x, y: 0.5, v=0.75, local_target=(0.0, 4.0))
        assert (chosen.v, chosen.yaw_rate, chosen.index) == (0.25, 1.0, -1)
        robot = dwa.Robot(-1.0, 1.0, 1.0, 1.0, 2.0, 1.0, 2.0, 0.5)
        chosen = decide(static_distance=lambda x, y: 0.5, v=0.25, local_target=(4.0, -1e-3), robot=robot)
        assert (chosen.v, chosen.index) == (0.0, -1)
        assert chosen.yaw_rate == pytest.approx(-0.25e-3 / 0.5)


class TestMetrics:
    POSITIONS = ((0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (1.0, 2.0), (0.0, 2.0))
    HEADINGS = tuple(map(math.radians, (0, 90, 90, 180, -170)))

    def test_length_and_angles(self):
        assert metrics.length(self.POSITIONS) == 4.0
        assert [round(math.degrees(c)) for c in metrics.changes(self.HEADINGS)] == [90, 0, 90, 10]
        turned = math.radians(190)
        assert metrics.angle_over_length(self.POSITIONS, self.HEADINGS) == pytest.approx(turned / 4)
        # moving steps: 90° over 1 m, 0° over 2 m, 10° over 1 m
        assert metrics.curvature(self.POSITIONS, self.HEADINGS) == pytest.approx(math.radians(100) / 3)
        assert metrics.curvature(self.POSITIONS[:1], self.HEADINGS[:1]) == 0.0

    @pytest.mark.parametrize(("degrees", "turns"), [
        ([0, 90, 90, 180], 2),  # a straight step parts them
        ([0, 8, 16], 1),
        ([0, 8, 8, 16], 0),
        ([0, 15], 0),
        ([0, 10, 0, 10, 0], 0),  # to and fro
        ([0, 20, 0, 20], 3),
        ([170, 179, -172], 1),  # across ±180°
        ([5], 0),
    ])
    def test_a_turn_counts_once_past_fifteen_degrees(self, degrees, turns):
        assert metrics.driven_breaking_points([math.radians(d) for d in degrees]) == turns

    def test_danger_intervals(self):
        assert metrics.driven_danger_points([0.1, 0.3, 0.1, 0.1, 0.2, 0.1], 0.2) == 3
        assert metrics.driven_danger_points([], 0.2) == 0

    def test_commands_jerk_and_scores(self):
        assert metrics.command_variation([0.0, 1.0, 0.5], [0.0, -1.0, 1.0]) == 1.5 + 3.0
        cubic = [(float(t**3), 0.0) for t in range(5)]  # third difference of t³ is 6
        assert metrics.jerk(cubic, 0.5) == 6 / 0.125
        assert metrics.jerk(cubic[:3], 0.5) == 0.0
        assert metrics.spl(True, 4.0, 5.0) == 0.8
        assert metrics.spl(True, 4.0, 3.0) == 1.0
        assert metrics.spl(False, 4.0, 5.0) == 0.0
        assert metrics.barn_score(True, 1.0, 10.0) == 0.5  # T* = 5 s, clipped to 10 s
        assert metrics.barn_score(True, 20.0, 10.0) == 0.25
        assert metrics.barn_score(True, 99.0, 10.0) == 0.125

    def test_planned_points(self):
        path = [(0, 0), (1, 1), (2, 2), (2, 3)]
        assert metrics.planned_breaking_points(path) == 1
        assert metrics.planned_breaking_points([(0, 0)]) == 0
        occupied = drawn(".#..", "....", ".#..", "....")  # beside the first and second diagonal steps
        assert metrics.planned_danger_points(occupied, path) == 2
        # The straight line from (0.5, 0.5) to (2.5, 2.5) passes through corners (1, 1) and (2, 2).
        assert metrics.polyline_danger_points(occupied, [(0.5, 0.5), (2.5, 2.5)]) == 2
        assert metrics.polyline_danger_points(occupied, [(0.5, 0.5), (0.5, 3.5)]) == 0
        # A line of slope 3/4 from (0.5, 0.5) is exactly 0.1 from (1, 1), which is not closer than 0.1.
        end = (Fraction(9, 2), Fraction(7, 2))
        half = Fraction(1, 2)
        assert metrics.polyline_danger_points(drawn("....", ".#..", "....", "...."), [(half, half), end]) == 0
        assert metrics.polyline_danger_points(occupied, [(1.5, 1.5), (2.5, 1.5), (1.5, 1.5)]) == 0


class TestPrediction:
    disc = prediction.Outline(0.5)
    wall = prediction.Surroundings(lambda x, y: 4.0 - x)  # everything beyond x = 4

    def test_braking_takes_one_step_at_the_command(self):
        speeds, yaw_rates = prediction.braking(1.0, -0.5, 0.4, 0.2, 4)
        assert speeds == pytest.approx([1.0, 0.6, 0.2, 0.0])
        assert yaw_rates == pytest.approx([-0.5, -0.3, -0.1, 0.0])

    def test_candidate_drives_on_or_stays_where_it_would_be_too_near(self):
        through = prediction.outlook((0, 0, 0), [1.0] * 4, [0.0] * 4, 4, 1.0, 1, self.disc, self.wall)
        assert through.end == pytest.approx((4.0, 0.0, 0.0))
        assert through.middle == pytest.approx((2.0, 0.0))
        assert through.static == pytest.approx(-0.5)
        stays = prediction.outlook((0, 0, 0), [1.0] * 4, [0.0] * 4, 4, 1.0, 1, self.disc, self.wall, room=0.6)
        assert stays.end == pytest.approx((2.0, 0.0, 0.0))
        assert stays.static == pytest.approx(0.5)  # of the point it did not go to
        assert stays.closest_call == pytest.approx(0.1)

    def test_step_of_two_goes_along_the_mean_heading(self):
        # A right angle between the two control steps: 2 m along 45°.
        ahead = prediction.outlook((0, 0, 0), [1.0], [math.pi / 2], 1, 1.0, 2, self.disc, self.wall)
        assert ahead.end == pytest.approx((math.sqrt(2), math.sqrt(2), math.pi))
        assert ahead.headings == pytest.approx((math.pi,))

    def test_mover_is_met_with_its_margin_at_the_heading_of_then(self):
        around = prediction.Surroundings(lambda x, y: 9.0, movers=(((5.0, 0.0), (-1.0, 0.0), 0.5),), margin=0.1,
                                         growth=0.2)
        rod = prediction.Outline(0.5, (-1.0, 1.0))
        assert around.moving(rod, 0.0, 0.0, 0.0, 1.0) == pytest.approx(4 - 1 - 0.5 - 0.5 - 0.3)
        assert around.moving(rod, 0.0, 0.0, math.pi / 2, 1.0) == pytest.approx(math.sqrt(17) - 1.3)
        ahead = prediction.outlook((0, 0, 0), [0.0] * 4, [0.0] * 4, 2, 1.0, 1, rod, around)
        assert ahead.contact_time == 3.0  # 5 − 3 − 1 − 1 − 0.7 is the first below 0
        assert ahead.moving == pytest.approx(1 - 1 - 1 - 0.9)

    def test_squares_count_like_the_map(self):
        around = prediction.Surroundings(lambda x, y: 9.0, squares=(((3.0, 0.0), 1.0),))
        assert around.static(self.disc, 0.0, 0.0, 0.0) == pytest.approx(1.5)


class TestRoute:
    angle = ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0))

    def test_feet_of_every_segment(self):
        assert route.feet(self.angle, 5.0, 1.0) == [(math.sqrt(2), 4.0), (1.0, 5.0)]
        assert route.feet(((1.0, 1.0), (1.0, 1.0)), 1.0, 4.0) == [(3.0, 0.0)]

    def test_places(self):
        assert [route.place(self.angle, along) for along in (-1.0, 1.0, 4.0, 6.0, 9.0)] == [
            (0.0, 0.0), (1.0, 0.0), (4.0, 0.0), (4.0, 2.0), (4.0, 3.0)]  # fmt: skip
