"""The weight rule (eq. 5) against exact fractions."""

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given

from adwa_jax.density import Density
from adwa_jax.heuristic_weight import WeightRule, heuristic_weight, weight_field
from tests.reference import density as reference
from tests.test_adwa_jax.worlds import cell, drawn, few_examples, free_cells, grid_of, maps

CONSTANTS = {"dense_base": 0.5, "dense_gain": 0.5, "sparse_base": 1.25, "sparse_gain": 0.5}
RULE = WeightRule(**CONSTANTS)
field = jax.jit(weight_field, static_argnames="scope")


@pytest.mark.parametrize(("obstacles", "cells", "map_obstacles", "map_cells", "weight"), [
    (3, 10, 20, 100, 0.5 + 0.5 * 2 / 3),  # P = 1.5 Q exactly: dense
    (29, 100, 20, 100, 1.0),  # just under
    (1, 10, 20, 100, 1.0),  # P = 0.5 Q exactly: neither
    (9, 100, 20, 100, 1.25 + 0.5 * 0.45),  # just under: sparse
    (0, 10, 20, 100, 1.25),  # P = 0 < Q: γ
    (0, 10, 0, 100, 1.0),  # Q = 0
    (10, 10, 20, 100, 0.6),
])
def test_thresholds_and_empty_maps_by_hand(obstacles, cells, map_obstacles, map_cells, weight):
    density = Density(*map(jnp.float32, (obstacles, cells, map_obstacles, map_cells)))
    assert float(heuristic_weight(density, RULE)) == pytest.approx(weight, rel=1e-6)


@few_examples
@given(maps)
def test_node_scope_equals_fractions_at_every_cell(occupied):
    height, width = occupied.shape
    start, goal = free_cells(occupied, 1, 2)
    found = np.asarray(field(grid_of(occupied), cell(start), cell(goal), RULE, scope="node"))
    overall = reference.map_share(occupied)
    for row, column in np.ndindex(height, width):
        share = reference.share(occupied, (row, column), goal)
        weight = reference.heuristic_weight(share, overall, **CONSTANTS)
        assert found[row, column] == pytest.approx(float(weight), rel=1e-6)


@few_examples
@given(maps)
def test_start_scope_is_the_start_cell_s_weight_everywhere(occupied):
    start, goal = free_cells(occupied, 2, 2)
    found = np.asarray(field(grid_of(occupied), cell(start), cell(goal), RULE, scope="start"))
    node = np.asarray(field(grid_of(occupied), cell(start), cell(goal), RULE, scope="node"))
    np.testing.assert_array_equal(found, np.full_like(found, node[start]))


def test_start_scope_is_one_from_corner_to_corner():
    occupied = drawn("..#.", "#..#", "....")
    found = field(grid_of(occupied), cell((0, 0)), cell((2, 3)), RULE, scope="start")
    np.testing.assert_array_equal(found, np.ones_like(found))


@pytest.mark.parametrize("changed", [
    {"dense_base": 0.7},  # 0.7 + 0.5 / 1.5 > 1
    {"dense_gain": 0.75},  # 0.5 + 0.75 / 1.5 = 1
    {"sparse_base": 0.99},
    {"dense_gain": -0.1},
    {"sparse_gain": float("nan")},
    {"sparse_base": float("inf")},
    {"dense_ratio": 0.25},  # below sparse_ratio
])
def test_constants_that_break_the_promise_are_refused(changed):
    with pytest.raises(ValueError, match=r"(must|finite)"):
        WeightRule(**(CONSTANTS | changed))


@few_examples
@given(maps)
def test_promise_holds_on_every_map(occupied):
    goal = free_cells(occupied, 3, 1)[0]
    world, target = grid_of(occupied), cell(goal)
    weights = np.asarray(field(world, target, target, RULE, scope="node"))
    overall = reference.map_share(occupied)
    for row, column in np.ndindex(occupied.shape):
        share = reference.share(occupied, (row, column), goal)
        if overall and share >= overall * 3 / 2:
            assert weights[row, column] < 1
        if share < overall / 2:
            assert weights[row, column] > 1


def test_changing_constants_does_not_retrace_and_gradients_are_finite():
    @jax.jit
    @chex.assert_max_traces(n=1)
    def traced(world, start, goal, rule):
        return weight_field(world, start, goal, rule, "node")

    world = grid_of(drawn("#..", "...", "..."))
    for base in (0.1, 0.2, 0.3):
        traced(world, cell((0, 1)), cell((2, 2)), WeightRule(base, 0.1, 1.0 + base, 0.1))

    @jax.jit
    @jax.grad
    def slopes(rule, world):
        return jnp.sum(weight_field(world, cell((0, 1)), cell((2, 2)), rule, "node"))

    for occupied in (drawn("#..", "...", "..."), drawn("...", "...", "...")):
        assert all(np.isfinite(leaf) for leaf in jax.tree.leaves(slopes(RULE_AS_ARRAYS, grid_of(occupied))))


RULE_AS_ARRAYS = jax.tree.map(jnp.float32, RULE)
