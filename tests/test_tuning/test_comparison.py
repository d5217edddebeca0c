import numpy as np
import pytest

from tests.test_tuning.handmade import TWO_GOALS, evaluations, solved
from tuning.comparison import compare, difference
from tuning.intervals import paired_difference
from tuning.objectives import Goals, Statistic

LENGTH = TWO_GOALS.objectives[1]


def compared(judged, recommended=1, front=(1,), goals=TWO_GOALS):
    return compare(judged, recommended, 0, front, goals, seed=0)


def test_success_is_compared_as_paired_proportions():
    """Both on 6 of 10, only the recommended on 3, neither on 1."""
    found = compared(evaluations(solved([6, 9], 10), [1.2, 1.1]))
    assert found.success == pytest.approx(paired_difference(6, 3, 0, 1))
    assert found.objectives[0] == found.success


def test_lengths_are_compared_where_both_arrive():
    """Each is at 1.1 on the easy half; who solves the hard half as well pays 2.0 there, and is no worse for it."""
    judged = evaluations(solved([5, 10], 10), np.where(np.arange(10) < 5, 1.1, 2.0) * np.ones((2, 1)))
    assert difference(judged, 1, 0, LENGTH) == 0.0
    assert compared(judged).objectives[1] == (0.0, 0.0, 0.0)


def test_pairs_tell_small_differences_that_the_scatter_of_scenarios_would_hide():
    lengths = np.random.default_rng(0).uniform(1.0, 3.0, 50)
    judged = evaluations(np.ones((2, 50)), np.stack([lengths, lengths - 0.01 * (1 + np.arange(50) % 2)]))
    value, low, high = compared(judged).objectives[1]
    assert value == pytest.approx(-0.015, abs=1e-6)
    assert -0.02 < low < value < high < -0.01


def test_without_a_scenario_that_both_solve_nothing_is_said_of_lengths():
    reached = np.array([[1, 1, 0, 0], [0, 0, 1, 1]])
    assert np.isnan(compared(evaluations(reached, [1.2, 1.1])).objectives[1]).all()


def test_a_member_that_beats_the_default_on_everything_is_named():
    judged = evaluations(solved([6, 9, 9], 10), [1.2, 1.3, 1.1])
    found = compared(judged, front=(1, None, 0, 2))
    assert (found.better_on_all, found.better_member, found.why_not) == (True, 3, "")


def test_it_is_said_on_what_the_nearest_member_is_no_better():
    found = compared(evaluations(solved([6, 9, 6], 10), [1.2, 1.2, 1.3]), front=(1, 2))
    assert (found.better_on_all, found.better_member) == (False, None)
    assert found.why_not == ("Of 2 front members the nearest to it is better on 1 of 2 objectives, but not on "
                             "length_ratio.")  # fmt: skip


def test_it_is_said_if_the_default_cannot_be_beaten():
    goals = Goals((*TWO_GOALS.objectives, Statistic("danger_points", "min")))
    judged = evaluations(solved([10, 10], 10), [1.2, 1.1], danger_points=np.zeros((2, 10), np.int32))
    assert compared(judged, goals=goals).why_not == (
        "None can: the default constants already have the best possible success and danger_points.")  # fmt: skip


def test_it_is_said_if_no_member_was_driven():
    judged = evaluations(solved([6, 9], 10), [1.2, 1.1])
    assert compared(judged, front=(None, 0)).why_not.startswith("No front member")
