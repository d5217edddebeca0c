import numpy as np
import pytest

from tests.test_tuning.test_methods.problems import dtlz2, nothing_allowed, problem, searched
from tuning.methods.cmaes import cmaes
from tuning.methods.nsga3 import nsga3
from tuning.methods.sobol import sobol
from tuning.methods.sweep import sweep

METHODS = {"sobol": (sobol, {"generation": 8}), "sweep": (sweep, {}), "nsga3": (nsga3, {"population": 8}),
           "cmaes": (cmaes, {"scalarisations": 2, "population": 4})}  # fmt: skip
every_method = pytest.mark.parametrize(("method", "settings"), METHODS.values(), ids=METHODS)


@every_method
def test_a_killed_search_that_is_sent_the_same_scores_goes_on_with_the_same_bits(method, settings):
    of = problem(5, 4, 44, **settings)
    whole = searched(method, of, dtlz2)
    for known in range(1, len(whole)):
        np.random.seed(known)  # noqa: NPY002 nothing may depend on numpy's global stream
        search = method(of)
        again = [next(search)] + [search.send(dtlz2(points)) for points in whole[:known]]
        assert [points.tobytes() for points in again] == [points.tobytes() for points in whole[: known + 1]]


@every_method
def test_a_search_leaves_the_global_stream_of_numpy_alone(method, settings):
    np.random.seed(7)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    searched(method, problem(5, 4, 44, **settings), dtlz2)
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002


@every_method
@pytest.mark.parametrize("candidates", [10, 44, 45])
def test_the_budget_is_never_exceeded_and_points_lie_in_the_cube(method, settings, candidates):
    points = np.concatenate(searched(method, problem(5, 4, candidates, **settings), dtlz2))
    assert len(points) <= candidates if method is sweep else len(points) == candidates
    assert points.dtype == np.float64
    assert np.all((points >= 0.0) & (points <= 1.0))


@pytest.mark.parametrize("method", [sobol, nsga3, cmaes])
def test_seeds_differ(method):
    first, second = (np.concatenate(searched(method, problem(5, 4, 32, seed), dtlz2)) for seed in (1, 2))
    assert not np.any(np.all(first[1:] == second[1:], axis=1))


@every_method
def test_where_nothing_is_allowed_the_search_still_spends_its_budget(method, settings):
    count = sum(map(len, searched(method, problem(5, 4, 40, **settings), nothing_allowed)))
    assert count == sum(map(len, searched(method, problem(5, 4, 40, **settings), dtlz2))) >= 35


@every_method
def test_one_parameter_and_one_objective_will_do(method, settings):
    points = np.concatenate(searched(method, problem(1, 1, 20, **settings), lambda x: dtlz2_first(x)))
    assert points.shape == (20, 1)


def dtlz2_first(points):
    padded = np.concatenate([points, np.full((len(points), 3), 0.5)], axis=1)
    scores = dtlz2(padded)
    return scores._replace(objectives=scores.objectives[:, :1])
