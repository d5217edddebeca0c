"""The search against a heap search in unlimited integers: status, cost, path, expansions and their order."""

import math
from fractions import Fraction
from functools import partial
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adwa_jax.astar import SearchOptions, Status, search
from adwa_jax.heuristic_weight import WeightRule, weight_field
from tests.reference import astar as reference
from tests.reference import density as density_reference
from tests.test_adwa_jax.worlds import (
    SHAPE,
    SIZES,
    cell,
    counting,
    drawn,
    few_examples,
    free_cells,
    grid_of,
    many_examples,
    maps,
    padded,
    random_map,
)

searched, traces = counting(search, static_argnames="options")
weighed = jax.jit(weight_field, static_argnames="scope")
ONES = jnp.ones(SHAPE, jnp.float32)
RULE_CONSTANTS = {"dense_base": 0.25, "dense_gain": 0.5, "sparse_base": 1.25, "sparse_gain": 0.5}
tasks = st.tuples(maps, st.integers(0, 1000)).map(lambda drawing: (drawing[0], *free_cells(*drawing, 2)))


def run(occupied, start, goal, weight=ONES, **options):
    return searched(jnp.asarray(padded(occupied)), cell(start), cell(goal), weight, SearchOptions(**options))


def path_of(result):
    return tuple(map(tuple, np.asarray(result.path)[: int(result.path_cells)].tolist()))


def order_of(result):
    """Cells (row, col) in the order they were closed."""
    order = np.asarray(result.expanded_at)
    cells = sorted((int(order[index]), index) for index in np.ndindex(order.shape) if order[index] >= 0)
    assert [place for place, _ in cells] == list(range(len(cells)))
    return tuple(index for _, index in cells)


def assert_same(result, expected):
    """Every output of the kernel against the oracle's answer."""
    assert Status(int(result.status)).name == expected.status
    assert order_of(result) == expected.expanded
    assert int(result.expansions) == expected.expansions
    assert path_of(result) == expected.path
    assert (int(result.straight_steps), int(result.diagonal_steps)) == (
        expected.straight_steps, expected.diagonal_steps)


def weights_1024(weight):
    """The oracle's weight function for a [H, W] float32 weight."""
    steps = np.round(np.asarray(weight, np.float64) * 1024).astype(int)
    return lambda index: int(steps[index])


def test_way_around_a_wall_by_hand():
    occupied = drawn(
        "....",
        ".##.",
        "....",
    )
    result = run(occupied, (1, 0), (1, 3))
    # Along row 0 or row 2: both cost 5 straight steps (no corner may be cut); row 0 has the lower indices.
    assert path_of(result) == ((1, 0), (0, 0), (0, 1), (0, 2), (0, 3), (1, 3))
    assert (int(result.straight_steps), int(result.diagonal_steps)) == (5, 0)
    cut = run(occupied, (1, 0), (1, 3), corner_rule="always")
    assert path_of(cut) == ((1, 0), (0, 1), (0, 2), (1, 3))
    assert (int(cut.straight_steps), int(cut.diagonal_steps)) == (1, 2)


@pytest.mark.parametrize(("rule", "found"), [("never", False), ("squeeze", False), ("always", True)])
def test_no_rule_but_always_passes_between_two_corners(rule, found):
    result = run(drawn(".#", "#."), (0, 0), (1, 1), corner_rule=rule)
    assert int(result.status) == (Status.FOUND if found else Status.UNREACHABLE)
    assert path_of(result) == (((0, 0), (1, 1)) if found else ())


@pytest.mark.parametrize(("rule", "steps"), [("never", (2, 0)), ("squeeze", (0, 1)), ("always", (0, 1))])
def test_never_goes_round_a_single_corner(rule, steps):
    result = run(drawn("..", "#."), (0, 0), (1, 1), corner_rule=rule)
    assert (int(result.straight_steps), int(result.diagonal_steps)) == steps


@pytest.mark.parametrize("stop_rule", ["popped", "generated"])
@pytest.mark.parametrize("rows", [
    ("..#.",),
    ("####", "####", "..#.", "####"),
    ("####", "####", "####", "#..#", "####", "...#"),
    ("#.##", "..##", "##..", "##.#"),
])
def test_walled_off_goal_is_unreachable(rows, stop_rule):
    occupied = drawn(*rows)
    start, goal = np.argwhere(~occupied)[[0, -1]]
    result = run(occupied, start, goal, stop_rule=stop_rule)
    assert int(result.status) == Status.UNREACHABLE
    assert (int(result.path_cells), int(result.straight_steps), int(result.diagonal_steps)) == (0, 0, 0)
    assert_same(result, reference.search(padded(occupied), start, goal, stop_rule=stop_rule))


def test_bad_ends_are_named():
    occupied = drawn(".#.", "...")
    assert int(run(occupied, (0, 1), (1, 1)).status) == Status.BAD_START
    assert int(run(occupied, (1, 1), (0, 1)).status) == Status.BAD_GOAL
    assert int(run(occupied, (0, 1), (0, 1)).status) == Status.BAD_START
    for off in ((-1, 0), (0, -1), (12, 0), (0, 12), (500, -500)):
        result = run(occupied, off, (0, 0))
        assert (int(result.status), int(result.expansions)) == (Status.BAD_START, 0)
        assert int(run(occupied, (0, 0), off).status) == Status.BAD_GOAL


def test_start_at_the_goal_is_found_without_expanding():
    result = run(drawn("..", ".."), (1, 0), (1, 0))
    assert_same(result, reference.Answer("FOUND", ((1, 0),)))
    assert path_of(result) == ((1, 0),)


def test_budget_counts_expansions_and_the_goal_s_pop_is_none():
    line = drawn(".....")
    enough = run(line, (0, 0), (0, 3), budget=3)
    assert (int(enough.status), int(enough.expansions)) == (Status.FOUND, 3)
    short = run(line, (0, 0), (0, 4), budget=3)
    assert (int(short.status), int(short.expansions), int(short.path_cells)) == (2, 3, 0)
    # An open list that runs empty at the last allowed expansion proves that there is no way.
    assert int(run(drawn("...#."), (0, 0), (0, 4), budget=3).status) == Status.UNREACHABLE


@pytest.mark.parametrize(("field", "value"), [
    ("budget", 0),
    ("budget", -5),
    ("corner_rule", "sometimes"),
    ("heuristic", "chebyshev"),
    ("stop_rule", "closed"),
])
def test_nonsense_options_are_refused(field, value):
    with pytest.raises(ValueError, match=field):
        SearchOptions(**{field: value})


def test_map_too_large_for_exact_costs_is_refused():
    blocked, weight = (jax.ShapeDtypeStruct((40000, 40000), kind) for kind in (bool, jnp.float32))
    ends = jax.ShapeDtypeStruct((2,), jnp.int32)
    with pytest.raises(ValueError, match="map size"):
        jax.eval_shape(partial(search, options=SearchOptions()), blocked, ends, ends, weight)


@many_examples
@given(tasks)
def test_default_search_equals_the_oracle(task):
    occupied, start, goal = task
    assert_same(run(occupied, start, goal), reference.search(padded(occupied), start, goal))


@pytest.mark.parametrize(("corner_rule", "heuristic", "stop_rule"), [
    ("always", "octile", "generated"),
    ("squeeze", "manhattan", "popped"),
    ("never", "zero", "popped"),
    ("always", "zero", "generated"),
    ("always", "euclidean", "popped"),
    ("never", "euclidean", "generated"),
    ("squeeze", "octile", "generated"),
])
def test_every_option_equals_the_oracle(corner_rule, heuristic, stop_rule):
    options = {"corner_rule": corner_rule, "heuristic": heuristic, "stop_rule": stop_rule}
    for seed in range(30):
        occupied = random_map(seed, SIZES[seed % 3], (0.0, 0.15, 0.3)[seed // 3 % 3])
        start, goal = free_cells(occupied, seed, 2)
        expected = reference.search(padded(occupied), start, goal, **options)
        assert_same(run(occupied, start, goal, **options), expected)


@pytest.mark.parametrize("heuristic", ["octile", "euclidean", "manhattan"])
def test_ties_on_an_empty_map_follow_the_stated_order(heuristic):
    # Nothing but ties: an error of one unit in any cost changes the order of closing.
    occupied = np.zeros((12, 12), bool)
    for start, goal in (((0, 0), (11, 11)), ((11, 11), (0, 0)), ((0, 11), (11, 2)), ((6, 0), (5, 11))):
        for weight in (1.0, 0.5, 0.0, 2.0):
            field = np.full(SHAPE, weight, np.float32)
            expected = reference.search(occupied, start, goal, weights_1024(field), heuristic=heuristic)
            assert_same(run(occupied, start, goal, jnp.asarray(field), heuristic=heuristic), expected)


@few_examples
@given(tasks)
def test_weights_of_the_node_scope_equal_the_oracle_from_counting_cells(task):
    occupied, start, goal = task
    weight = weighed(grid_of(occupied), cell(start), cell(goal), WeightRule(**RULE_CONSTANTS), scope="node")
    counted = partial(density_reference.weight_1024, occupied, goal=goal, **RULE_CONSTANTS)
    assert_same(run(occupied, start, goal, weight), reference.search(padded(occupied), start, goal, counted))


@many_examples
@given(tasks, st.integers(0, 4096))
def test_any_constant_weight_equals_the_oracle_and_keeps_its_bound(task, steps):
    occupied, start, goal = task
    result = run(occupied, start, goal, jnp.full(SHAPE, steps / 1024, jnp.float32))
    expected = reference.search(padded(occupied), start, goal, lambda _: steps)
    assert_same(result, expected)
    if expected.status == "FOUND":
        optimum = reference.cheapest_cost(occupied, start, goal)
        cost = int(result.straight_steps) * reference.ONE + int(result.diagonal_steps) * reference.ROOT2
        assert cost <= max(Fraction(steps, 1024), 1) * optimum
        assert steps > 1024 or cost == optimum


def test_weight_is_rounded_to_1024ths():
    occupied = random_map(3, (12, 10), 0.3)
    start, goal = (0, 0), (11, 9)
    near = run(occupied, start, goal, jnp.full(SHAPE, 1.2, jnp.float32))  # 1228.8
    assert_same(near, reference.search(padded(occupied), start, goal, weights_1024(np.full(SHAPE, 1.2))))
    assert order_of(near) == order_of(run(occupied, start, goal, jnp.full(SHAPE, 1229 / 1024, jnp.float32)))


@pytest.mark.parametrize("corner_rule", ["never", "squeeze", "always"])
def test_every_step_of_every_path_is_legal(corner_rule):
    found = 0
    for seed in range(25):
        occupied = random_map(100 + seed, (12, 10), 0.3)
        start, goal = free_cells(occupied, seed, 2)
        path = path_of(run(occupied, start, goal, corner_rule=corner_rule))
        found += len(path) > 2
        for here, there in pairwise(path):
            step = (there[0] - here[0], there[1] - here[1])
            assert max(map(abs, step)) == 1
            assert reference.legal(occupied, here, step, corner_rule)
        assert not path or (path[0], path[-1]) == (start, goal)
    assert found > 5


def unequal_tasks():
    """Unlike work per lane: a wall of detours, an empty map, a neighbour, a walled-off goal, bad ends."""
    maze = np.zeros((12, 12), bool)
    maze[1::4, :-1] = maze[3::4, 1:] = True
    return [
        (maze, (0, 0), (10, 11)),
        (np.zeros((12, 12), bool), (0, 0), (11, 11)),
        (np.zeros((12, 12), bool), (5, 5), (5, 6)),
        (padded(drawn("..#.")), (0, 0), (0, 3)),
        (padded(drawn("..#.")), (0, 2), (0, 3)),
        (padded(random_map(5, (9, 9), 0.2)), (0, 0), (8, 8)),
        (np.zeros((12, 12), bool), (4, 4), (4, 4)),
    ]


def test_vmap_equals_a_loop_with_unequal_work():
    options = SearchOptions(budget=30)
    tasks = unequal_tasks()
    blocked, start, goal = (jnp.asarray(np.array(column)) for column in zip(*tasks, strict=True))
    start, goal = start.astype(jnp.int32), goal.astype(jnp.int32)
    lanes = jax.jit(jax.vmap(partial(search, options=options), (0, 0, 0, None)))
    together = lanes(blocked, start, goal, ONES)
    for k in range(len(tasks)):
        alone = searched(blocked[k], start[k], goal[k], ONES, options)
        jax.tree.map(np.testing.assert_array_equal, jax.tree.map(lambda leaf, k=k: leaf[k], together), alone)
    assert len(set(np.asarray(together.expansions).tolist())) >= 5
    assert Status.BUDGET_EXHAUSTED in together.status.tolist()


def test_padding_changes_no_answer():
    for seed in range(3):
        occupied = random_map(seed, (9, 9), 0.25)
        alone = searched(jnp.asarray(occupied), cell((0, 0)), cell((8, 8)), jnp.ones((9, 9)), SearchOptions())
        with_padding = run(occupied, (0, 0), (8, 8))
        assert path_of(alone) == path_of(with_padding)
        np.testing.assert_array_equal(alone.expanded_at, with_padding.expanded_at[:9, :9])
        assert int(alone.expansions) == int(with_padding.expansions)


def test_changing_maps_tasks_and_weights_does_not_retrace():
    run(drawn("..", ".."), (0, 0), (1, 1))
    before = len(traces)
    for k, (blocked, start, goal) in enumerate(unequal_tasks()):
        run(blocked, start, goal, jnp.full(SHAPE, 1.0 + k / 8, jnp.float32))
    assert len(traces) == before


def test_path_buffer_beyond_its_length_repeats_the_goal():
    result = run(drawn("...."), (0, 0), (0, 2))
    assert result.path.shape == (SHAPE[0] * SHAPE[1], 2)
    np.testing.assert_array_equal(result.path[3:], np.tile([0, 2], (SHAPE[0] * SHAPE[1] - 3, 1)))
    assert math.isclose(int(result.straight_steps) + math.sqrt(2) * int(result.diagonal_steps), 2.0)
