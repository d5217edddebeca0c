"""Obstacle densities against counting."""

import jax
import jax.numpy as jnp
import numpy as np
from hypothesis import given

from adwa_jax.density import obstacle_density
from tests.reference import density as reference
from tests.test_adwa_jax.worlds import cell, drawn, few_examples, free_cells, grid_of, maps

densities = jax.jit(obstacle_density)


def test_counts_of_a_hand_drawn_map():
    found = densities(grid_of(drawn("#..", ".#.")), cell((1, 2)))
    np.testing.assert_array_equal(found.obstacles[:2, :3], [[2, 1, 0], [1, 1, 0]])
    np.testing.assert_array_equal(found.cells[:2, :3], [[6, 4, 2], [3, 2, 1]])
    assert (float(found.map_obstacles), float(found.map_cells)) == (2, 6)


@few_examples
@given(maps)
def test_every_cell_equals_counting(occupied):
    height, width = occupied.shape
    goal = free_cells(occupied, 0, 1)[0]
    found = densities(grid_of(occupied), cell(goal))
    for row in range(height):
        for column in range(width):
            share = reference.share(occupied, (row, column), goal)
            assert float(found.obstacles[row, column]) == share * int(found.cells[row, column])
    assert float(found.map_obstacles) == reference.map_share(occupied) * occupied.size
    assert float(found.map_cells) == occupied.size


def test_vmap_over_goals_equals_a_loop():
    world = grid_of(drawn("#....", ".##..", "....#"))
    goals = jnp.int32([[0, 1], [2, 3], [1, 0]])
    together = jax.jit(jax.vmap(obstacle_density, (None, 0)))(world, goals)
    for k, goal in enumerate(goals):
        alone = densities(world, goal)
        jax.tree.map(np.testing.assert_array_equal, jax.tree.map(lambda a, k=k: a[k], together), alone)
