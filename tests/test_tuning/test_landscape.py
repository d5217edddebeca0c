"""Losses and slopes over two constants, with a planner made up so that both are known."""

import numpy as np
import pytest

from adwa_jax.episode import Outcome
from adwa_jax.presets import paper
from adwa_jax.relaxed_drive import Stretch
from scenarios.suite import Suite
from tuning import landscape
from tuning.engine import Judged
from tuning.gradients import Scaling, probes_about
from tuning.landscape import (
    Terrain,
    agreement_at,
    halves_agree,
    hard_losses,
    hard_slopes_at,
    interval,
    lattice,
    mean_cosine,
    own_slopes,
    probed_about,
    rank_agreement,
    resampled,
    scaling_from,
    sign_agreement,
)
from tuning.objectives import Goals, Statistic
from tuning.space import Parameter, Space
from tuning.surrogate import Look

SPACE = Space((Parameter("clearance", 0.0, 1.0), Parameter("velocity", 0.0, 2.0)), paper())
NAMES = ("a", "b", "c", "d")
SUITE = Suite("made up", (None,) * len(NAMES), NAMES, {})  # pyright: ignore[reportArgumentType]
TERRAIN = Terrain(SPACE, Goals((Statistic("time", "min"),)), np.array([1.0]), SUITE, Look(Stretch(2), 1, 1), 2)
TENTHS = Scaling(np.array([0.0]), np.array([10.0]))  # of a second: far from where an objective counts no more


def times_of(candidates, scenarios):
    """clearance + s · velocity on scenario s, [W, S]."""
    weights = np.array([(candidate.weights.clearance, candidate.weights.velocity) for candidate in candidates])
    return weights[:, :1] + np.arange(scenarios) * weights[:, 1:]


@pytest.fixture(autouse=True)
def made_up(monkeypatch):
    def judged(scenarios, candidates, options):
        time = times_of(candidates, len(scenarios))
        reached = np.full(time.shape, Outcome.REACHED)
        return Judged({"outcome": reached, "time": time}, np.ones(time.shape, bool), 0)

    monkeypatch.setattr(landscape, "judge_pairs", judged)


def test_a_lattice_has_the_middles_of_its_cells():
    assert lattice(2).tolist() == [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]]


def test_hard_losses_are_those_of_the_constants_scaled_by_what_was_seen():
    judged = landscape.judged_at(TERRAIN, np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.5]]))
    scaling = scaling_from(TERRAIN, judged)  # times 0, 1, and 0.5 + 1 · (0 + 1 + 2 + 3) / 4 = 2
    np.testing.assert_allclose(hard_losses(TERRAIN, judged, scaling), [0.0, 0.5, 1.0])
    np.testing.assert_allclose(hard_losses(TERRAIN, judged, scaling, np.array([0, 0])), [0.0, 0.5, 0.25])


def test_hard_slopes_are_in_the_unit_square_and_resampled_alike_at_every_point():
    points = np.array([[0.5, 0.5], [0.3, 0.7]])
    found = probed_about(TERRAIN, points, 2, 0.1, seed=0)
    slopes = hard_slopes_at(TERRAIN, found, TENTHS, resamples=20, seed=1)
    assert slopes.shape == (2, 21, 2)
    # Time is x + s · 2y [s] for the unit square's (x, y); the mean of s is 1.5.
    np.testing.assert_allclose(slopes[:, 0], [[0.1, 0.3], [0.1, 0.3]], atol=1e-9)
    np.testing.assert_allclose(slopes[0], slopes[1], atol=1e-9)
    assert np.ptp(slopes[0, 1:, 1]) > 0
    # The surrogate's, from gradients by scenario, with the same draws.
    each = 0.1 * np.stack([np.ones(4), 2.0 * np.arange(4)], axis=1)[None]
    np.testing.assert_allclose(resampled(each, 20, seed=1)[0], slopes[0], atol=1e-9)


def test_slopes_of_some_scenarios_are_theirs():
    found = probed_about(TERRAIN, np.array([[0.5, 0.5]]), 2, 0.1, seed=0)
    slopes = hard_slopes_at(TERRAIN, found, TENTHS, 0, 0, np.array([0, 2]))  # the mean of s is 1
    np.testing.assert_allclose(slopes, [[[0.1, 0.2]]], atol=1e-9)


def test_halves_agree_by_their_mean_over_random_splits():
    found = probed_about(TERRAIN, np.array([[0.5, 0.5]]), 2, 0.1, seed=0)
    # Slopes (1, 2s): of scenarios 0 and 1 against 2 and 3 (1, 1) and (1, 5), of 0 and 2 against 1 and 3 (1, 2) and
    # (1, 4), of 0 and 3 against 1 and 2 (1, 3) twice.
    cosines = 6 / 52**0.5, 9 / 85**0.5, 1.0
    agree = halves_agree(TERRAIN, found, TENTHS, 60, 0)
    assert (agree.low, agree.high) == pytest.approx((cosines[0], cosines[2]))
    assert agree.value == pytest.approx(np.mean(cosines), abs=0.03)


def test_a_loss_has_the_slope_that_its_values_at_the_probes_have():
    probes = [probes_about(np.array(centre), np.array([True, True]), 2, 0.05, np.random.default_rng(0))
              for centre in ((0.5, 0.5), (0.2, 0.4))]  # fmt: skip
    x, y = np.concatenate([probe.points for probe in probes]).T
    losses = np.stack([x * x, 3.0 * y], axis=1)  # two scenarios
    np.testing.assert_allclose(own_slopes(probes, losses), [[[1.0, 0], [0, 3]], [[0.4, 0], [0, 3]]], atol=1e-9)


def test_agreement_over_points_by_hand():
    # As estimated: right angle, same direction. In the only resample: same, opposite.
    first = np.array([[[1.0, 0.0], [1.0, 1.0]], [[2.0, 1.0], [1.0, 1.0]]])
    second = np.array([[[0.0, 1.0], [2.0, 2.0]], [[4.0, 2.0], [-1.0, -1.0]]])
    assert mean_cosine(first, second) == pytest.approx((0.5, 0.0, 0.0))
    assert sign_agreement(first, second) == pytest.approx((0.5, 0.5, 0.5))
    found = agreement_at(first, second)
    assert found["cosine"] == pytest.approx([0.0, 1.0])
    assert found["cosine_low"] == pytest.approx([1.0, -1.0])
    assert found["sign_agreement"] == pytest.approx([1.0, 0.0])  # of the resample


def test_an_interval_is_of_the_resamples_and_without_any_of_no_width():
    assert interval(np.array([7.0, *np.arange(101.0)])) == pytest.approx((7.0, 2.5, 97.5))
    assert interval(np.array([7.0])) == (7.0, 7.0, 7.0)


def test_ranks_agree_where_the_order_is_the_same():
    judged = landscape.judged_at(TERRAIN, np.array([[0.1, 0.0], [0.2, 0.0], [0.3, 0.0]]))
    rising = np.array([[1.0], [10.0], [11.0]]) * np.ones(2)
    assert rank_agreement(TERRAIN, judged, TENTHS, rising, 5, 0) == pytest.approx((1.0, 1.0, 1.0))
    assert rank_agreement(TERRAIN, judged, TENTHS, -rising, 5, 0) == pytest.approx((-1.0, -1.0, -1.0))
    assert rank_agreement(TERRAIN, judged, TENTHS, np.ones((3, 2)), 5, 0) == (0.0, 0.0, 0.0)
