import moocore
import numpy as np
import pytest
from pydantic import ValidationError

from tests.test_tuning.test_methods.problems import cube, dtlz2, problem, searched, walled_sphere
from tuning.methods.nsga3 import Settings, nsga3
from tuning.methods.sobol import sobol


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_it_dominates_more_than_quasi_random_points_do_at_equal_candidates(seed):
    volumes = [moocore.hypervolume(dtlz2(np.concatenate(searched(method, problem(8, 4, 512, seed), dtlz2))).objectives,
                                   ref=[1.2] * 4) for method in (nsga3, sobol)]  # fmt: skip
    assert volumes[0] >= 1.15 * volumes[1]


def test_the_default_constants_are_in_the_first_generation():
    space = cube(5)
    first = searched(nsga3, problem(5, 4, 32), dtlz2)[0]
    np.testing.assert_allclose(space.values(first[:1])[0], space.default)
    assert len(np.unique(first, axis=0)) == len(first) == 16


def test_a_population_larger_than_the_budget_is_cut():
    assert [len(points) for points in searched(nsga3, problem(5, 4, 20, population=64), dtlz2)] == [20]


def test_it_settles_where_the_constraints_hold():
    last = np.concatenate(searched(nsga3, problem(3, 1, 640), walled_sphere)[-5:])
    scores = walled_sphere(last)
    assert np.mean(scores.violation == 0.0) > 0.5
    assert scores.objectives[scores.violation == 0.0].min() == pytest.approx(0.04, abs=0.005)


def test_unknown_settings_are_refused():
    with pytest.raises(ValidationError):
        Settings(size=3)  # pyright: ignore[reportCallIssue]
