import moocore
import numpy as np
import pytest

from tests.test_tuning.test_methods.problems import dtlz2, problem, searched, sphere, walled_sphere
from tuning.methods.cmaes import Seen, cmaes, ranks
from tuning.methods.sobol import sobol
from tuning.objectives import Scores


@pytest.mark.parametrize("centre", [0.7, 0.0])
def test_it_finds_the_least_of_one_objective_inside_the_cube_and_in_its_corner(centre):
    points = np.concatenate(searched(cmaes, problem(5, 1, 480, scalarisations=1), sphere(centre)))
    assert sphere(centre)(points).objectives.min() < 1e-3


def test_its_searches_come_as_near_to_the_front_as_they_can():
    """On the front the objectives' squares sum to 1."""
    last = {method: dtlz2(np.concatenate(searched(method, problem(7, 4, 1024), dtlz2)[-4:])).objectives
            for method in (cmaes, sobol)}  # fmt: skip
    distance = {method: np.median(np.linalg.norm(values, axis=1)) - 1.0 for method, values in last.items()}
    assert distance[cmaes] < 0.05 < 0.2 < distance[sobol]
    assert np.sum(moocore.is_nondominated(np.round(last[cmaes], 2))) >= 4


def test_it_settles_where_the_constraints_hold():
    points = np.concatenate(searched(cmaes, problem(3, 1, 480, scalarisations=1), walled_sphere))
    scores = walled_sphere(points)
    assert scores.objectives[scores.violation == 0.0].min() == pytest.approx(0.04, abs=1e-3)
    assert np.abs(points[-1] - [0.7, 0.5, 0.5]).max() < 0.1


def test_a_search_that_has_converged_starts_again_elsewhere():
    """The only point worth anything is the start's: all steps shrink until there is nothing left to search."""
    asked = searched(cmaes, problem(2, 1, 4000, scalarisations=1, step=0.001), sphere(0.3))
    centres = np.array([points.mean(axis=0) for points in asked])
    jumps = np.linalg.norm(np.diff(centres, axis=0), axis=1)
    assert np.any(jumps[50:] > 0.1)


def test_violation_comes_before_any_scalarised_objective():
    """Weighted maxima 0.5, 0.1 and 0.4, and 0.05 of the sums; the second violates a little, the last more."""
    scores = Scores(np.array([[1.0, 0.0], [0.1, 0.2], [0.2, 0.8], [0.0, 0.0]]), np.array([0.0, 1e-6, 0.0, 2.0]))
    np.testing.assert_array_equal(ranks(scores, np.array([0.5, 0.5])), [1, 2, 0, 3])


def test_objectives_are_scaled_by_the_front_of_what_is_allowed():
    seen = Seen(np.empty((0, 2))).joined(Scores(np.array([[0.0, 30.0], [2.0, 10.0], [2.0, 40.0], [-9.0, 0.0]]),
                                                np.array([0.0, 0.0, 0.0, 1.0])))  # fmt: skip
    np.testing.assert_array_equal(seen.scaled(np.array([[1.0, 20.0], [2.0, 50.0]])), [[0.5, 0.5], [1.0, 2.0]])
