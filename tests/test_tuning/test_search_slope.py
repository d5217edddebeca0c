import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.suite import make_suite
from tuning.gradients import probes_about, slope
from tuning.search_slope import expansions_over, smoothed
from tuning.search_study import Weighting, search_one

WEIGHT = np.linspace(0.0, 2.0, 21)


def test_a_step_becomes_a_ramp_of_the_windows_width():
    found = smoothed(WEIGHT, np.where(WEIGHT > 0.95, 6.0, 2.0)[None], 0.3)
    at = WEIGHT[found.inner]
    assert at[[0, -1]] == pytest.approx([0.3, 1.7])
    flat = (at < 0.55) | (at > 1.35)
    np.testing.assert_allclose(found.slope[0][flat], 0.0)
    # 4 over a window of 0.6; the step lies in the window of the values from 0.7 to 1.2.
    np.testing.assert_allclose(found.slope[0][(at > 0.65) & (at < 1.25)], 4.0 / 0.6)
    np.testing.assert_allclose(found.mean[0][[0, -1]], [2.0, 6.0])
    assert (np.diff(found.mean[0]) >= -1e-12).all()


def test_the_slope_is_that_of_the_mean():
    each = np.random.default_rng(0).normal(size=(3, 21))
    found = smoothed(WEIGHT, each, 0.2)
    between = np.diff(found.mean, axis=1) / 0.1
    np.testing.assert_allclose(between, (found.slope[:, 1:] + found.slope[:, :-1]) / 2, atol=1e-12)


def test_the_slope_is_what_antithetic_probes_of_one_parameter_find():
    each = np.random.default_rng(0).normal(size=(3, 21))
    found = smoothed(WEIGHT, each, 0.2)
    probes = probes_about(np.array([0.5]), np.array([True]), 4, 0.2, np.random.default_rng(0))
    places = np.round(probes.points[:, 0] / 0.1).astype(int)
    np.testing.assert_allclose(slope(each[:, places], probes)[:, 0], found.slope[:, 3])  # the mean's fourth ω is 0.5


@pytest.mark.parametrize("reach", [0.05, 0.25, 1.0])
def test_a_window_that_does_not_fit_the_values_is_refused(reach):
    with pytest.raises(InputError, match=r"reach: .*; must be whole steps of evenly spaced values, 0\.1 each"):
        smoothed(WEIGHT, np.zeros((1, 21)), reach)


def test_unevenly_spaced_values_are_refused():
    with pytest.raises(InputError, match="evenly spaced"):
        smoothed(np.array([0.0, 0.1, 0.2, 0.4, 0.5]), np.zeros((1, 5)), 0.1)


def test_expansions_are_those_of_single_searches():
    suite = make_suite("paper-15", 3, 5)
    found = expansions_over(suite, np.array([1.0, 1.5]))
    assert found.shape == (5, 2)
    for place, weight in enumerate((1.0, 1.5)):
        assert found[2, place] == int(search_one(suite.scenarios[2], Weighting(weight)).expansions)
