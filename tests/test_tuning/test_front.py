import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tuning.bootstrap import ResampledScores
from tuning.front import chances, front, non_dominated, thinned, unit_range
from tuning.objectives import Scores

POINTS = arrays(np.float64, st.tuples(st.integers(1, 12), st.integers(1, 4)), elements=st.integers(0, 4).map(float))


def scores(objectives, violation=None):
    objectives = np.asarray(objectives, np.float64)
    return Scores(objectives, np.zeros(len(objectives)) if violation is None else np.asarray(violation, np.float64))


def kept(objectives):
    """The front as a set of points."""
    return {tuple(point) for point in objectives[front(scores(objectives))].tolist()}


def test_a_front_drawn_by_hand():
    #  3 | a
    #  2 |    c  d         d is beaten by c, e by c and b
    #  1 |       e  b
    #      1  2  3  4
    points = [(1, 3), (4, 1), (2, 2), (3, 2), (3, 1)]
    assert non_dominated(scores(points)).tolist() == [True, False, True, False, True]
    assert front(scores(points)).tolist() == [0, 2, 4]


def test_constraints_come_before_objectives():
    points = [(0, 0), (1, 2), (2, 1), (3, 3)]
    assert front(scores(points, [0.1, 0, 0, 0])).tolist() == [1, 2]


def test_where_nothing_is_feasible_those_that_violate_least_are_left():
    points = [(0, 0), (1, 2), (2, 1), (3, 3)]
    assert front(scores(points, [0.3, 0.1, 0.1, 0.1])).tolist() == [1, 2]


def test_equals_do_not_dominate_each_other_and_stand_once_on_the_front():
    points = [(2, 2), (1, 1), (1, 1)]
    assert non_dominated(scores(points)).tolist() == [False, True, True]
    assert front(scores(points)).tolist() == [1]


def test_nothing_has_no_front():
    assert front(scores(np.zeros((0, 3)))).tolist() == []


@given(POINTS)
@settings(max_examples=60, deadline=None)
def test_a_front_is_what_no_point_beats(points):
    def beaten(point):
        return any(all(other <= point) and any(other < point) for other in points)

    assert non_dominated(scores(points)).tolist() == [not beaten(point) for point in points]


@given(POINTS, st.randoms(use_true_random=False))
@settings(max_examples=60, deadline=None)
def test_a_front_does_not_depend_on_the_order_and_is_its_own_front(points, random):
    order = list(range(len(points)))
    random.shuffle(order)
    assert kept(points[order]) == kept(points)
    assert kept(points[front(scores(points))]) == kept(points)


@given(POINTS)
@settings(max_examples=60, deadline=None)
def test_a_dominated_point_more_changes_nothing(points):
    worse = points[:1] + 1.0
    assert kept(np.concatenate([points, worse])) == kept(points)


def test_chances_count_the_resamples_in_which_nothing_beats_a_candidate():
    # b beats a in one of four, a beats b in another; c is infeasible but in one, where it alone counts for little.
    objectives = np.array([[[1, 1], [2, 0], [0, 0]], [[1, 1], [1, 0], [0, 0]], [[0, 0], [1, 1], [0, 0]],
                           [[1, 1], [2, 0], [3, 3]]], np.float64)  # fmt: skip
    violation = np.array([[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 0]], np.float64)
    assert chances(ResampledScores(objectives, violation)).tolist() == [0.75, 0.75, 0.0]


def test_thinning_keeps_the_ends_and_spreads_the_rest():
    line = np.stack([np.arange(9.0), 8.0 - np.arange(9.0)], axis=1)
    assert thinned(line, 3).tolist() == [0, 4, 8]
    assert thinned(line, 5).tolist() == [0, 2, 4, 6, 8]
    assert thinned(line, 2).tolist() == [0, 8]
    assert thinned(line, 20).tolist() == list(range(9))


def test_thinning_weighs_objectives_by_their_ranges():
    """The second objective is counted in thousands, the third says nothing."""
    line = np.stack([np.array([0.0, 0.1, 0.5, 1.0]), 1e3 * np.array([1.0, 0.9, 0.5, 0.0]), np.ones(4)], axis=1)
    assert thinned(line, 3).tolist() == [0, 2, 3]


def test_thinning_of_equals_takes_each_once():
    assert thinned(np.zeros((4, 2)), 3).tolist() == [0, 1, 2]


def test_unit_range_by_hand():
    assert unit_range(np.array([[1.0, 5.0], [3.0, 5.0], [2.0, 5.0]])) == pytest.approx(
        np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]]))  # fmt: skip
