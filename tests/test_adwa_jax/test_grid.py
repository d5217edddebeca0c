"""Distance fields, inflation and frames against brute force."""

import math
from fractions import Fraction

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from adwa_jax.grid import (
    BILINEAR_EXCESS,
    cell_of,
    centre_of,
    clearance_at,
    distance_field,
    distance_to_squares,
    inflate,
    inside,
)
from tests.reference import distance as reference
from tests.test_adwa_jax.worlds import SIZES, drawn, few_examples, grid_of, maps, random_map

CORNER = drawn("....", ".#..", "....", "....")
field_of = jax.jit(distance_field, static_argnames="subdivision")
inflated = jax.jit(inflate)
look_up = jax.jit(clearance_at)


def field_on_map(occupied, subdivision, **frame):
    """The part of the padded field's lattice that lies on the map."""
    height, width = occupied.shape
    field = np.asarray(field_of(grid_of(occupied, **frame), subdivision=subdivision).distance)
    return field[: height * subdivision + 1, : width * subdivision + 1]


def test_field_of_one_square_by_hand():
    field = field_on_map(CORNER, 2, resolution=0.5)
    # Lattice spacing 0.25 m; the square spans [0.5, 1]² m, the border lies at 0 and 2 m.
    assert field[2, 2] == field[3, 3] == field[0, 5] == field[8, 1] == 0.0
    assert field[5, 5] == pytest.approx(0.25 * math.sqrt(2), rel=1e-6)
    assert field[6, 3] == 0.5
    assert field[7, 7] == 0.25


@few_examples
@given(maps)
def test_field_equals_brute_force(occupied):
    np.testing.assert_allclose(field_on_map(occupied, 3), reference.lattice_distance(occupied, 3), rtol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_field_equals_scipy(seed):
    occupied = random_map(seed, SIZES[seed % 3], 0.15)
    cells = np.pad(occupied, 1, constant_values=True)
    fine = np.kron(cells, np.ones((4, 4), bool))[3:-3, 3:-3]
    free_points = ~(fine[:-1, :-1] | fine[1:, :-1] | fine[:-1, 1:] | fine[1:, 1:])
    expected = ndimage.distance_transform_edt(free_points) / 4.0
    np.testing.assert_allclose(field_on_map(occupied, 4), expected, rtol=1e-6)


def test_field_of_padding_is_zero_and_unpadded_map_agrees():
    occupied = random_map(7, (9, 9), 0.2)
    full = np.asarray(field_of(grid_of(occupied), subdivision=4).distance)
    alone = np.asarray(field_of(grid_of(occupied, shape=None), subdivision=4).distance)
    np.testing.assert_array_equal(full[:37, :37], alone)
    assert not full[36:].any()
    assert not full[:, 36:].any()


def test_vmapped_fields_equal_single_ones():
    worlds = [random_map(seed, size, density) for seed, (size, density) in
              enumerate([((9, 9), 0.0), ((12, 10), 0.3), ((5, 12), 0.05), ((12, 10), 0.9)])]
    grids = [grid_of(world) for world in worlds]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *grids)
    together = jax.jit(jax.vmap(lambda world: distance_field(world, 2).distance))(stacked)
    for world_grid, field in zip(grids, together, strict=True):
        np.testing.assert_array_equal(field, field_of(world_grid, subdivision=2).distance)


def points_of(occupied, seed, count):
    """Points all over the map and just around the corners of its cells."""
    random = np.random.default_rng(seed)
    height, width = occupied.shape
    anywhere = random.uniform((0, 0), (width, height), (count, 2))
    corners = random.integers((0, 0), (width + 1, height + 1), (count, 2))
    corners = corners + random.uniform(-0.2, 0.2, (count, 2))
    return np.clip(np.concatenate([anywhere, corners]), 0, (width, height)).astype(np.float32)


@few_examples
@given(maps, st.integers(0, 1000))
def test_lookup_never_exceeds_the_true_distance_and_stays_near_it(occupied, seed):
    points = points_of(occupied, seed, 40)
    field = field_of(grid_of(occupied), subdivision=4)
    bound = np.asarray(look_up(field, jnp.asarray(points[:, 0]), jnp.asarray(points[:, 1])))
    truth = np.array([reference.distance(occupied, float(x), float(y)) for x, y in points])
    assert (bound <= truth + 2e-6).all()
    assert (bound >= truth - 0.25 * (math.sqrt(0.5) + BILINEAR_EXCESS) - 2e-6).all()


def test_lookup_excess_constant_is_attained_at_a_square_corner():
    # Half way across the lattice cell at the corner (2, 2), √½/4 away; the mean of the four is (2 + √2)/16.
    field = field_of(grid_of(CORNER), subdivision=4)
    value = float(look_up(field, jnp.float32([2.125]), jnp.float32([2.125]))[0]) + BILINEAR_EXCESS * 0.25
    assert value == pytest.approx((2 + math.sqrt(2)) / 16, rel=1e-6)
    assert (value - math.sqrt(0.5) / 4) / 0.25 == pytest.approx(BILINEAR_EXCESS, abs=1e-4)


def test_points_off_the_map_are_not_clear():
    field = field_of(grid_of(CORNER), subdivision=4)
    beyond = jnp.float32([-3.0, 4.5, 2.0, 100.0])
    assert (look_up(field, beyond, jnp.float32([1.0, 1.0, 17.0, -9.0])) <= 0).all()


def test_lookup_honours_origin_and_resolution():
    plain = field_of(grid_of(CORNER), subdivision=4)
    moved = field_of(grid_of(CORNER, resolution=0.5, origin=(-3.0, 10.0)), subdivision=4)
    x, y = jnp.float32([0.3, 2.6, 3.1]), jnp.float32([0.4, 2.7, 1.2])
    expected = 0.5 * look_up(plain, x, y)
    np.testing.assert_allclose(look_up(moved, x * 0.5 - 3.0, y * 0.5 + 10.0), expected, atol=1e-5)


def test_gradient_of_lookup_is_finite_everywhere():
    field = field_of(grid_of(CORNER), subdivision=4)
    steps = np.arange(-2, 36, dtype=np.float32) / 8.0  # lattice lines, corners of the square, off-map points
    x, y = (jnp.asarray(axis.ravel()) for axis in np.meshgrid(steps, steps))
    slopes = jax.jit(jax.vmap(jax.grad(clearance_at, argnums=(1, 2)), (None, 0, 0)))(field, x, y)
    assert all(np.isfinite(slope).all() for slope in slopes)
    assert float(slopes[0][jnp.argmax((x == 2.125) & (y == 1.5))]) == 1.0  # away from the side


@few_examples
@given(maps, st.sampled_from([Fraction(n, 8) for n in range(17)]))
def test_inflation_equals_brute_force(occupied, radius):
    height, width = occupied.shape
    kernel = inflated(grid_of(occupied, resolution=0.5), jnp.float32(float(radius) * 0.5))
    np.testing.assert_array_equal(kernel[:height, :width], reference.inflate(occupied, radius))
    assert kernel[height:].all()
    assert kernel[:, width:].all()


def test_inflation_by_zero_is_the_map_itself_and_touching_counts():
    def cells(radius):
        return np.asarray(inflated(grid_of(CORNER), jnp.float32(radius)))[:4, :4]

    np.testing.assert_array_equal(cells(0.0), CORNER)
    np.testing.assert_array_equal(cells(0.499), CORNER)
    np.testing.assert_array_equal(cells(0.5), drawn("####", "####", "##.#", "####"))


def test_frames_go_there_and_back():
    world = grid_of(CORNER, resolution=0.5, origin=(-3.0, 10.0))
    np.testing.assert_array_equal(cell_of(world, jnp.float32([-2.25, 11.75])), [3, 1])
    np.testing.assert_array_equal(cell_of(world, jnp.float32([-3.1, 10.0])), [0, -1])
    centres = centre_of(world, jnp.int32([[3, 1], [0, 0]]))
    np.testing.assert_array_equal(centres, [[-2.25, 11.75], [-2.75, 10.25]])
    for off in ([4, 0], [0, 4], [-1, 0], [0, -1]):
        assert not inside(world, jnp.int32(off))
    assert inside(world, jnp.int32([3, 3]))


@few_examples
@given(maps, st.integers(0, 1000))
def test_exact_distance_equals_brute_force_within_reach(occupied, seed):
    points = points_of(occupied, seed, 10)
    world = grid_of(occupied, resolution=0.5)
    kernel = exact_distances(world, jnp.asarray(points) * 0.5)
    for (x, y), found in zip(points, np.asarray(kernel), strict=True):
        truth = reference.distance(occupied, float(x), float(y))
        assert found == (pytest.approx(0.5 * truth, abs=1e-5) if truth <= 2 else math.inf)


exact_distances = jax.jit(jax.vmap(lambda g, p: distance_to_squares(g, p, 2), (None, 0)))


def test_exact_distance_is_zero_off_the_map():
    points = jnp.float32([[-1.0, 2.0], [40.0, 2.0], [2.0, -30.0], [0.0, 2.0]])
    np.testing.assert_array_equal(exact_distances(grid_of(CORNER), points), [0.0, 0.0, 0.0, 0.0])


def test_other_maps_of_one_shape_do_not_retrace():
    traced = jax.jit(chex.assert_max_traces(inflate, n=1))
    for seed in range(3):
        traced(grid_of(random_map(seed, SIZES[seed], 0.2), resolution=0.1 * (seed + 1)), jnp.float32(seed))
