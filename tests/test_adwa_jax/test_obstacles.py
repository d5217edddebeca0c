"""Movers in time, sensing, and distances to unknown obstacles."""

import dataclasses
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adwa_jax.obstacles import Sensed, clearance_to_movers, clearance_to_squares, movers_at, sense
from adwa_jax.scenario import Movers, UnknownSquares
from tests.reference.dwa import square_distance
from tests.test_adwa_jax.worlds import many_examples

POINTS = 6  # capacity of every track here


def movers(*each):
    """Movers from dicts of what differs from a disc of radius 0.5 standing at the origin in a box of ±10 m."""
    def rows(name, default):
        return jnp.asarray([one.get(name, default) for one in each])

    tracks = np.zeros((len(each), POINTS, 3), np.float32)
    for row, one in zip(tracks, each, strict=True):
        points = one.get("track", [(0.0, 0.0, 0.0)])
        row[:] = [*points, *[points[-1]] * (POINTS - len(points))]
    return Movers(
        radius=rows("radius", 0.5).astype(jnp.float32),
        position=rows("position", (0.0, 0.0)).astype(jnp.float32),
        velocity=rows("velocity", (0.0, 0.0)).astype(jnp.float32),
        low=rows("low", (-10.0, -10.0)).astype(jnp.float32),
        high=rows("high", (10.0, 10.0)).astype(jnp.float32),
        track=jnp.asarray(tracks),
        track_length=jnp.asarray([len(one.get("track", [])) for one in each], jnp.int32),
        period=rows("period", 0.0).astype(jnp.float32),
        valid=rows("valid", True),
    )


states_at = jax.jit(movers_at)
sensed = jax.jit(sense)


@pytest.mark.parametrize(("time", "x", "speed"), [
    (0.0, 1.0, 1.0), (1.5, 2.5, 1.0), (2.5, 2.5, -1.0), (4.5, 0.5, -1.0), (5.5, 0.5, 1.0), (603.0, 2.0, -1.0),
])
def test_mover_is_mirrored_at_its_box(time, x, speed):
    world = movers({"position": (1.0, 2.0), "velocity": (1.0, 0.0), "low": (0.0, 0.0), "high": (3.0, 4.0)})
    state = states_at(world, jnp.float32(time))
    np.testing.assert_allclose(state.position, [(x, 2.0)], atol=1e-4)
    np.testing.assert_array_equal(state.velocity, [(speed, 0.0)])
    assert state.present.all()


@many_examples
@given(st.floats(-3, 3, width=32), st.floats(-3, 3, width=32), st.floats(0, 60, width=32))
def test_mirrored_mover_equals_small_steps_that_bounce(speed_x, speed_y, time):
    world = movers({"position": (1.0, 2.0), "velocity": (speed_x, speed_y), "low": (0.0, 0.0), "high": (3.0, 4.0)})
    state = states_at(world, jnp.float32(time))
    for axis, (start, speed, high) in enumerate(((1.0, speed_x, 3.0), (2.0, speed_y, 4.0))):
        here, left = start, time
        while left > 0 and speed:
            to_wall = ((high if speed > 0 else 0.0) - here) / speed
            if to_wall >= left:
                here += speed * left
                break
            here, left, speed = (high if speed > 0 else 0.0), left - to_wall, -speed
        assert float(state.position[0, axis]) == pytest.approx(here, abs=1e-3)


TRACK = [(1.0, 0.0, 0.0), (2.0, 4.0, 0.0), (4.0, 4.0, 3.0)]


@pytest.mark.parametrize(("time", "position", "velocity", "present"), [
    (0.99, None, None, False),
    (1.0, (0.0, 0.0), (4.0, 0.0), True),
    (1.25, (1.0, 0.0), (4.0, 0.0), True),
    (3.0, (4.0, 1.5), (0.0, 1.5), True),
    (4.0, (4.0, 3.0), (0.0, 1.5), True),
    (4.01, None, None, False),
])
def test_track_is_followed_linearly_and_only_while_it_lasts(time, position, velocity, present):
    state = states_at(movers({"track": TRACK}), jnp.float32(time))
    assert bool(state.present[0]) is present
    assert np.isfinite(state.position).all()
    if present:
        np.testing.assert_allclose(state.position[0], position, atol=1e-5)
        np.testing.assert_allclose(state.velocity[0], velocity, atol=1e-5)


@pytest.mark.parametrize(("time", "x"), [(0.5, 1.0), (4.5, 1.0), (7.0, 2.0), (41.0, 2.0)])
def test_periodic_track_repeats(time, x):
    there_and_back = [(0.0, 0.0, 0.0), (2.0, 4.0, 0.0), (4.0, 0.0, 0.0)]
    state = states_at(movers({"track": there_and_back, "period": 4.0}), jnp.float32(time))
    assert bool(state.present[0])
    np.testing.assert_allclose(state.position[0], (x, 0.0), atol=1e-4)


def test_padding_is_never_present_and_kinds_mix():
    world = movers({"valid": False}, {"velocity": (1.0, 0.0)}, {"track": TRACK}, {"track": TRACK, "valid": False})
    state = states_at(world, jnp.float32(3.0))
    np.testing.assert_array_equal(state.present, [False, True, True, False])
    np.testing.assert_allclose(state.position[1:3], [(3.0, 0.0), (4.0, 1.5)], atol=1e-5)


SQUARES = UnknownSquares(
    centre=jnp.float32([(3.0, 0.0), (0.0, -5.0), (0.0, 2.0)]),
    half_width=jnp.float32([1.0, 1.0, 1.0]),
    rounding=jnp.zeros(3, jnp.float32),
    valid=jnp.array([True, True, False]),
)


def sensed_from(position, known, sensor_range):
    world = movers({"position": (0.0, 3.0)}, {"position": (0.0, 9.0)}, {"valid": False}, {"track": TRACK})
    return sensed(SQUARES, jnp.asarray(known), world, states_at(world, jnp.float32(0.5)), jnp.float32(position),
                  jnp.float32(sensor_range))


def test_range_is_measured_to_the_outline_and_touching_it_counts():
    nothing = [False] * 3
    # From the origin: square sides at 2 and 4 m, mover outlines at 2.5 and 8.5 m; the fourth is not there yet.
    np.testing.assert_array_equal(sensed_from((0, 0), nothing, 1.99).square_known, [False, False, False])
    np.testing.assert_array_equal(sensed_from((0, 0), nothing, 2.0).square_known, [True, False, False])
    np.testing.assert_array_equal(sensed_from((0, 0), nothing, 9.0).square_known, [True, True, False])
    np.testing.assert_array_equal(sensed_from((0, 0), nothing, 2.49).seen, [False, False, False, False])
    np.testing.assert_array_equal(sensed_from((0, 0), nothing, 2.5).seen, [True, False, False, False])
    np.testing.assert_array_equal(sensed_from((0, 0), nothing, 99.0).seen, [True, True, False, False])


def test_range_is_measured_to_the_outline_of_a_disc():
    disc = dataclasses.replace(SQUARES, half_width=jnp.zeros(3), rounding=jnp.full(3, 0.5))
    for sensor_range, known in ((2.49, False), (2.5, True)):
        seen = sensed(disc, jnp.zeros(3, bool), movers({}), states_at(movers({}), jnp.float32(0.0)),
                      jnp.zeros(2), jnp.float32(sensor_range))
        assert bool(seen.square_known[0]) == known
    np.testing.assert_array_equal(seen.square_rounding, disc.rounding)


def test_squares_stay_known_and_movers_do_not():
    later = sensed_from((-50, 0), [True, False, False], 2.5)
    np.testing.assert_array_equal(later.square_known, [True, False, False])
    assert not later.seen.any()


KNOWN = Sensed(
    square_centre=jnp.float32([(3.0, 1.0), (0.0, 0.0)]),
    square_half_width=jnp.float32([0.5, 1.0]),
    square_known=jnp.array([True, False]),
    position=jnp.float32([(5.0, 0.0), (0.0, 0.0)]),
    velocity=jnp.float32([(-1.0, 2.0), (0.0, 0.0)]),
    radius=jnp.float32([0.25, 1.0]),
    seen=jnp.array([True, False]),
    square_rounding=jnp.zeros(2, jnp.float32),
)


def test_distances_to_squares_by_hand():
    x, y = jnp.float32([1.0, 3.0, 0.0, 3.0, 3.5]), jnp.float32([1.0, 4.0, -3.5, 1.2, 1.5])
    # Beside: 1.5. Above: 2.5. Corner (2.5, 0.5): √(2.5² + 4²). Inside and on the corner: 0. The other is not known.
    expected = [1.5, 2.5, math.hypot(2.5, 4.0), 0.0, 0.0]
    np.testing.assert_allclose(clearance_to_squares(KNOWN, x, y), expected, rtol=1e-6)


@pytest.mark.parametrize(("half_width", "rounding", "expected"), [
    (0.0, 0.5, [1.5, 4.5, -0.5, math.sqrt(2.0) - 0.5]),
    (0.5, 0.25, [1.25, 4.25, -0.25, math.sqrt(0.5) - 0.25]),
    (0.5, 0.0, [1.5, 4.5, 0.0, math.sqrt(0.5)]),
], ids=["disc", "rounded", "sharp"])  # fmt: skip
def test_distances_to_discs_and_rounded_squares_by_hand(half_width, rounding, expected):
    known = KNOWN._replace(square_half_width=jnp.full(2, half_width), square_rounding=jnp.full(2, rounding))
    # The centre is (3, 1): 2 m beside it, 5 m above it, in it, and on its diagonal.
    x, y = jnp.float32([(1.0, 1.0), (3.0, 6.0), (3.0, 1.0), (4.0, 2.0)]).T
    np.testing.assert_allclose(clearance_to_squares(known, x, y), expected, rtol=1e-6)


def test_movers_are_met_where_they_will_be():
    x, y = jnp.float32([4.0, 5.0, 1.0]), jnp.float32([2.0, 2.0, 2.0])
    np.testing.assert_allclose(clearance_to_movers(KNOWN, x, y, jnp.float32(1.0)), [-0.25, 0.75, 2.75], rtol=1e-6)
    at_once = clearance_to_movers(KNOWN, x, y, jnp.float32(0.0))
    np.testing.assert_allclose(at_once, [math.sqrt(5) - 0.25, 1.75, math.sqrt(20) - 0.25], rtol=1e-6)


BORDER = jnp.float32([(0.0, 0.0), (10.0, 6.0)])


def predicted_position(position, velocity, ahead, radius=0.5, border=BORDER):
    """Where a mover is expected, from its distances to three points."""
    known = KNOWN._replace(position=jnp.float32([position, (0, 0)]), velocity=jnp.float32([velocity, (0, 0)]),
                           radius=jnp.float32([radius, 1.0]), border=border)
    x, y = jnp.float32([(0.0, 0.0), (20.0, 0.0), (0.0, 20.0)]).T
    distances = np.asarray(clearance_to_movers(known, x, y, jnp.float32(ahead)), float) + radius
    to_origin, to_right, to_top = distances**2
    return (400 + to_origin - to_right) / 40, (400 + to_origin - to_top) / 40


@pytest.mark.parametrize(("position", "velocity", "ahead", "expected"), [
    ((8.0, 3.0), (1.0, 0.0), 1.0, (9.0, 3.0)),  # not there yet
    ((8.0, 3.0), (1.0, 0.0), 1.5, (9.5, 3.0)),  # its outline touches the border at x = 10
    ((8.0, 3.0), (1.0, 0.0), 2.0, (9.0, 3.0)),  # half a metre back
    ((1.0, 3.0), (-1.0, 0.0), 2.0, (2.0, 3.0)),
    ((8.0, 1.0), (1.0, -2.0), 2.0, (9.0, 4.0)),  # off both walls of a corner
    ((2.0, 5.0), (0.0, 1.0), 1.0, (2.0, 5.0)),
    ((2.0, 3.0), (0.5, 0.25), 3.0, (3.5, 3.75)),
])
def test_movers_are_expected_to_turn_back_at_the_border(position, velocity, ahead, expected):
    np.testing.assert_allclose(predicted_position(position, velocity, ahead), expected, atol=2e-4)
    straight_on = np.add(position, np.multiply(ahead, velocity))
    np.testing.assert_allclose(predicted_position(position, velocity, ahead, border=None), straight_on, atol=2e-4)


@pytest.mark.parametrize(("position", "velocity", "ahead", "expected"), [
    ((9.8, 3.0), (1.0, 0.0), 1.0, (10.8, 3.0)),  # on its way out
    ((-1.0, 3.0), (1.0, 0.0), 2.0, (1.0, 3.0)),  # on its way in
    ((9.8, 5.0), (1.0, 1.0), 1.0, (10.8, 5.0)),  # on its way out to the right, inside above and below
])
def test_mover_that_is_on_the_border_already_goes_on_through_it(position, velocity, ahead, expected):
    np.testing.assert_allclose(predicted_position(position, velocity, ahead), expected, atol=2e-4)


def test_expected_and_true_movers_agree_until_they_turn_back_twice():
    # Movers of the suites turn back in the box in which their outlines stay on the map: that of the prediction.
    world = movers({"position": (8.0, 1.0), "velocity": (0.75, -0.5), "low": (0.5, 0.5), "high": (9.5, 5.5)})
    for time in (0.0, 1.0, 2.5, 4.0, 8.0):
        truth = states_at(world, jnp.float32(time)).position[0]
        np.testing.assert_allclose(predicted_position((8.0, 1.0), (0.75, -0.5), time), truth, atol=2e-4)


def test_nothing_known_is_far_away_and_finite():
    nothing = KNOWN._replace(square_known=jnp.array([False, False]), seen=jnp.array([False, False]))
    none_at_all = jax.tree.map(lambda leaf: leaf[:0], KNOWN)
    for known in (nothing, none_at_all):
        for distance in (clearance_to_squares(known, jnp.float32([0.0]), jnp.float32([0.0])),
                         clearance_to_movers(known, jnp.float32([0.0]), jnp.float32([0.0]), jnp.float32(1.0))):
            assert np.isfinite(distance).all()
            assert (distance > 1e4).all()


def test_many_obstacles_equal_few_of_them():
    random = np.random.default_rng(0)
    count = 40
    many = Sensed(
        square_centre=jnp.asarray(random.uniform(-5, 5, (count, 2)), jnp.float32),
        square_half_width=jnp.asarray(random.uniform(0.1, 1, count), jnp.float32),
        square_known=jnp.asarray(random.random(count) < 0.7),
        position=jnp.asarray(random.uniform(-5, 5, (count, 2)), jnp.float32),
        velocity=jnp.asarray(random.uniform(-1, 1, (count, 2)), jnp.float32),
        radius=jnp.asarray(random.uniform(0.1, 0.5, count), jnp.float32),
        seen=jnp.asarray(random.random(count) < 0.7),
        square_rounding=jnp.asarray(random.choice([0.0, 0.3], count), jnp.float32),
    )
    x, y = jnp.asarray(random.uniform(-6, 6, (2, 30)), jnp.float32)
    squares, discs = clearance_to_squares(many, x, y), clearance_to_movers(many, x, y, jnp.float32(0.5))
    for k in range(30):
        here = (float(x[k]), float(y[k]))
        expected = min(square_distance(*here, many.square_centre[i].tolist(), float(many.square_half_width[i]))
                       - float(many.square_rounding[i]) for i in range(count) if many.square_known[i])
        assert float(squares[k]) == pytest.approx(expected, abs=1e-5)
        expected = min(math.dist(here, (many.position[i] + 0.5 * many.velocity[i]).tolist()) - float(many.radius[i])
                       for i in range(count) if many.seen[i])
        assert float(discs[k]) == pytest.approx(expected, abs=1e-5)


def test_gradients_are_finite_on_corners_inside_and_at_the_centre_of_a_mover():
    points = jnp.float32([(2.5, 0.5), (3.5, 1.5), (3.0, 1.0), (2.5, 1.0), (5.0, 0.0), (0.0, 0.0), (3.0, 1.5)])
    for clearance in (clearance_to_squares, lambda s, x, y: clearance_to_movers(s, x, y, jnp.float32(0.0))):
        slopes = jax.jit(jax.vmap(jax.grad(lambda p, f=clearance: f(KNOWN, p[0], p[1]))))(points)
        assert np.isfinite(slopes).all()
    away = jax.grad(lambda x: clearance_to_squares(KNOWN, x, jnp.float32(1.0)))(jnp.float32(5.0))
    assert float(away) == 1.0
