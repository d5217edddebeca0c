"""The terms of eqs. 8 and 9, their normalisation and their sum."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adwa_jax.rollout import RobotState
from adwa_jax.score import (
    ScoreWeights,
    Terms,
    clearance_term,
    forward_term,
    heading_term,
    mean_heading_term,
    mover_clearance_term,
    normalise,
    on_route_term,
    progress_term,
    velocity_term,
    weighted_sum,
)
from tests.reference import dwa as reference
from tests.test_adwa_jax.worlds import many_examples

PI = math.pi


term = jax.jit(heading_term)


def heading(x, y, angle, target):
    return term(jnp.float32(x), jnp.float32(y), jnp.float32(angle), jnp.float32(target))


@pytest.mark.parametrize(("pose", "target", "value"), [
    ((1, 1, 0), (3, 1), PI),  # straight ahead
    ((1, 1, PI), (3, 1), 0),  # straight behind
    ((1, 1, 0), (1, 5), PI / 2),
    ((1, 1, 0), (1, -5), PI / 2),
    ((1, 1, -PI / 4), (2, 2), PI / 2),
    ((0, 0, 3 * PI / 4), (-1, -1), PI / 2),  # across ±π
    ((2, 3, 1.234), (2, 3), PI),  # on the target
    ((0, 0, 20 * PI), (1, 0), PI),
])
def test_heading_term_by_hand(pose, target, value):
    assert float(heading(*pose, target)) == pytest.approx(value, abs=2e-5)


coordinate = st.floats(-10, 10, width=32)


@many_examples
@given(coordinate, coordinate, coordinate, st.tuples(coordinate, coordinate))
def test_heading_term_equals_double_precision_and_stays_in_range(x, y, angle, target):
    value = float(heading(x, y, angle, target))
    assert -1e-6 <= value <= PI + 1e-6
    if math.dist((x, y), target) > 1e-3:
        assert value == pytest.approx(reference.heading_term((x, y, angle), target), abs=2e-3)


def test_heading_gradients_are_finite_on_the_target_ahead_of_it_and_behind_it():
    slopes = jax.jit(jax.grad(heading_term, argnums=(0, 1, 2, 3)))
    for x, y, angle, target in (
        (2.0, 3.0, 0.3, (2.0, 3.0)),
        (0.0, 0.0, 0.0, (0.0, 0.0)),
        (1.0, 1.0, 0.0, (3.0, 1.0)),
        (1.0, 1.0, 0.0, (-1.0, 1.0)),
        (0.0, 0.0, 0.0, (1e-20, 0.0)),
        (0.0, 0.0, 0.0, (1e-30, 1e-30)),
    ):
        for slope in slopes(jnp.float32(x), jnp.float32(y), jnp.float32(angle), jnp.float32(target)):
            assert np.isfinite(slope).all(), (x, y, angle, target)
    # Target to the left: turning left, the heading grows and so does the term.
    assert float(slopes(jnp.float32(0), jnp.float32(0), jnp.float32(0), jnp.float32([1, 1]))[2]) == pytest.approx(1.0)


def test_clearance_is_capped_and_velocity_is_the_speed():
    np.testing.assert_allclose(clearance_term(jnp.float32([-0.5, 0.2, 3.0]), jnp.float32(0.5)), [-0.5, 0.2, 0.5])
    np.testing.assert_array_equal(velocity_term(jnp.float32([0.1, -0.2]), (2, 3)), np.float32([[0.1] * 3, [-0.2] * 3]))


FARTHEST = 2.0  # what a candidate can cover [m]


def test_progress_is_how_much_farther_along_the_route_and_more_is_better():
    along = jnp.float32([[3.0, 5.0, 4.5, 1.0], [7.0, -1.0, 3.0, 5.0]])
    found = progress_term(along, jnp.float32(3.0), jnp.float32(FARTHEST))
    np.testing.assert_allclose(found, [[2.0, 4.0, 3.5, 0.0], [4.0, 0.0, 2.0, 4.0]])  # in [0, 4], 2 is no progress


def test_on_route_is_how_much_nearer_to_the_route_and_more_is_better():
    apart = jnp.float32([[1.0, 0.0, 0.5, 3.0], [9.0, 1.5, 2.0, 0.25]])
    found = on_route_term(apart**2, jnp.float32(1.0), jnp.float32(FARTHEST))
    np.testing.assert_allclose(found, [[2.0, 3.0, 2.5, 0.0], [0.0, 1.5, 1.0, 2.75]], rtol=1e-6)
    on_it = on_route_term(jnp.float32([[0.0]]), jnp.float32(0.0), jnp.float32(FARTHEST))
    np.testing.assert_array_equal(on_it, [[2.0]])


def test_mover_clearance_is_capped_and_never_negative():
    found = mover_clearance_term(jnp.float32([-0.5, 0.0, 0.3, 1e6]), jnp.float32(1.0))
    np.testing.assert_allclose(found, [0.0, 0.0, 0.3, 1.0])


def test_forward_is_one_but_for_candidates_in_reverse():
    np.testing.assert_array_equal(forward_term(jnp.float32([-0.1, 0.0, 0.7]), (3, 2)), [[0, 0], [1, 1], [1, 1]])


def mean_heading(start, headings, target):
    robot = RobotState(*jnp.float32([*start, 0.0, 0.0]))
    return mean_heading_term(robot, jnp.float32(headings), jnp.float32(target), (2, len(headings[0])))


def test_mean_heading_looks_from_where_the_robot_is_over_the_whole_prediction():
    # The target is straight above. Headings of two candidates: up at once, and turning to it in two steps.
    found = mean_heading((1, 1, 0), [(PI / 2, PI / 4), (PI / 2, PI / 2)], (1, 4))
    np.testing.assert_allclose(found, [[PI, PI - PI / 8]] * 2, rtol=1e-6)
    # Straight behind at first, then a quarter of a turn to either side, across ±π.
    found = mean_heading((0, 0, 3.0), [(PI, -PI), (1.5 * PI, -1.5 * PI)], (5, 0))
    np.testing.assert_allclose(found, [[PI / 4, PI / 4]] * 2, atol=1e-5)


@many_examples
@given(st.tuples(coordinate, coordinate, coordinate), st.lists(coordinate, min_size=3, max_size=3),
       st.tuples(coordinate, coordinate))
def test_mean_heading_equals_double_precision_and_stays_in_range(start, headings, target):
    found = float(mean_heading(start, [(heading,) for heading in headings], target)[0, 0])
    assert -1e-5 <= found <= PI + 1e-5
    if math.dist(start[:2], target) > 1e-2:
        bearing = math.atan2(target[1] - start[1], target[0] - start[0])
        off = [abs(reference.wrap(heading - bearing)) for heading in headings]
        assert found == pytest.approx(PI - sum(off) / 3, abs=5e-3)


def test_gradients_of_the_terms_of_a_route_are_finite_on_it():
    def total(squared, now, along):
        return on_route_term(squared, now, 2.0) + progress_term(along, now, 2.0)

    slopes = jax.jit(jax.grad(total, argnums=(0, 1, 2)))
    for squared, now in ((0.0, 0.0), (0.0, 1.0), (1.0, 0.0)):
        assert all(np.isfinite(slope) for slope in slopes(*map(jnp.float32, (squared, now, 0.5))))


def in_use(terms):
    return [term for term in terms if term is not None]


def terms_of(values):
    """The same [V, N] values as every term."""
    return Terms(*[jnp.asarray(values, jnp.float32)] * 4)


SCALES = Terms(*map(jnp.float32, (PI, 0.5, 2.0, PI)))


@pytest.mark.parametrize(("rule", "expected"), [
    ("sum", [[0.125, 0.375], [0.5, None]]),
    ("minmax", [[0.0, 2 / 3], [1.0, None]]),
])
def test_normalisation_looks_at_admissible_candidates_only(rule, expected):
    admissible = jnp.array([[True, True], [True, False]])
    for term in in_use(normalise(terms_of([[1, 3], [4, 1000]]), admissible, SCALES, rule)):
        for found, wanted in zip(np.ravel(term), np.ravel(np.array(expected, object)), strict=True):
            assert wanted is None or float(found) == pytest.approx(wanted, rel=1e-6)


def test_none_divides_by_fixed_scales():
    found = normalise(terms_of([[1.0, 2.0]]), jnp.array([[True, False]]), SCALES, "none")
    for term, scale in zip(in_use(found), (PI, 0.5, 2.0, PI), strict=True):
        np.testing.assert_allclose(term[0, 0], 1 / scale, rtol=1e-6)


@pytest.mark.parametrize("rule", ["sum", "minmax"])
def test_normalisation_never_makes_a_nan_nor_do_its_gradients(rule):
    @jax.jit
    @jax.value_and_grad
    def total(value, admissible):
        return sum(jnp.sum(each) for each in in_use(normalise(Terms(*[value] * 4), admissible, SCALES, rule)))

    for values in ((0.0, 0.0), (2.0, 2.0), (1.0, -1.0)):
        for admissible in ((True, True), (True, False), (False, False)):
            value, slope = total(jnp.float32([values]), jnp.array([admissible]))
            assert np.isfinite(value)
            assert np.isfinite(slope).all()


def test_a_term_that_is_alike_for_all_says_nothing_under_minmax():
    for term in in_use(normalise(terms_of([[2.0, 2.0]]), jnp.array([[True, True]]), SCALES, "minmax")):
        np.testing.assert_array_equal(term, [[0.0, 0.0]])


def test_weighted_sum_is_eq_9():
    terms = Terms(*(jnp.full((1, 1), value, jnp.float32) for value in (1.0, 10.0, 100.0, 1000.0)))
    assert float(weighted_sum(terms, ScoreWeights(0.5, 0.25, 2.0, 3.0))[0, 0]) == 0.5 + 2.5 + 200 + 3000


@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf"), "0.4", True])
def test_weights_that_are_no_weights_are_refused(value):
    with pytest.raises(ValueError, match="velocity"):
        ScoreWeights(0.4, 0.4, value, 0.1)


def test_weighted_sum_takes_in_the_terms_in_use_each_by_its_own_weight():
    one = jnp.ones((1, 1), jnp.float32)
    weights = ScoreWeights(0.0, 0.0, 0.0, 0.0, progress=1.0, on_route=2.0, contact_time=4.0, mover_clearance=8.0,
                           forward=16.0)  # fmt: skip
    assert float(weighted_sum(Terms(one, one), weights)[0, 0]) == 0.0
    for name in ("progress", "on_route", "contact_time", "mover_clearance", "forward"):
        assert float(weighted_sum(Terms(one, one)._replace(**{name: one}), weights)[0, 0]) == getattr(weights, name)
