"""Evolution strategies and agreement, by hand and on functions whose gradients are known."""

import numpy as np
import pytest

from adwa_jax.episode import Outcome
from tuning.gradients import Scaling, agreement, cosine, hard_slopes, mean_slopes, probes_about, scaling_of, slope
from tuning.objectives import NOTHING, Goals, Scores, Statistic

FREE = np.array([True, True, True])


def test_probes_lie_on_opposite_sides_and_leave_what_is_not_free():
    probes = probes_about(np.array([0.5, 0.5, 0.5]), np.array([True, False, True]), 4, 0.1, np.random.default_rng(0))
    assert probes.points.shape == (8, 3)
    np.testing.assert_allclose(probes.points[:4] + probes.points[4:], 1.0)
    assert (probes.points[:, 1] == 0.5).all()
    assert np.ptp(probes.points[:, 0]) > 0


def test_a_centre_on_the_side_of_the_cube_is_probed_from_within():
    probes = probes_about(np.array([0.0, 1.0, 0.5]), FREE, 3, 0.1, np.random.default_rng(0))
    middle = (probes.points[:3] + probes.points[3:]).mean(axis=0) / 2
    assert 0.05 < middle[0] < 0.15
    assert 0.85 < middle[1] < 0.95


def test_the_gradient_of_a_quadratic_is_exact_with_as_many_pairs_as_parameters():
    # f = 2x² + xy − z, gradient (4x + y, x, −1) = (2.3, 0.5, −1) at (0.5, 0.3, 0.4)
    probes = probes_about(np.array([0.5, 0.3, 0.4]), FREE, 3, 0.05, np.random.default_rng(1))
    x, y, z = probes.points.T
    np.testing.assert_allclose(slope(2 * x * x + x * y - z, probes), [2.3, 0.5, -1.0], atol=1e-9)


def test_several_values_a_point_have_a_gradient_each():
    probes = probes_about(np.array([0.5, 0.5, 0.5]), FREE, 6, 0.05, np.random.default_rng(1))
    values = np.stack([probes.points[:, 0], 3.0 * probes.points[:, 2]])
    np.testing.assert_allclose(slope(values, probes), [[1, 0, 0], [0, 0, 3]], atol=1e-9)


def test_cosines_by_hand():
    np.testing.assert_allclose(cosine(np.array([[1.0, 0], [1, 1], [2, 0], [0, 0]]),
                                      np.array([[0.0, 1], [1, 0], [-3, 0], [1, 1]])), [0, 0.5**0.5, -1, 0])  # fmt: skip


def test_agreement_counts_signs_and_takes_percentiles_over_the_resamples():
    surrogate = np.array([[1.0, 1.0], [1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    hard = np.array([[1.0, 1.0], [1.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [1.0, 0.0]])
    found = agreement(surrogate, hard)  # cosines 1; then 1, 1, −1, 0
    assert found.cosine == pytest.approx(1.0)
    assert (found.low, found.high) == pytest.approx(tuple(np.percentile([1, 1, -1, 0], [2.5, 97.5])))
    np.testing.assert_allclose(found.sign, [0.5, 0.75])


def test_mean_slopes_keep_what_all_scenarios_share():
    again = mean_slopes(np.array([[1.0, 0.0], [1.0, 2.0]]), 50, np.random.default_rng(0))
    np.testing.assert_allclose(again[0], [1.0, 1.0])
    assert (again[1:, 0] == 1.0).all()
    assert set(again[1:, 1]) == {0.0, 1.0, 2.0}


def test_scaling_leaves_out_means_over_nothing():
    scaling = scaling_of(Scores(np.array([[1.0, NOTHING], [3.0, 5.0], [2.0, 5.0]]), np.array([1.0, 0, 0])))
    assert scaling.best.tolist() == [1.0, 5.0]
    assert scaling.span.tolist() == [2.0, 1.0]
    # (0.5, clipped 3) with halves, then a violation of 0.1
    scores = Scores(np.array([[2.0, NOTHING], [1.0, 5.0]]), np.array([0.0, 0.1]))
    worth = scaling.scalarised(scores, np.array([0.5, 0.5]))
    np.testing.assert_allclose(worth, [1.75, 1.0])


def test_hard_gradients_are_resampled_over_the_scenarios():
    # Half of the scenarios are solved where the first coordinate is above the middle, the rest always.
    goals, scaling = Goals((Statistic("success", "max"),)), Scaling(np.array([-1.0]), np.array([1.0]))
    probes = probes_about(np.array([0.5, 0.5, 0.5]), FREE, 3, 0.1, np.random.default_rng(0))
    above = probes.points[:, :1] > 0.5
    reached = np.where(np.concatenate([np.repeat(above, 6, 1), np.ones((6, 6), bool)], axis=1), Outcome.REACHED,
                       Outcome.STUCK)  # fmt: skip
    scores = goals.scores({"outcome": reached}, np.ones((6, 12), bool))
    slopes = hard_slopes(scores, goals, probes, scaling, np.array([1.0]), 100, np.random.default_rng(0))
    np.testing.assert_allclose(slopes[0], slope(-0.5 * above[:, 0], probes))
    assert slopes[0, 0] < 0
    assert np.all(slopes[1:, 0] < 0)
    spread = slopes[1:, 0] / slopes[0, 0]  # twice the share of the first half among the drawn
    assert np.std(spread) == pytest.approx(1 / 12**0.5, rel=0.25)


def test_without_columns_pairs_are_resampled():
    goals, scaling = Goals((Statistic("success", "max"),)), Scaling(np.array([0.0]), np.array([1.0]))
    probes = probes_about(np.array([0.5, 0.5, 0.5]), FREE, 6, 0.1, np.random.default_rng(0))
    scores = Scores(probes.points[:, :1], np.zeros(12))
    slopes = hard_slopes(scores, goals, probes, scaling, np.array([1.0]), 20, np.random.default_rng(0))
    np.testing.assert_allclose(slopes[0], [1, 0, 0], atol=1e-9)
    assert slopes[1:].std() > 0
