import moocore
import numpy as np
import pytest
from pydantic import ValidationError

from tests.test_tuning.test_methods.problems import cube, dtlz2, nothing_allowed, problem, searched, walled_sphere
from tuning.methods.nsga3 import Settings, nsga3
from tuning.methods.sobol import sobol


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("within_margins", [False, True])
def test_it_dominates_more_than_quasi_random_points_do_at_equal_candidates(within_margins, seed):
    settings = {nsga3: {"within_margins": within_margins}, sobol: {}}
    reference = beyond_default() if within_margins else [1.2] * 4
    volumes = [moocore.hypervolume(dtlz2(np.concatenate(searched(method, problem(8, 4, 512, seed, **settings[method]),
                                                                 dtlz2))).objectives, ref=reference)
               for method in (nsga3, sobol)]  # fmt: skip
    assert volumes[0] >= 1.15 * volumes[1]


def beyond_default():
    """The hypervolume's reference point in jobs: the default's figures, each worse by a tenth."""
    space = cube(8)
    return 1.1 * dtlz2(space.unit(space.default[None])).objectives[0]


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


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_it_searches_first_where_nothing_is_much_worse_than_with_the_default(seed):
    shares = {}
    for within_margins in (True, False):
        last = np.concatenate(searched(nsga3, problem(8, 4, 640, seed, within_margins=within_margins), dtlz2)[-5:])
        shares[within_margins] = np.mean(np.all(dtlz2(last).objectives <= beyond_default(), axis=1))
    assert shares[True] > 0.8
    assert shares[False] < 0.5


def test_margins_of_a_default_that_violates_a_constraint_mean_nothing():
    def judge(points):
        scores = dtlz2(points)
        return scores._replace(violation=np.maximum(scores.objectives[:, 0] - 0.5, 0.0))

    asked = [searched(nsga3, problem(8, 4, 128, within_margins=within), judge) for within in (True, False)]
    np.testing.assert_array_equal(*map(np.concatenate, asked))


def test_the_same_scores_give_the_same_candidates_where_all_violate_alike_too():
    first, second = (np.concatenate(searched(nsga3, problem(5, 4, 160), nothing_allowed)) for _ in range(2))
    np.testing.assert_array_equal(first, second)
