import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from adwa_jax.grid import inflate
from adwa_jax.obstacles import movers_at
from scenarios.generators import crowd, paper, toy
from scenarios.hiding import hide
from scenarios.padding import PaddedShape, pad, padded_shape, stack

KEY = jax.random.key(11)
kernel_inflate = jax.jit(inflate)
kernel_movers_at = jax.jit(movers_at)


@pytest.mark.parametrize(
    ("cells", "rung"),
    [(1, 16), (16, 16), (17, 24), (25, 32), (33, 48), (49, 64), (97, 128), (129, 192), (513, 768), (769, 1024),
     (1025, 1536)],
)  # fmt: skip
def test_sides_climb_the_ladder(cells, rung):
    line = "S" + "." * max(0, cells - 2) + "G"
    scenario = toy.generate(KEY, toy.ToySpec(drawing=line))
    assert padded_shape(scenario).rows == 16
    assert padded_shape(scenario).columns == max(rung, 16)


@pytest.mark.parametrize(("count", "rung"), [(0, 0), (1, 8), (8, 8), (9, 16), (17, 32), (33, 64)])
def test_movers_and_squares_climb_their_ladder(count, rung):
    drawing = "S" + ">" * count + "o" * count + "G"
    shape = padded_shape(toy.generate(KEY, toy.ToySpec(drawing=drawing)))
    assert (shape.squares, shape.movers, shape.track_points) == (rung, rung, 0)


@pytest.mark.parametrize(("legs", "rung"), [(2, 16), (14, 16), (16, 64), (64, 256), (256, 1024)])
def test_track_points_climb_their_ladder(legs, rung):
    assert padded_shape(crowd.generate(KEY, crowd.CrowdSpec(legs=legs, movers=1))).track_points == rung


def test_a_scenario_is_padded_with_occupied_cells_and_nothing_valid():
    scenario = paper.generate(KEY, paper.PaperSpec(cells=15))
    padded = pad(scenario, padded_shape(scenario))
    assert padded.grid.occupied.shape == (16, 16)
    assert (int(padded.grid.height), int(padded.grid.width)) == (15, 15)
    np.testing.assert_array_equal(padded.grid.occupied[:15, :15], scenario.grid.occupied)
    assert padded.grid.occupied[15].all()
    assert padded.grid.occupied[:, 15].all()
    np.testing.assert_array_equal(padded.squares.valid, [True] * 5 + [False] * 3)
    np.testing.assert_array_equal(padded.movers.valid, [True] * 3 + [False] * 5)
    for before, after in zip(jax.tree.leaves(scenario), jax.tree.leaves(padded), strict=True):
        assert isinstance(after, np.ndarray)
        assert after.dtype == before.dtype
        assert np.isfinite(after).all()
        np.testing.assert_array_equal(after[tuple(slice(size) for size in before.shape)], before)


def test_track_padding_repeats_the_last_row():
    scenario = crowd.generate(KEY, crowd.CrowdSpec(legs=2, movers=1))
    padded = pad(scenario, dataclasses.replace(padded_shape(scenario), track_points=6))
    np.testing.assert_array_equal(padded.movers.track[0, :3], scenario.movers.track[0])
    np.testing.assert_array_equal(padded.movers.track[0, 3:], np.tile(scenario.movers.track[0, 2], (3, 1)))
    np.testing.assert_array_equal(padded.movers.track_length[:1], [3])


@pytest.mark.parametrize(
    "scenario",
    [
        paper.generate(KEY, paper.PaperSpec(cells=15)),
        crowd.generate(KEY, crowd.CrowdSpec(movers=3)),
        crowd.from_tracks(KEY, crowd.CrowdSpec(), [np.array([[0, 0, 0], [5, 9, 9.0], [9, 0, 3]]),
                                                   np.array([[2, 5, 5], [4, 5, 7.0]])]),
    ],
    ids=["mirrored", "periodic", "recorded"],
)  # fmt: skip
def test_padding_moves_no_mover(scenario):
    shape = dataclasses.replace(padded_shape(scenario), movers=16, track_points=64)
    padded, count = pad(scenario, shape), len(scenario.movers.valid)
    for time in (0.0, 3.3, 4.0, 8.9, 47.0):
        before, after = (kernel_movers_at(each.movers, jnp.float32(time)) for each in (scenario, padded))
        np.testing.assert_array_equal(after.present, np.pad(np.asarray(before.present), (0, 16 - count)))
        np.testing.assert_array_equal(after.position[:count], before.position)
        np.testing.assert_array_equal(after.velocity[:count], before.velocity)
        assert np.isfinite(np.asarray(after.position)).all()


def test_hidden_cells_are_padded_with_cells_that_are_not_hidden():
    scenario = hide(paper.generate(KEY, paper.PaperSpec(cells=15)))
    shape = padded_shape(scenario)
    assert shape.hidden
    assert not padded_shape(paper.generate(KEY, paper.PaperSpec(cells=15))).hidden
    padded = pad(scenario, shape)
    np.testing.assert_array_equal(padded.hidden, np.pad(scenario.hidden, ((0, 1), (0, 1))))
    assert padded.grid.occupied[15].all()
    with pytest.raises(ValueError, match="must hold the scenario's"):
        pad(scenario, dataclasses.replace(shape, hidden=False))


def test_one_that_hides_nothing_stacks_with_one_that_does():
    open_map = paper.generate(KEY, paper.PaperSpec(cells=15))
    shape = padded_shape(hide(open_map))
    batch = stack([pad(scenario, shape) for scenario in (open_map, hide(open_map))])
    assert batch.hidden.shape == (2, 16, 16)
    np.testing.assert_array_equal(batch.hidden.any(axis=(1, 2)), [False, True])


def test_padding_inflates_no_cell_of_the_map():
    scenario = paper.generate(KEY, paper.PaperSpec(cells=15))
    before = kernel_inflate(scenario.grid, jnp.float32(1.2))
    after = kernel_inflate(pad(scenario, padded_shape(scenario)).grid, jnp.float32(1.2))
    np.testing.assert_array_equal(np.asarray(after)[:15, :15], np.asarray(before))


def test_scenarios_of_unequal_size_stack_into_one_batch():
    some = [paper.generate(KEY, paper.PaperSpec(cells=cells)) for cells in (15, 20)]
    some.append(crowd.generate(KEY, crowd.CrowdSpec(side=8.0, movers=2)))
    shape = PaddedShape(rows=24, columns=24, squares=8, movers=8, track_points=16)
    batch = stack([pad(scenario, shape) for scenario in some])
    assert batch.grid.occupied.shape == (3, 24, 24)
    assert batch.movers.track.shape == (3, 8, 16, 3)
    np.testing.assert_array_equal(batch.grid.width, [15, 20, 16])
    np.testing.assert_array_equal(batch.start, np.stack([scenario.start for scenario in some]))


def test_too_small_a_shape_is_refused():
    scenario = paper.generate(KEY, paper.PaperSpec(cells=20))
    with pytest.raises(ValueError, match=r"\(16, 24\); must hold the scenario's \(20, 20\); take its padded_shape"):
        pad(scenario, dataclasses.replace(padded_shape(scenario), rows=16))
    with pytest.raises(ValueError, match="must hold the scenario's"):
        pad(scenario, dataclasses.replace(padded_shape(scenario), squares=0))


def test_unequal_shapes_do_not_stack():
    some = [paper.generate(KEY, paper.PaperSpec(cells=cells)) for cells in (15, 20)]
    with pytest.raises(ValueError, match="same shape"):
        stack(some)
