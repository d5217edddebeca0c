import numpy as np
import pytest

from tests.test_tuning.handmade import SPACE, TWO_GOALS, evaluations, solved
from tuning.importance import explained, importance


def sampled(count=200, seed=0):
    return np.random.default_rng(seed).random((count, 2))


def test_a_parameter_that_decides_explains_all_and_one_without_effect_nothing():
    unit = sampled()
    lengths = np.exp(3.0 * unit[:, 0])  # any rising course: ranks see a straight one
    assert explained(unit[:, 0], lengths) == pytest.approx(1.0, abs=0.01)
    assert explained(unit[:, 1], lengths) < 0.03


def test_a_best_value_in_between_is_seen():
    unit = sampled()
    assert explained(unit[:, 0], (unit[:, 0] - 0.5) ** 2) > 0.9


def test_two_parameters_share_what_their_sum_decides():
    """2u + v of uniform u and v: 4 : 1 in the figures themselves. For the ranks F(2u + v), with the distribution F:
    E[F | u] = 1/12 + a/4 + a²/4 − a³/12 with a = 2u up to u = 1/2, odd about it; E[F | v] = c + 3v/8 + v²/8 − v³/12;
    their variances over 1/12 are 0.8119 and 0.1807.
    """
    middle = (np.arange(60) + 0.5) / 60
    first, second = (axis.ravel() for axis in np.meshgrid(middle, middle))
    total = 2.0 * first + second
    assert [explained(first, total), explained(second, total)] == pytest.approx([0.8119, 0.1807], abs=0.003)


def test_chance_alone_explains_nothing_on_average():
    found = [explained(*np.random.default_rng(seed).random((2, 40))) for seed in range(200)]
    assert np.mean(found) < 0.05  # below 0 counts as 0; unadjusted it would be 3 / 39 on average
    assert np.median(found) < 0.02


def test_sweeps_that_change_one_parameter_at_a_time_are_seen():
    """Two thirds of the candidates keep the default of each parameter."""
    steps = np.linspace(0.0, 1.0, 11)
    unit = np.concatenate([np.stack([steps, np.full(11, 0.5)], axis=1), np.stack([np.full(11, 0.5), steps], axis=1)])
    total = 3.0 * unit[:, 0] + unit[:, 1]
    first, second = (explained(parameter, total) for parameter in unit.T)
    assert first > 0.6
    assert second < 0.5 * first


@pytest.mark.parametrize(("parameter", "objective"), [
    ([0.5, 0.5, 0.5, 0.5, 0.5], [1.0, 2.0, 3.0, 4.0, 5.0]),
    ([0.1, 0.2, 0.3, 0.4, 0.5], [1.0, 1.0, 1.0, 1.0, 1.0]),
    ([0.1, 0.9], [1.0, 2.0]),
    ([0.1], [1.0]),
])  # fmt: skip
def test_what_cannot_be_told_is_nothing(parameter, objective):
    assert explained(np.array(parameter), np.array(objective)) == 0.0


def test_importance_of_a_job_is_by_parameter_and_objective():
    """Success rises with the first parameter, length with the second."""
    unit = sampled(60)
    counts = np.round(20 * unit[:, 0]).astype(int)
    judged = evaluations(solved(np.maximum(counts, 1), 20), 1.0 + unit[:, 1], values=unit)
    found = importance(judged, TWO_GOALS, SPACE)
    assert found.shape == (2, 2)
    assert found == pytest.approx(np.eye(2), abs=0.15)


def test_candidates_dropped_early_are_compared_on_what_all_have_seen():
    """On the second half, which half of them never saw, all fail: counting it would turn the picture round."""
    unit = np.linspace(0.0, 1.0, 40)[:, None] * [1.0, 0.0] + [0.0, 0.5]
    reached = np.arange(20)[None, :] < np.round(10 * unit[:, :1])
    done = np.ones((40, 20), np.bool_)
    done[:20, 10:] = False
    judged = evaluations(reached, np.ones(40), values=unit, done=done)
    assert importance(judged, TWO_GOALS, SPACE)[0, 0] > 0.95
