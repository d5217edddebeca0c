"""A softened decision is the hard one in the limit, and nothing in particular where all is soft."""

import numpy as np
import pytest

from adwa_jax.presets import paper
from scenarios.errors import InputError
from scenarios.suite import make_suite
from tuning.replay import replay
from tuning.softened import softened
from tuning.stages import moment

VALUES, TEMPERATURES = np.array([0.0, 0.3, 2.0]), (1e-5, 0.03, 1e5)


@pytest.fixture(scope="module")
def driven():
    return replay(make_suite("paper-15", 0, 1).scenarios[0], paper())


@pytest.fixture(scope="module")
def found(driven):
    return softened(driven, paper(), 80, "clearance", VALUES, TEMPERATURES)


def test_shares_sum_to_1_and_gather_on_the_chosen_candidate_as_it_cools(driven, found):
    chosen = moment(driven, paper(), 80).chosen
    assert found.share.shape == (3, 11, 21)
    np.testing.assert_allclose(found.share.sum(axis=(1, 2)), 1.0, rtol=1e-5)
    assert found.share[0][chosen] == pytest.approx(1.0, abs=1e-3)
    assert 1 / 231 < found.share[1][chosen] < 1.0
    np.testing.assert_allclose(found.share[2], 1 / 231, rtol=1e-3)


def test_the_window_is_that_of_the_decision(driven, found):
    here = moment(driven, paper(), 80)
    np.testing.assert_array_equal(found.v, here.v)
    np.testing.assert_array_equal(found.yaw_rate, here.yaw_rate)


def test_without_softness_the_command_is_the_hard_one_for_every_value_of_the_weight(driven):
    found = softened(driven, paper(), 80, "clearance", VALUES, TEMPERATURES, margin=1e-5)
    assert found.hard.shape == (3, 2)
    np.testing.assert_allclose(found.soft[0], found.hard, atol=1e-3)
    np.testing.assert_allclose(found.hard[1], [driven.trace.robot.v[80], driven.trace.robot.yaw_rate[80]], atol=1e-5)


def test_the_hottest_command_is_the_middle_of_the_window_whatever_the_weight(found):
    middle = np.broadcast_to([found.v.mean(), found.yaw_rate.mean()], (3, 2))
    np.testing.assert_allclose(found.soft[2], middle, atol=1e-3)


def test_a_step_that_was_not_driven_is_refused(driven):
    with pytest.raises(InputError, match="must be one that was driven"):
        softened(driven, paper(), 100_000, "clearance", VALUES, TEMPERATURES)
