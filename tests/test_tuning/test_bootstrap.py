import numpy as np
import pytest

from tests.reference import bootstrap as oracle
from tests.test_tuning.handmade import evaluations
from tuning.bootstrap import ResampledScores, draws, percentile_interval, resampled, resampled_scores
from tuning.objectives import NOTHING, Constraint, Goals, Statistic, estimate

STATISTICS = (
    Statistic("success", "max"), Statistic("length_ratio", "min"), Statistic("spl", "max"),
    Statistic("length_ratio", "min", 0.3), Statistic("spl", "max", 0.25), Statistic("length_ratio", "max", 0.01),
)  # fmt: skip


def random_evaluations(candidates=5, scenarios=13, seed=0):
    generator = np.random.default_rng(seed)
    reached = generator.random((candidates, scenarios)) < 0.6
    reached[0] = False  # solves nothing
    reached[1, 1:] = False  # solves one
    done = generator.random((candidates, scenarios)) < 0.9
    lengths = generator.integers(10, 14, (candidates, scenarios)) / 10.0  # with ties
    return evaluations(reached, lengths, done=done, spl=generator.random((candidates, scenarios)))


@pytest.mark.parametrize("statistic", STATISTICS, ids=lambda statistic: statistic.label)
def test_resampling_by_products_equals_writing_every_scenario_out(statistic):
    judged, drawn = random_evaluations(), draws(13, 40, seed=3)
    expected = oracle.resampled(statistic, judged.columns, judged.done, drawn)
    np.testing.assert_allclose(resampled(statistic, judged.columns, judged.done, drawn),
                               np.array(expected, np.float64), rtol=1e-6)  # fmt: skip


def test_a_long_tail_is_read_further_where_a_resample_needs_it():
    """400 scenarios, of which only the 100 longest are read at first; one resample leaves them all out."""
    judged = evaluations(np.ones((1, 400)), np.linspace(1.0, 5.0, 400)[None, :])
    statistic, drawn = Statistic("length_ratio", "min", 0.1), np.ones((2, 400))
    drawn[1, 200:], drawn[1, :200] = 0.0, 2.0
    shorter = np.linspace(1.0, 5.0, 400)[180:200].mean()  # the worst 40 of those drawn: 20 of them, twice each
    assert resampled(statistic, judged.columns, judged.done, drawn)[:, 0] == pytest.approx(
        [np.linspace(1.0, 5.0, 400)[-40:].mean(), shorter])  # fmt: skip


@pytest.mark.parametrize("statistic", STATISTICS, ids=lambda statistic: statistic.label)
def test_every_scenario_drawn_once_is_the_sample_itself(statistic):
    judged = random_evaluations()
    once = resampled(statistic, judged.columns, judged.done, np.ones((1, 13)))[0]
    np.testing.assert_allclose(once, estimate(statistic, judged.columns, judged.done), rtol=1e-6)


def test_scores_of_the_sample_itself_are_those_of_the_goals():
    judged = random_evaluations()
    goals = Goals(STATISTICS[:4], (Constraint(STATISTICS[0], 0.5), Constraint(STATISTICS[1], 1.15)))
    expected = goals.scores(judged.columns, judged.done)
    found = resampled_scores(goals, judged.columns, judged.done, np.ones((1, 13)))
    np.testing.assert_allclose(found.objectives[0], expected.objectives, rtol=1e-6)
    np.testing.assert_allclose(found.violation[0], expected.violation, rtol=1e-6)
    assert found.objectives[0, 0, 1] == NOTHING
    assert isinstance(found, ResampledScores)


def test_draws_are_of_as_many_scenarios_with_replacement_and_repeat_with_the_seed():
    drawn = draws(50, 200, seed=7)
    assert np.all(drawn.sum(axis=1) == 50)
    assert drawn.std() == pytest.approx(1.0, abs=0.05)  # each scenario's count is all but Poisson of mean 1
    np.testing.assert_array_equal(drawn, draws(50, 200, seed=7))
    assert np.any(drawn != draws(50, 200, seed=8))


def test_candidates_stay_paired():
    """One that is longer by 0.1 everywhere is longer by 0.1 in every resample."""
    lengths = np.random.default_rng(0).random(30).astype(np.float32)
    judged = evaluations(np.ones((2, 30)), np.stack([lengths, lengths + np.float32(0.1)]))
    repeats = resampled(Statistic("length_ratio", "min"), judged.columns, judged.done, draws(30, 100, seed=0))
    np.testing.assert_allclose(repeats[:, 1] - repeats[:, 0], 0.1, atol=1e-6)
    assert repeats[:, 0].std() > 0.01


def test_candidates_that_did_the_same_have_the_same_scores():
    """Products of matrices add up in another order from column to column."""
    times = np.tile(np.random.default_rng(0).random(1024), (37, 1))
    judged = evaluations(np.ones((37, 1024)), np.ones(37), time=times)
    goals = Goals((Statistic("time", "min"), Statistic("time", "min", 0.2)))
    found = resampled_scores(goals, judged.columns, judged.done, draws(1024, 33, seed=0)).objectives
    np.testing.assert_array_equal(found, np.broadcast_to(found[:, :1], found.shape))


def test_the_interval_of_a_mean_is_about_that_of_the_normal_law():
    values = np.random.default_rng(1).normal(size=400)
    judged = evaluations(np.ones((1, 400)), values[None, :])
    repeats = resampled(Statistic("length_ratio", "min"), judged.columns, judged.done, draws(400, 4000, seed=0))
    interval = percentile_interval(values.mean(), repeats[:, 0])
    half = 1.96 * values.std() / 20.0
    assert interval.low == pytest.approx(values.mean() - half, abs=0.1 * half)
    assert interval.high == pytest.approx(values.mean() + half, abs=0.1 * half)


def test_an_interval_leaves_out_resamples_in_which_nothing_counts():
    assert percentile_interval(2.0, np.array([1.0, np.nan, 3.0])) == pytest.approx((2.0, 1.05, 2.95))
    nothing = percentile_interval(float("nan"), np.array([np.nan, np.nan]))
    assert np.isnan(nothing).all()
