import numpy as np
import pytest

from tests.test_tuning.handmade import TWO_GOALS, evaluations, solved
from tuning.hypervolume import hypervolume, hypervolume_curve, margins, reference_point
from tuning.objectives import Constraint, Goals, Scores, Statistic


def test_reference_point_is_the_default_made_worse_by_a_tenth():
    goals = Goals((Statistic("success", "max"), Statistic("length_ratio", "min"), Statistic("danger_points", "min"),
                   Statistic("success", "max", 0.1), Statistic("mean_clearance", "max")))  # fmt: skip
    default = Scores(np.array([[-0.8, 1.2, 0.0, -0.1, -2.0]]), np.zeros(1))
    assert margins(goals, default) == pytest.approx([0.1, 0.12, 0.05, 0.1, 0.2])
    assert reference_point(goals, default) == pytest.approx([-0.7, 1.32, 0.05, 0.0, -1.8])


def test_volumes_by_hand():
    points = np.array([[1.0, 3.0], [3.0, 1.0], [5.0, 0.0]])  # the last lies beyond the reference
    assert hypervolume(points, np.array([4.0, 4.0]), np.ones(2)) == pytest.approx(3.0 + 3.0 - 1.0)
    assert hypervolume(points, np.array([4.0, 4.0]), np.array([2.0, 0.5])) == pytest.approx(5.0)
    assert hypervolume(points[2:], np.array([4.0, 4.0]), np.ones(2)) == 0.0
    assert hypervolume(np.array([[1.0], [2.0]]), np.array([4.0]), np.array([2.0])) == pytest.approx(1.5)


def test_from_five_objectives_on_volumes_are_close_and_repeat():
    point = np.zeros((1, 6))
    found = hypervolume(point, np.full(6, 2.0), np.full(6, 2.0))
    assert found == pytest.approx(1.0, rel=0.01)
    assert found == hypervolume(point, np.full(6, 2.0), np.full(6, 2.0))


def curve_of(goals=TWO_GOALS):
    # By generation: the default, 5 of 10 at length 2; a worse one; a better one at 7 of 10; one dropped after half.
    done = np.ones((4, 10), np.bool_)
    done[3, 5:] = False
    return hypervolume_curve(evaluations(solved([5, 4, 7, 9], 10), [2.0, 2.0, 1.8, 1.0], done=done), goals)


def test_curve_by_hand():
    """Margins are 0.1 and 0.2: the default is worth 1, the better one (0.2 + 0.1) / 0.1 · (0.2 + 0.2) / 0.2 = 6."""
    curve = curve_of()
    assert curve.episodes.tolist() == [10, 20, 30, 35]
    assert curve.value == pytest.approx([1.0, 1.0, 6.0, 6.0])
    assert curve.reference == pytest.approx([-0.4, 2.2])


def test_infeasible_candidates_are_worth_nothing():
    curve = curve_of(Goals(TWO_GOALS.objectives, (Constraint(Statistic("success", "max"), 0.6),)))
    assert curve.value == pytest.approx([0.0, 0.0, 6.0, 6.0])


def test_candidates_of_one_generation_count_together():
    judged = evaluations(solved([5, 7, 6], 10), [2.0, 2.0, 1.8], generation=[0, 1, 1])
    curve = hypervolume_curve(judged, TWO_GOALS)
    assert curve.episodes.tolist() == [10, 30]
    assert curve.value == pytest.approx([1.0, 3.0 * 1.0 + 2.0 * 2.0 - 2.0 * 1.0])
