"""Turning points, segments and key points against exact fractions."""

from fractions import Fraction
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adwa_jax.keypoints import key_points, polyline_length, segment_free, turning_points
from tests.reference import astar as astar_reference
from tests.reference import keypoints as reference
from tests.test_adwa_jax.worlds import (
    SHAPE,
    counting,
    drawn,
    few_examples,
    free_cells,
    many_examples,
    maps,
    padded,
    random_map,
)

CAPACITY = SHAPE[0] * SHAPE[1]
MARGINS = [Fraction(n, 16) for n in range(8)]  # 0 … 7/16 of a cell, exact in float32

reduce, traces = counting(key_points, static_argnames="rule")
is_free = jax.jit(segment_free)


def buffer(path):
    """[H·W, 2] int32, the last cell repeating."""
    return jnp.asarray(list(path) + [path[-1]] * (CAPACITY - len(path)), jnp.int32)


def reduced(occupied, path, margin, rule="anchor"):
    world, count = jnp.asarray(padded(occupied)), jnp.int32(len(path))
    kept = reduce(world, buffer(path), count, jnp.float32(margin), rule=rule)
    cells = np.asarray(kept.cells)
    assert (cells[int(kept.count):] == path[-1]).all()
    return [tuple(pair) for pair in cells[: int(kept.count)].tolist()]


def free(occupied, a, b, margin):
    """The kernel's answer for a segment between points (x, y)."""
    ends = (jnp.asarray([float(part) for part in end], jnp.float32) for end in (a, b))
    return bool(is_free(jnp.asarray(padded(occupied)), *ends, jnp.float32(float(margin))))


def solved(seed, density=0.25, size=(12, 10)):
    """A random map and the oracle's shortest path across it, or None."""
    occupied = random_map(seed, size, density)
    path = astar_reference.search(occupied, (0, 0), (size[0] - 1, size[1] - 1)).path
    return (occupied, list(path)) if path else None


SOLVED = [case for case in map(solved, range(200, 236)) if case]


def test_turning_points_by_hand():
    path = [(0, 0), (0, 1), (0, 2), (1, 3), (2, 4), (3, 4)]
    mask = turning_points(buffer(path), jnp.int32(6))
    np.testing.assert_array_equal(np.flatnonzero(mask), [0, 2, 4, 5])
    np.testing.assert_array_equal(np.flatnonzero(turning_points(buffer(path), jnp.int32(3))), [0, 2])
    np.testing.assert_array_equal(np.flatnonzero(turning_points(buffer(path), jnp.int32(1))), [0])
    assert not turning_points(buffer(path), jnp.int32(0)).any()


@pytest.mark.parametrize(("a", "b", "distance"), [
    ((4.5, 4.5), (7.5, 7.5), None),  # through the square [5, 6]²
    ((4.5, 7.5), (7.5, 4.5), None),  # through its corner (6, 6)
    ((4.5, 4.5), (7.5, 4.5), 0.5),
    ((6.5, 6.5), (7.5, 7.5), 0.70711),  # end to corner
    ((5.5, 7.5), (7.5, 5.5), 0.70711),  # corner (6, 6) to the line x + y = 13
    ((6.5, 4.5), (6.5, 4.5), 0.70711),  # a point
])
def test_free_means_farther_than_the_margin(a, b, distance):
    occupied = np.zeros(SHAPE, bool)
    occupied[5, 5] = True
    if distance is None:
        assert not free(occupied, a, b, 0.0)
        return
    assert free(occupied, a, b, distance - 1e-4)
    assert not free(occupied, a, b, distance + 1e-4)


def test_margin_of_exactly_the_distance_blocks():
    assert not free(drawn("....", ".#..", "....", "...."), (0.5, 2.5), (3.5, 2.5), 0.5)


@many_examples
@given(maps, st.integers(0, 1000), st.sampled_from(MARGINS))
def test_segments_between_centres_equal_fractions(occupied, seed, margin):
    for k in range(3):
        a, b = map(reference.centre, free_cells(occupied, seed + k, 2))
        assert free(occupied, a, b, margin) == reference.segment_free(occupied, a, b, margin)


@many_examples
@given(maps, st.integers(0, 1000), st.sampled_from([Fraction(n, 4) for n in range(2, 13)]))
def test_wide_margins_equal_fractions(occupied, seed, margin):
    for k in range(4):
        cells = free_cells(occupied, seed + k, 2)
        a, b = map(reference.centre, cells)
        squares = [reference.squared_segment_to_square(a, b, *map(int, index)) for index in np.argwhere(occupied)]
        height, width = occupied.shape
        if min(min(x, y, width - x, height - y) for x, y in (a, b)) > margin:  # the border does not matter
            assert free(occupied, a, b, margin) == all(square > margin * margin for square in squares)


def test_border_blocks_like_an_occupied_square_padded_or_not():
    empty = np.zeros((5, 5), bool)
    for occupied in (empty, padded(empty)):
        def answer(margin, occupied=occupied):
            ends = jnp.float32([[1.5, 1.5], [3.5, 1.5]])
            return bool(is_free(jnp.asarray(occupied), *ends, jnp.float32(margin)))

        assert answer(1.49)  # the border is 1.5 cells away
        assert not answer(1.51)


def test_segments_that_graze_corners_block_at_margin_zero():
    # From (0, 0) every cell of a 12 × 12 map is aimed at; corners lie on many of these segments exactly.
    touched = 0
    fan = jax.jit(jax.vmap(segment_free, (None, None, 0, None)))
    for row, column in ((2, 2), (3, 5), (5, 1), (7, 8)):
        occupied = np.zeros(SHAPE, bool)
        occupied[row, column] = True
        ends = [(r, c) for r in range(12) for c in range(12) if (r, c) != (row, column)]
        b = jnp.asarray([reference.centre(end) for end in ends], jnp.float32)
        kernel = fan(jnp.asarray(occupied), jnp.float32([0.5, 0.5]), b, jnp.float32(0))
        for end, answer in zip(ends, np.asarray(kernel).tolist(), strict=True):
            a, b_exact = reference.centre((0, 0)), reference.centre(end)
            assert answer == (not reference.crosses(a, b_exact, row, column))
            touched += not answer
    assert touched > 40


def test_key_points_by_hand():
    wall = drawn("......", "......", "...###", "......", "......", "......")
    path = [(0, 0), (1, 1), (2, 1), (3, 1), (4, 2), (4, 3), (4, 4), (4, 5)]
    assert reduced(wall, path, 0.0) == [(0, 0), (4, 2), (4, 5)]
    assert reduced(wall, path, 0.0, "literal") == [(0, 0), (4, 5)]
    assert reduced(np.zeros((6, 6), bool), path, 0.25) == [(0, 0), (4, 5)]


def test_shortest_paths_are_their_own_ends():
    world = np.zeros((3, 3), bool)
    assert reduced(world, [(1, 1)], 0.0) == [(1, 1)]
    assert reduced(world, [(1, 1), (2, 2)], 0.0) == [(1, 1), (2, 2)]
    assert reduced(world, [(0, 0), (0, 1), (0, 2)], 0.0) == [(0, 0), (0, 2)]


def test_no_path_gives_no_key_points():
    kept = reduce(jnp.asarray(padded(np.zeros((3, 3), bool))), buffer([(0, 0)]), jnp.int32(0), jnp.float32(0),
                  rule="anchor")
    assert int(kept.count) == 0


@pytest.mark.parametrize("rule", ["anchor", "literal"])
def test_key_points_equal_fractions(rule):
    assert len(SOLVED) > 12
    for number, (occupied, path) in enumerate(SOLVED):
        margin = MARGINS[number % len(MARGINS)]
        expected = reference.key_points(occupied, path, margin, rule)
        assert reduced(occupied, path, float(margin), rule) == expected


def test_every_segment_of_the_key_path_is_free():
    for number, (occupied, path) in enumerate(SOLVED):
        margin = MARGINS[number % len(MARGINS)]
        kept = [reference.centre(key) for key in reduced(occupied, path, float(margin))]
        for a, b in pairwise(kept):
            assert reference.segment_free(occupied, a, b, margin)


@few_examples
@given(st.integers(0, 10_000), st.sampled_from(MARGINS))
def test_key_path_is_never_longer_and_keeps_its_ends(seed, margin):
    case = solved(seed, 0.2)
    if case is None:
        return
    occupied, path = case
    kept = reduced(occupied, path, float(margin))
    assert (kept[0], kept[-1]) == (path[0], path[-1])
    assert set(kept) <= set(path)

    def length(cells):
        points = jnp.asarray(cells + [cells[-1]] * (CAPACITY - len(cells)), jnp.float32)
        return float(polyline_length(points, jnp.int32(len(cells))))

    assert length(kept) <= length(path) + 1e-4


def test_polyline_length_counts_only_what_is_used():
    points = jnp.float32([[0, 0], [3, 4], [3, 5], [99, 99]])
    assert float(polyline_length(points, jnp.int32(3))) == 6.0
    assert float(polyline_length(points, jnp.int32(1))) == 0.0


def test_vmap_equals_a_loop_with_unequal_paths():
    cases = [*SOLVED[:4], (np.zeros((12, 10), bool), [(3, 3)])]
    occupied = jnp.asarray(np.array([padded(world) for world, _ in cases]))
    paths = jnp.stack([buffer(path) for _, path in cases])
    counts = jnp.asarray([len(path) for _, path in cases], jnp.int32)
    margin = jnp.float32(0.25)
    together = jax.jit(jax.vmap(lambda o, p, n: key_points(o, p, n, margin, "anchor")))(occupied, paths, counts)
    for k in range(len(cases)):
        alone = reduce(occupied[k], paths[k], counts[k], margin, rule="anchor")
        np.testing.assert_array_equal(together.cells[k], alone.cells)
        assert int(together.count[k]) == int(alone.count)


def test_other_maps_paths_and_margins_do_not_retrace():
    reduced(*SOLVED[0], 0.0)
    before = len(traces)
    for occupied, path in SOLVED[:4]:
        reduced(occupied, path, len(path) / 100)
    assert len(traces) == before
