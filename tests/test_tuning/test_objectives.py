"""Objectives and constraints from measures."""

import numpy as np
import pytest

from adwa_jax.episode import Outcome
from tuning.objectives import NOTHING, Constraint, Goals, Statistic, estimate, mean_of_worst

REACHED, STUCK, HIT = int(Outcome.REACHED), int(Outcome.STUCK), int(Outcome.HIT_MOVER)
COLUMNS = {
    "outcome": np.array([[REACHED, REACHED, STUCK, HIT], [HIT, STUCK, STUCK, STUCK]], np.int32),
    "length": np.array([[4.0, 8.0, 100.0, 1.0], [1.0, 1.0, 1.0, 1.0]], np.float32),
    "spl": np.array([[1.0, 0.5, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]], np.float32),
}
ALL = np.ones((2, 4), np.bool_)


def of(measure, direction="min", counted=ALL, **more):
    return estimate(Statistic(measure, direction, **more), COLUMNS, counted)


def test_rates_count_every_scenario_that_was_judged():
    np.testing.assert_array_equal(of("success", "max"), [0.5, 0.0])
    np.testing.assert_array_equal(of("collision"), [0.25, 0.25])
    counted = np.array([[True, False, True, False], [True, False, False, False]])
    np.testing.assert_array_equal(of("success", "max", counted), [0.5, 0.0])
    np.testing.assert_array_equal(of("collision", "min", counted), [0.0, 1.0])


def test_a_length_is_that_of_the_solved_and_missing_where_none_is():
    np.testing.assert_array_equal(of("length"), [6.0, np.nan])


def test_a_measure_that_success_is_part_of_counts_every_scenario():
    np.testing.assert_array_equal(of("spl", "max"), [0.375, 0.0])


def test_the_worst_share_is_the_largest_of_what_should_be_small_and_the_smallest_of_what_should_be_large():
    values = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    assert mean_of_worst(values, Statistic("length", "min", 0.4)) == 4.5
    assert mean_of_worst(values, Statistic("spl", "max", 0.4)) == 1.5
    assert mean_of_worst(values, Statistic("spl", "max", 0.41)) == 2.0  # three of five
    assert mean_of_worst(values, Statistic("length", "min")) == 3.0


def test_scores_are_minimised_and_finite_and_who_solves_nothing_violates():
    goals = Goals((Statistic("success", "max"), Statistic("length", "min")))
    scores = goals.scores(COLUMNS, ALL)
    np.testing.assert_array_equal(scores.objectives, [[-0.5, 6.0], [0.0, NOTHING]])
    np.testing.assert_array_equal(scores.violation, [0.0, 1.0])


def test_constraints_are_violated_by_how_much_they_are_missed():
    goals = Goals((Statistic("length", "min"),),
                  (Constraint(Statistic("success", "max"), 0.75), Constraint(Statistic("collision", "min"), 0.2)))
    np.testing.assert_allclose(goals.scores(COLUMNS, ALL).violation, [0.25 + 0.05, 1.0 + 0.75 + 0.05])


@pytest.mark.parametrize(("share", "label"), [(1.0, "length"), (0.1, "length (worst 10%)")])
def test_the_label_says_which_share(share, label):
    assert Statistic("length", "min", share).label == label
