"""Many searches in one call against a loop over the unbatched kernel: every output, bit for bit."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from adwa_jax.astar import SearchOptions, SearchResult, Status, search
from adwa_jax.astar_lanes import search_lanes
from tests.test_adwa_jax.worlds import SHAPE, counting, random_map

LANES = 24
together, traces = counting(search_lanes, static_argnames="options")
alone = jax.jit(search, static_argnames="options")
DENSITIES = (0.0, 0.15, 0.3, 0.45)


def tasks(shape, seed=0, lanes=LANES):
    """Maps, starts, goals and weights [B, ...]: easy and hard, with ends that are blocked, off the map or the same."""
    rng = np.random.default_rng(seed)
    blocked = np.stack([random_map(seed + lane, shape, DENSITIES[lane % 4]) for lane in range(lanes)])
    ends = rng.integers(0, shape, (2, lanes, 2))
    ends[0, ::2], ends[1, ::2] = (0, 0), np.subtract(shape, 1)
    ends[1, 5], ends[0, 7], ends[1, 11] = ends[0, 5], (-1, 2), (0, shape[1])
    weight = rng.uniform(0.0, 4.0, (lanes, *shape)) * (rng.random((lanes, 1, 1)) < 0.7)
    weight[::4] = 1.0
    return (jnp.asarray(blocked), jnp.asarray(ends[0], jnp.int32), jnp.asarray(ends[1], jnp.int32),
            jnp.asarray(weight, jnp.float32))


def loop(lanes, options):
    """The unbatched kernel, lane by lane."""
    results = [alone(*(field[k] for field in lanes), options=options) for k in range(len(lanes[0]))]
    return jax.tree.map(lambda *fields: np.stack(fields), *results)


def assert_same(result, expected):
    for name, got, wanted in zip(SearchResult._fields, result, expected, strict=True):
        assert got.dtype == wanted.dtype, name
        np.testing.assert_array_equal(got, wanted, err_msg=name)


def assert_equals_the_loop(lanes, options):
    result = together(*lanes, options=options)
    assert_same(result, loop(lanes, options))
    return result


def test_tasks_end_in_every_way_and_after_unequal_work():
    result = together(*tasks(SHAPE), options=SearchOptions(budget=40))
    assert set(np.asarray(result.status).tolist()) == {int(status) for status in Status}
    assert len(set(np.asarray(result.expansions).tolist())) >= 8
    assert 0 in result.expansions


@pytest.mark.parametrize(("corner_rule", "heuristic", "stop_rule", "budget"), [
    ("never", "octile", "popped", None),
    ("never", "octile", "popped", 40),
    ("always", "octile", "generated", None),
    ("squeeze", "manhattan", "popped", None),
    ("never", "zero", "popped", 25),
    ("always", "euclidean", "popped", None),
    ("squeeze", "euclidean", "generated", 30),
])
def test_every_rule_equals_a_loop_over_the_unbatched_kernel(corner_rule, heuristic, stop_rule, budget):
    options = SearchOptions(corner_rule, heuristic, stop_rule, budget)
    for seed in (0, 100, 200):
        assert_equals_the_loop(tasks(SHAPE, seed), options)


# Up to 32 cells a row or column is looked through cell by cell, beyond by vectors, beyond 128 in two folds.
@pytest.mark.parametrize("shape", [(7, 19), (1, 9), (40, 6), (5, 33), (3, 150), (140, 4)])
def test_any_shape_equals_a_loop_over_the_unbatched_kernel(shape):
    result = assert_equals_the_loop(tasks(shape, 300), SearchOptions())
    assert Status.FOUND in result.status


def test_largest_weights_and_ties_on_an_empty_map_keep_the_stated_order():
    _, start, goal, weight = tasks(SHAPE, 400)
    for field in (jnp.full_like(weight, 16.0), jnp.ones_like(weight), jnp.zeros_like(weight), weight * 4.0):
        assert_equals_the_loop((jnp.zeros(weight.shape, bool), start, goal, field), SearchOptions())


def test_a_lane_s_answer_depends_on_neither_its_place_nor_its_company():
    lanes = tasks(SHAPE)
    result = together(*lanes, options=SearchOptions())
    order = np.random.default_rng(0).permutation(LANES)
    assert_same(together(*(field[order] for field in lanes), options=SearchOptions()),
                jax.tree.map(lambda field: field[order], result))
    few = slice(3, 6)
    assert_same(together(*(field[few] for field in lanes), options=SearchOptions()),
                jax.tree.map(lambda field: field[few], result))


def test_changing_maps_ends_and_weights_does_not_retrace():
    together(*tasks(SHAPE), options=SearchOptions())
    before = len(traces)
    for seed in range(3):
        blocked, start, goal, weight = tasks(SHAPE, seed)
        together(blocked, start, goal, weight * (1.0 + seed), options=SearchOptions())
    assert len(traces) == before


def test_inside_a_larger_program_the_answers_are_the_same():
    lanes = tasks(SHAPE)
    doubled = jax.jit(lambda *fields: (search_lanes(*fields, SearchOptions()), fields[3] * 2.0))
    assert_same(doubled(*lanes)[0], loop(lanes, SearchOptions()))


def test_the_loop_is_one_native_function_that_copies_no_map():
    shape = (40, 41)  # in memory 48 × 48
    program = jax.jit(partial(search_lanes, options=SearchOptions())).lower(*tasks(shape)).compile().as_text()
    assert 'xla_cpu_small_call="true"' in program
    assert "s32[48,48]" in program
    assert not [line for line in program.splitlines() if "= s32[48,48]" in line and " copy(" in line]


def test_map_too_large_for_exact_costs_is_refused():
    kinds = ((40000, 40000), bool), ((2,), jnp.int32), ((2,), jnp.int32), ((40000, 40000), jnp.float32)
    lanes = [jax.ShapeDtypeStruct((2, *shape), kind) for shape, kind in kinds]
    with pytest.raises(ValueError, match="map size"):
        jax.eval_shape(partial(search_lanes, options=SearchOptions()), *lanes)
