"""Discs that stand for a rectangular robot."""

import math
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adwa_jax.footprint import covering_discs, over_discs
from adwa_jax.grid import clearance_at
from adwa_jax.presets import jackal, paper
from tests.reference import distance as distance_reference
from tests.test_adwa_jax.scenes import random_scene, scene_field
from tests.test_adwa_jax.worlds import many_examples

look_up = jax.jit(clearance_at)


@jax.jit
def over(robot, x, y, cosine, sine):
    return over_discs(lambda x, y: clearance_at(scene_field(3), x, y), robot, x, y, cosine, sine)


def test_discs_of_the_jackal_by_hand():
    # Two slices of 0.21 × 0.33 m: half their diagonal is 0.1956 m.
    radius, offsets = covering_discs(0.42, 0.33, 2)
    assert radius == pytest.approx(math.hypot(0.105, 0.165)) == pytest.approx(0.1956, abs=1e-4)
    assert offsets == pytest.approx((-0.105, 0.105))
    assert jackal().disc_offsets == offsets
    assert covering_discs(3.0, 4.0, 1) == (2.5, (0.0,))


@many_examples
@given(st.floats(0.1, 3.0), st.floats(0.1, 3.0), st.integers(1, 5), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_discs_cover_the_rectangle_and_jut_out_no_farther_than_documented(length, width, count, part, share):
    radius, offsets = covering_discs(length, width, count)
    assert len(offsets) == count
    corners = [(i * length / 2, j * width / 2) for i in (-1, 1) for j in (-1, 1)]
    for x, y in [*corners, (part * length, share * width), (0.0, width / 2)]:  # a corner, any point within, a side
        assert min(math.hypot(x - offset, y) for offset in offsets) <= radius + 1e-9
    assert radius - width / 2 >= 0
    assert max(offsets) + radius - length / 2 == pytest.approx(radius - length / (2 * count))
    assert min(offsets) - radius + length / 2 == pytest.approx(length / (2 * count) - radius)
    # More discs lie closer to the sides.
    assert covering_discs(length, width, count + 1)[0] < radius


def test_one_disc_is_the_plain_disc_in_every_bit():
    random = np.random.default_rng(0)
    x, y, angle = jnp.asarray(random.uniform(0, 12, (3, 4, 50)), jnp.float32)
    robot = paper().constants.robot
    plain = jax.jit(lambda robot, x, y: clearance_at(scene_field(3), x, y) - robot.radius)
    np.testing.assert_array_equal(over(robot, x, y, jnp.cos(angle), jnp.sin(angle)), plain(robot, x, y))


def test_several_discs_are_each_looked_up_where_they_are():
    robot = replace(paper().constants.robot, radius=0.2, disc_offsets=(-0.3, 0.1, 0.5))
    random = np.random.default_rng(1)
    x, y, angle = random.uniform(0, 12, (3, 50))
    found = over(robot, *jnp.float32([x, y, np.cos(angle), np.sin(angle)]))
    centres = [jnp.float32([x + offset * np.cos(angle), y + offset * np.sin(angle)]) for offset in robot.disc_offsets]
    each = [look_up(scene_field(3), *centre) for centre in centres]
    np.testing.assert_allclose(found, np.min(each, axis=0) - 0.2, atol=1e-5)


def test_rectangle_keeps_at_least_the_discs_clearance():
    # Any point of it is within the radius of a disc's centre, so that its distance is at most so much less.
    length, width = 0.8, 0.5
    radius, offsets = covering_discs(length, width, 3)
    robot = replace(paper().constants.robot, radius=radius, disc_offsets=offsets)
    occupied = random_scene(3)[0]
    random = np.random.default_rng(2)
    free = 0
    for _ in range(30):
        x, y, angle = random.uniform(1, 11), random.uniform(1, 11), random.uniform(-math.pi, math.pi)
        clear = float(over(robot, *jnp.float32([x, y, math.cos(angle), math.sin(angle)])))
        free += clear > 0
        for along, aside in random.uniform(-0.5, 0.5, (8, 2)) * (length, width):
            point = (x + along * math.cos(angle) - aside * math.sin(angle),
                     y + along * math.sin(angle) + aside * math.cos(angle))
            assert distance_reference.distance(occupied, *point) >= clear - 1e-5
    assert free > 8


@pytest.mark.parametrize("offsets", [(0.2,), (float("nan"), 0.0)])
def test_impossible_discs_are_refused(offsets):
    with pytest.raises(ValueError, match="disc_offsets"):
        replace(paper().constants.robot, disc_offsets=offsets)
