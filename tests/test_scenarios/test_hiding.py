import dataclasses

import jax
import numpy as np

from scenarios.generators import toy
from scenarios.hiding import hide, hide_all
from scenarios.padding import pad, padded_shape

KEY = jax.random.key(0)
DRAWING = """
S.#
.##
..G
"""
OCCUPIED = np.array([[0, 0, 0], [0, 1, 1], [0, 0, 1]], bool)  # row 0 is the lowest


def drawn():
    return toy.generate(KEY, toy.ToySpec(drawing=DRAWING))


def test_every_occupied_cell_becomes_hidden_and_the_map_free():
    scenario = hide(drawn())
    np.testing.assert_array_equal(scenario.hidden, OCCUPIED)
    assert not scenario.grid.occupied.any()
    assert (scenario.grid.height, scenario.grid.width) == (3, 3)


def test_only_the_map_and_what_is_hidden_change():
    before, after = drawn(), hide(drawn())
    undone = dataclasses.replace(after, grid=before.grid, hidden=before.hidden)
    for one, other in zip(jax.tree.leaves(before), jax.tree.leaves(undone), strict=True):
        np.testing.assert_array_equal(one, other)


def test_beyond_the_border_all_stays_occupied_and_nothing_is_hidden():
    padded = hide(pad(drawn(), padded_shape(drawn())))
    np.testing.assert_array_equal(padded.hidden[:3, :3], OCCUPIED)
    assert padded.hidden.sum() == OCCUPIED.sum()
    expected = np.ones((16, 16), bool)
    expected[:3, :3] = False
    np.testing.assert_array_equal(padded.grid.occupied, expected)


def test_cells_hidden_before_stay_hidden():
    half_known = dataclasses.replace(drawn(), hidden=np.eye(3, dtype=bool)[::-1])
    np.testing.assert_array_equal(hide(half_known).hidden, OCCUPIED | half_known.hidden)
    np.testing.assert_array_equal(hide(hide(drawn())).hidden, OCCUPIED)


def test_scenarios_that_shared_a_map_share_what_it_becomes():
    one = drawn()
    other = dataclasses.replace(one, goal=np.float32([0.5, 0.5]))
    first, second, third = hide_all([one, other, drawn()])
    assert first.grid is second.grid
    assert first.hidden is second.hidden
    assert third.grid is not first.grid
    np.testing.assert_array_equal(second.goal, [0.5, 0.5])
    np.testing.assert_array_equal(third.hidden, OCCUPIED)
