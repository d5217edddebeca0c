"""Plans without drives."""

from dataclasses import replace

import numpy as np
import pytest

from adwa_jax.episode import Outcome
from adwa_jax.heuristic_weight import WeightRule
from adwa_jax.presets import paper
from tests.test_tuning.worlds import mixed_suite
from tuning.engine import judge_pairs
from tuning.plans_only import PLANNED, judge_plans

CONFIG = paper()
SUITE = mixed_suite()
CANDIDATES = [CONFIG.constants, replace(CONFIG.constants, weight_rule=WeightRule(0.25, 0.5, 1.5, 0.5))]


@pytest.fixture(scope="module")
def planned():
    return judge_plans(SUITE.scenarios, CANDIDATES, CONFIG.options)


def test_the_figures_are_those_of_the_engine_bit_for_bit(planned):
    driven = judge_pairs(SUITE.scenarios, CANDIDATES, CONFIG.options)
    assert planned.done.all()
    assert planned.plans == driven.plans == 2 * len(SUITE.scenarios)
    assert set(planned.columns) == {*PLANNED, "outcome"}
    for name in PLANNED:
        np.testing.assert_array_equal(planned.columns[name], driven.columns[name], name)


def test_only_the_walled_goal_has_no_path(planned):
    walled = SUITE.names.index("walled")
    expected = np.where(np.arange(len(SUITE.names)) == walled, Outcome.NO_PATH, Outcome.REACHED)
    np.testing.assert_array_equal(planned.columns["outcome"], [expected, expected])
    np.testing.assert_array_equal(planned.columns["planned_length_ratio"][:, walled], 0.0)


def test_the_ratio_is_that_of_the_lengths(planned):
    reached = planned.columns["outcome"] == Outcome.REACHED
    ratio = planned.columns["planned_length"][reached] / planned.columns["optimal_length"][reached]
    np.testing.assert_array_equal(planned.columns["planned_length_ratio"][reached], ratio)
    assert (ratio >= 1.0).all()
    assert ratio.max() > 1.0  # a heavy heuristic takes a longer way somewhere


@pytest.mark.parametrize("workers", [1, 3])
def test_any_number_of_workers_gives_the_same(planned, workers):
    again = judge_plans(SUITE.scenarios, CANDIDATES, CONFIG.options, workers=workers)
    for name, values in planned.columns.items():
        np.testing.assert_array_equal(again.columns[name], values, name)
