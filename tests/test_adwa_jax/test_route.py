"""Where the robot is on its route, and the carrot that it follows."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adwa_jax.route import PLACES, SEGMENTS, ahead_of, carrot, foot_on, point_along, route_through
from tests.reference import route as reference
from tests.test_adwa_jax.worlds import few_examples, many_examples

CAPACITY = 12  # P
route_of, ahead_from = jax.jit(route_through), jax.jit(ahead_of)
foot, point = jax.jit(foot_on), jax.jit(point_along)


def route(*points):
    """A route through points, the last repeated up to the capacity."""
    return route_of(jnp.float32([*points, *[points[-1]] * (CAPACITY - len(points))]), jnp.int32(len(points)))


def ahead(points, target=1):
    return ahead_from(route(*points), jnp.int32(target))


def foot_at(found, x, y):
    """(along, distance², segment) of one point."""
    return tuple(float(leaf) for leaf in foot(found, jnp.float32(x), jnp.float32(y)))


ANGLE = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0)]
HAIRPIN = [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)]


def test_distance_along_the_route_stops_growing_at_its_end():
    np.testing.assert_array_equal(route(*ANGLE).along, [0, 4, 7, *[7] * (CAPACITY - 3)])
    np.testing.assert_array_equal(route((2.0, 2.0)).along, np.zeros(CAPACITY))


@pytest.mark.parametrize(("x", "y", "expected"), [
    (1.0, 0.5, (1.0, 0.25, 0)),
    (-2.0, 0.0, (0.0, 4.0, 0)),  # behind its beginning
    (5.0, 2.0, (6.0, 1.0, 1)),
    (4.0, 5.0, (7.0, 4.0, 1)),  # beyond its end
    (5.0, -1.0, (4.0, 2.0, 0)),  # the corner, which both segments have: the earlier
    (3.5, 0.5, (3.5, 0.25, 0)),  # as near to both
])
def test_foot_by_hand(x, y, expected):
    assert foot_at(ahead(ANGLE), x, y) == expected


def test_among_equally_near_legs_the_earlier_counts():
    assert foot_at(ahead(HAIRPIN), 1.0, 1.0) == (1.0, 1.0, 0)
    assert foot_at(ahead(HAIRPIN), 1.0, 1.25) == (9.0, 0.5625, 2)


def test_what_lies_behind_the_present_segment_does_not_count():
    assert foot_at(ahead(HAIRPIN, target=3), 1.0, 0.0) == (9.0, 4.0, 0)


places = st.tuples(st.floats(0, 12, width=32), st.floats(0, 12, width=32))
polylines = st.lists(places, min_size=2, max_size=SEGMENTS + 1)


@many_examples
@given(polylines, places)
def test_foot_equals_brute_force(points, position):
    along, squared, segment = foot_at(ahead(points), *position)
    feet = reference.feet(points, *position)
    nearest = min(distance for distance, _ in feet)
    assert squared == pytest.approx(nearest**2, abs=1e-3)
    # Of the places that are as near but for rounding, one, and that of its own segment.
    assert any(abs(distance - nearest) < 1e-3 and along == pytest.approx(here, abs=5e-3) for distance, here in feet)
    if int(segment) < len(feet):
        assert feet[int(segment)][0] == pytest.approx(nearest, abs=1e-3)


@many_examples
@given(polylines, st.floats(0, 1.2))
def test_point_along_equals_brute_force(points, share):
    along = share * reference.alongs(points)[-1]
    found = point(ahead(points), jnp.float32(along))
    # Where two points of the route all but coincide, a rounding of `along` may move the place to beside them.
    np.testing.assert_allclose(found, reference.place(points, along), atol=2e-3)


def test_only_so_many_segments_are_looked_at():
    stairs = [(float(k), 0.0) for k in range(CAPACITY)]
    found = ahead(stairs, target=3)  # segments that begin at x = 2, …
    np.testing.assert_array_equal(found.begin[:, 0], np.arange(2, 2 + SEGMENTS))
    np.testing.assert_array_equal(point(found, jnp.float32(100.0)), [2.0 + SEGMENTS, 0.0])
    np.testing.assert_array_equal(point(found, jnp.float32(0.0)), [2.0, 0.0])


@pytest.mark.parametrize("target", [2, 3, 11])
def test_beyond_the_end_the_route_is_its_last_point(target):
    found = ahead(ANGLE, target)
    length = 3.0 if target == 2 else 0.0  # of the last segment, or of none
    np.testing.assert_array_equal(found.length, [length, *[0.0] * (SEGMENTS - 1)])
    np.testing.assert_array_equal(found.along[1:], [7.0] * (SEGMENTS - 1))
    np.testing.assert_array_equal(found.begin[1:], [(4.0, 3.0)] * (SEGMENTS - 1))
    along, squared, _ = foot_at(found, 9.0, 3.0)
    assert (along, squared) == (7.0, 25.0)
    np.testing.assert_array_equal(point(found, jnp.float32(50.0)), (4.0, 3.0))


def test_route_of_a_single_point_is_that_point():
    found = ahead([(2.0, 2.0)], target=0)
    assert foot_at(found, 2.0, 5.0) == (0.0, 9.0, 0)
    np.testing.assert_array_equal(point(found, jnp.float32(3.0)), (2.0, 2.0))


LONG_ANGLE = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0)]


@jax.jit
def in_the_open(ahead, position, lookahead):
    return carrot(ahead, position, lookahead, lambda x, y: jnp.ones_like(x, bool))


def carrot_from(position, lookahead, clear):
    chosen = jax.jit(lambda ahead, position, lookahead: carrot(ahead, position, lookahead, clear))
    found, in_sight = chosen(ahead(LONG_ANGLE), jnp.float32(position), jnp.float32(lookahead))
    return tuple(found.tolist()), bool(in_sight)


@pytest.mark.parametrize(("clear", "expected"), [
    (lambda x, y: jnp.ones_like(x, bool), ((4.0, 3.0), True)),
    (lambda x, y: ~((x < 3.9) & (y > 0.4)), ((4.0, 0.0), True)),  # a block inside the bend
    (lambda x, y: (x - 3) ** 2 + y**2 > 0.25, ((4.0, 3.0), True)),  # (3, 0) and (4, 0) are hidden, what follows is not
    (lambda x, y: x < 2.5, ((2.0, 0.0), True)),
    (lambda x, y: x < 1.5, ((2.0, 0.0), False)),  # nothing in sight: the nearest place
])
def test_carrot_is_the_farthest_place_in_sight(clear, expected):
    # From (1, 0) along the route to 6 m on: (2, 0), (3, 0), (4, 0), (4, 1), (4, 2), (4, 3).
    assert PLACES == 6
    assert carrot_from((1.0, 0.0), 6.0, clear) == expected


def test_carrot_does_not_run_beyond_the_goal():
    place, in_sight = carrot_from((4.0, 3.5), 6.0, lambda x, y: jnp.ones_like(x, bool))
    assert place == (4.0, 4.0)
    assert in_sight


def test_carrot_is_measured_along_the_route_from_the_robots_foot():
    place, _ = carrot_from((1.0, -2.0), 2.0, lambda x, y: jnp.ones_like(x, bool))
    assert place == pytest.approx((3.0, 0.0))


@few_examples
@given(polylines, places, st.floats(0.1, 5.0))
def test_carrot_is_on_the_route_and_within_reach(points, position, lookahead):
    found, _ = in_the_open(ahead(points), jnp.float32(position), jnp.float32(lookahead))
    here = foot_at(ahead(points), *position)[0]
    end = min(here + lookahead, reference.alongs(points)[-1])
    np.testing.assert_allclose(found, reference.place(points, end), atol=5e-3)


def test_gradients_are_finite_on_the_route_and_on_empty_segments():
    def total(points, x, y):
        found = ahead_of(route_through(points, jnp.int32(3)), jnp.int32(1))
        nearest = foot_on(found, x, y)
        return nearest.along + nearest.apart + jnp.sum(point_along(found, nearest.along + 1.0))

    slopes = jax.jit(jax.grad(total, argnums=(0, 1, 2)))
    points = route(*ANGLE).points
    for x, y in ((1.0, 0.0), (4.0, 0.0), (4.0, 3.0), (2.0, 2.0)):
        assert all(np.isfinite(leaf).all() for leaf in slopes(points, jnp.float32(x), jnp.float32(y)))
    assert all(np.isfinite(leaf).all() for leaf in slopes(jnp.zeros_like(points), jnp.float32(0), jnp.float32(0)))
