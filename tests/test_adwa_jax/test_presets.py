"""The paper preset says what the text says, and settings refuse nonsense."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from adwa_jax.constants import Behaviour, Options, PlanOptions
from adwa_jax.presets import PRESETS, paper


def test_paper_preset_is_the_paper_s_method():
    constants, options = PRESETS["paper"]()
    assert (constants.weight_rule.dense_ratio, constants.weight_rule.sparse_ratio) == (1.5, 0.5)
    assert constants.weight_rule.dense_base + constants.weight_rule.dense_gain / 1.5 < 1
    assert constants.weight_rule.sparse_base >= 1
    assert options.plan.scope == "node"
    assert options.plan.search.corner_rule == "never"
    assert options.plan.search.stop_rule == "popped"
    assert options.plan.keypoint_rule == "anchor"
    assert options.dwa.normalisation == "sum"


def test_constants_are_leaves_and_options_are_static():
    constants, options = paper()
    assert all(np.isscalar(leaf) for leaf in jax.tree.leaves(constants))
    assert hash(options) == hash(paper().options)
    assert options == paper().options


@pytest.mark.parametrize(("field", "value"), [
    ("dt", 0.0), ("clearance_cap", 0.0), ("sensor_range", -1.0), ("stuck_time", float("nan")),
    ("danger_clearance", float("inf")), ("keypoint_tolerance", "1.0"), ("clearance_margin", -0.1),
    ("static_margin", -0.01), ("mover_growth", float("nan")), ("mover_cap", 0.0), ("lookahead", 0.0),
])
def test_nonsense_behaviour_is_refused_by_name(field, value):
    with pytest.raises(ValueError, match=field):
        replace(paper().constants.behaviour, **{field: value})
    assert isinstance(paper().constants.behaviour, Behaviour)


@pytest.mark.parametrize(("make", "field"), [
    (lambda: PlanOptions(scope="cell"), "scope"),
    (lambda: PlanOptions(keypoint_rule="last"), "keypoint_rule"),
    (lambda: PlanOptions(subdivision=0), "subdivision"),
    (lambda: Options(contact_reach=0), "contact_reach"),
])
def test_nonsense_options_are_refused_by_name(make, field):
    with pytest.raises(ValueError, match=field):
        make()
