"""What may be tuned."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adwa_jax.heuristic_weight import WeightRule
from adwa_jax.presets import extended, paper
from scenarios.errors import InputError
from tuning.space import Parameter, Space, constant, tunable, with_constants

SPACE = Space((Parameter("clearance", 0.01, 1.0, "log"), Parameter("progress", 0.5, 1.5),
               Parameter("horizon_steps", 6, 9, "integer")), extended())  # fmt: skip
RULE_OF_EQ5 = Space(tuple(Parameter(name, low, high) for name, low, high in (
    ("dense_base", 0.1, 1.0), ("dense_gain", 0.2, 2.0), ("sparse_base", 1.0, 2.0), ("sparse_gain", 0.0, 2.0),
    ("dense_ratio", 0.8, 2.0), ("sparse_ratio", 0.1, 1.0))), paper())  # fmt: skip


def test_the_ends_and_the_middle_of_every_scale_are_where_they_should_be():
    values = SPACE.values(np.array([[0.0, 0.0, 0.0], [0.5, 0.5, 0.5], [1.0, 1.0, 1.0]]))
    np.testing.assert_allclose(values, [[0.01, 0.5, 6], [0.1, 1.0, 8], [1.0, 1.5, 9]], rtol=1e-12)


def test_whole_numbers_have_equal_shares_of_the_range():
    unit = np.stack([np.zeros(400), np.zeros(400), (np.arange(400) + 0.5) / 400], axis=1)
    counts = np.unique(SPACE.values(unit)[:, 2], return_counts=True)
    np.testing.assert_array_equal(counts, [[6, 7, 8, 9], [100, 100, 100, 100]])


@given(st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3))
def test_unit_is_the_inverse_of_values(point):
    values = SPACE.values(np.array([point]))
    np.testing.assert_allclose(SPACE.values(SPACE.unit(values)), values, rtol=1e-9)


@given(st.lists(st.floats(0.0, 1.0), min_size=6, max_size=6))
def test_every_point_keeps_the_promise_of_eq_5_within_the_ranges(point):
    values = RULE_OF_EQ5.values(np.array([point]))[0]
    WeightRule(**dict(zip(RULE_OF_EQ5.names, np.float32(values).tolist(), strict=True)))
    for parameter, value in zip(RULE_OF_EQ5.parameters, values, strict=True):
        assert parameter.low <= value <= parameter.high


def test_what_keeps_the_promise_is_not_moved():
    values = RULE_OF_EQ5.values(RULE_OF_EQ5.unit(np.array([[0.5, 0.5, 1.2, 0.6, 1.5, 0.5]])))
    np.testing.assert_allclose(values, [[0.5, 0.5, 1.2, 0.6, 1.5, 0.5]], rtol=1e-9)


def test_a_gain_too_large_gives_way_first():
    base, gain = RULE_OF_EQ5.values(RULE_OF_EQ5.unit(np.array([[0.7, 2.0, 1.2, 0.6, 1.5, 0.5]])))[0, :2]
    assert base == pytest.approx(0.7)
    assert gain == pytest.approx((1 - 0.7) * 1.5, rel=1e-3)


def test_a_candidates_constants_stand_in_the_planner_and_nothing_else_changes():
    made = SPACE.preset(np.array([0.2, 0.9, 7.0]))
    before = extended()
    weights = replace(before.constants.weights, clearance=0.2, progress=0.9)
    assert made.constants == replace(before.constants, weights=weights)
    assert made.options == replace(before.options, dwa=replace(before.options.dwa, horizon_steps=7))


def test_without_counts_the_options_are_the_same_object_so_that_nothing_compiles_anew():
    config = paper()
    assert with_constants(config, {"clearance": 0.4}).options is config.options


@pytest.mark.parametrize("config", [paper(), extended()], ids=["paper", "extended"])
def test_every_tunable_constant_can_be_read_and_set(config):
    for name in tunable(config.options.rules):
        value = constant(config, name)
        assert constant(with_constants(config, {name: value}), name) == value


@pytest.mark.parametrize(("arguments", "expected"), [
    (("clearance", 1.0, 0.5), "0 ≤ low < high"),
    (("clearance", -1.0, 0.5), "0 ≤ low < high"),
    (("clearance", float("nan"), 0.5), "0 ≤ low < high"),
    (("clearance", 0.0, 0.5, "log"), "above 0 on a log scale"),
    (("clearance", 0.0, 1.0, "cubic"), "must be one of linear, log, integer"),
    (("clearance", 0.0, 1.0, "integer"), "must be linear or log"),
    (("horizon_steps", 6.0, 9.0), "must be integer"),
    (("horizon_steps", 6.5, 9.0, "integer"), "whole numbers"),
])  # fmt: skip
def test_a_parameter_without_sense_is_refused(arguments, expected):
    with pytest.raises(InputError, match=expected):
        Parameter(*arguments)


def test_a_constant_without_effect_is_refused():
    with pytest.raises(InputError, match="progress: cannot be tuned"):
        Space((Parameter("progress", 0.0, 1.0),), paper())


def test_ranges_that_cannot_keep_eq_5_are_refused():
    with pytest.raises(InputError, match="sparse_base"):
        Space((Parameter("sparse_base", 0.5, 2.0),), paper())
    with pytest.raises(InputError, match="dense_base"):
        Space((Parameter("dense_base", 0.9, 1.0),), paper())
