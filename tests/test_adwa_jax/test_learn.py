"""What the robot learns under way: hidden cells in its field, and new routes where the old one is blocked."""

import itertools
import math
from dataclasses import replace
from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adwa_jax.constants import DwaOptions, Options, PlanOptions
from adwa_jax.grid import distance_field
from adwa_jax.learn import first_memory, in_range, known_grid, learn, overlapped, route_blocked
from adwa_jax.presets import paper
from adwa_jax.route import route_through
from adwa_jax.rules import Rules
from tests.reference import distance as distance_reference
from tests.reference import keypoints as keypoints_reference
from tests.test_adwa_jax.worlds import (
    CAPACITY,
    SHAPE,
    drawn,
    few_examples,
    grid_of,
    plan_by_hand,
    random_map,
    scenario,
    squares_of,
)

OPTIONS = Options(plan=PlanOptions(subdivision=4), dwa=DwaOptions(5, 9, 10))
REPLANS = replace(OPTIONS, rules=Rules(replan=True))
CONSTANTS = replace(
    paper().constants,
    robot=replace(paper().constants.robot, radius=0.25),
    behaviour=replace(paper().constants.behaviour, clearance_margin=0.35, route_margin=0.05, sensor_range=2.0),
)
NEVER_LOST = jnp.bool_(False)
NO_SQUARE = jnp.zeros(CAPACITY, bool)
ROOM = np.zeros(SHAPE, bool)
PLACES = SHAPE[0] * SHAPE[1]  # capacity of a route

learned = jax.jit(learn, static_argnames="options")
field_of = jax.jit(distance_field, static_argnames="subdivision")
cells_in_range, cells_overlapped = jax.jit(in_range), jax.jit(overlapped)
blocked, first = jax.jit(route_blocked), jax.jit(first_memory)


def task(occupied=ROOM, start=(1.5, 6.5), goal=(10.5, 6.5), hidden=ROOM, **more):
    """Every task here has room for hidden cells, so that one compiled program serves all."""
    return scenario(occupied, start, goal, hidden=hidden, **more)


def begin(world, *by_way_of):
    """What the robot remembers when it starts on a route of its start, these points and its goal."""
    points = jnp.float32([world.start[:2], *by_way_of, *[world.goal] * (PLACES - 1 - len(by_way_of))])
    field = field_of(world.grid, subdivision=OPTIONS.plan.subdivision)
    return first(world, plan_by_hand(points, jnp.int32(2 + len(by_way_of)), field))


def sensing(sensor_range):
    return replace(CONSTANTS, behaviour=replace(CONSTANTS.behaviour, sensor_range=sensor_range))


def take_in(memory, position, world, *, target=1, known=NO_SQUARE, lost=NEVER_LOST, constants=CONSTANTS,
            options=REPLANS):
    return learned(memory, jnp.float32(position), jnp.int32(target), jnp.asarray(known), jnp.asarray(lost), world,
                   constants, options=options)


# Hidden cells.

FOUR = np.zeros(SHAPE, bool)
FOUR[2, 5] = FOUR[4, 2] = FOUR[5, 5] = FOUR[2, 3] = True


@pytest.mark.parametrize(("sensor_range", "seen"), [
    (0.49, []),
    (0.5, [(2, 3)]),  # its side at x = 3
    (1.5, [(2, 3), (4, 2)]),  # below y = 4
    (2.5, [(2, 3), (2, 5), (4, 2)]),
    (3.53, [(2, 3), (2, 5), (4, 2)]),
    (3.54, [(2, 3), (2, 5), (4, 2), (5, 5)]),  # its corner at (5, 5): √(2.5² + 2.5²) = 3.5355
])
def test_cells_come_into_range_with_their_nearest_side(sensor_range, seen):
    world = scenario(ROOM, (2.5, 2.5), (9.5, 9.5), hidden=FOUR)
    found = cells_in_range(world, world.start[:2], jnp.float32(sensor_range))
    assert sorted(map(tuple, np.argwhere(found).tolist())) == sorted(seen)


def test_range_is_in_metres_from_the_maps_origin():
    world = scenario(ROOM, (2.5, 2.5), (9.5, 9.5), hidden=FOUR)
    world = replace(world, grid=grid_of(ROOM, resolution=0.5, origin=(-3.0, 10.0)))
    found = cells_in_range(world, jnp.float32([-1.75, 11.25]), jnp.float32(0.75))  # the same place, half the size
    assert sorted(map(tuple, np.argwhere(found).tolist())) == [(2, 3), (4, 2)]


maps = st.builds(random_map, st.integers(0, 2**32 - 1), st.just(SHAPE), st.sampled_from((0.0, 0.1, 0.25)))
spots = st.tuples(st.floats(0, 12, width=32), st.floats(0, 12, width=32))


@few_examples
@given(maps, maps, spots, spots, st.floats(0.1, 6.0))
def test_field_is_that_of_the_map_with_the_cells_seen(occupied, others, spot, later, sensor_range):
    hidden = others & ~occupied
    world = scenario(occupied, (0.5, 0.5), (11.5, 11.5), hidden=hidden)
    memory = begin(world)
    np.testing.assert_array_equal(memory.distance, field_of(world.grid, subdivision=4).distance)
    assert not memory.seen.any()
    for place in (spot, later, later):
        before = memory.seen
        memory = take_in(memory, place, world, constants=sensing(sensor_range), options=OPTIONS)
        gaps = np.array([[distance_reference.squared_gap(*place, row, column) for column in range(SHAPE[1])]
                         for row in range(SHAPE[0])])  # fmt: skip
        close = abs(np.sqrt(gaps) - sensor_range) < 1e-5
        seen = hidden & (gaps <= sensor_range**2) | np.asarray(before)
        np.testing.assert_array_equal(memory.seen[~close], seen[~close])
        union = replace(world.grid, occupied=world.grid.occupied | memory.seen)
        np.testing.assert_array_equal(memory.distance, field_of(union, subdivision=4).distance)


def test_finer_lattices_are_right_but_for_rounding():
    hidden = random_map(3, SHAPE, 0.15)
    world = scenario(random_map(4, SHAPE, 0.1), (0.5, 0.5), (11.5, 11.5), hidden=hidden)
    fine = replace(OPTIONS, plan=replace(OPTIONS.plan, subdivision=10))
    memory = begin(world)._replace(distance=field_of(world.grid, subdivision=10).distance)
    memory = take_in(memory, (6.0, 6.0), world, constants=sensing(20.0), options=fine)
    union = replace(world.grid, occupied=world.grid.occupied | jnp.asarray(hidden))
    np.testing.assert_allclose(memory.distance, field_of(union, subdivision=10).distance, atol=1e-5)


def test_without_hidden_cells_there_is_no_field_to_keep():
    memory = begin(scenario(ROOM, (0.5, 0.5), (9.5, 9.5)))
    assert memory.distance.shape == memory.seen.shape == (0, 0)


def test_seeing_cells_does_not_change_what_is_headed_for():
    # Whatever was headed for when the robot last learned; without new routes nothing else may change it.
    world = task(start=(1.5, 1.5), goal=(1.5, 4.5), hidden=FOUR)
    memory = begin(world, (9.5, 1.5), (9.5, 4.5))
    for target in (1, 3, 2):
        memory = take_in(memory, (2.5, 2.5), world, target=target, options=OPTIONS)
        assert int(memory.target) == target


# Cells that known squares overlap.


def overlapped_by(*squares, known=None, **frame):
    known = [k < len(squares) if known is None else k in known for k in range(CAPACITY)]
    found = cells_overlapped(grid_of(ROOM, **frame), squares_of(squares), jnp.array(known))
    return sorted(map(tuple, np.argwhere(found).tolist()))


@pytest.mark.parametrize(("square", "cells"), [
    ((4.5, 2.5, 0.3), [(2, 4)]),
    ((4.5, 2.5, 0.5), [(2, 4)]),  # the cell itself: its neighbours are touched
    ((4.5, 2.5, 0.6), [(r, c) for r in (1, 2, 3) for c in (3, 4, 5)]),
    ((4.8, 2.5, 0.3), [(2, 4), (2, 5)]),
    ((5.0, 3.0, 0.2), [(2, 4), (2, 5), (3, 4), (3, 5)]),
    ((4.5, 2.5, 0.0, 0.5), [(2, 4)]),  # a disc that touches four sides
    ((4.5, 2.5, 0.0, 0.6), [(1, 4), (2, 3), (2, 4), (2, 5), (3, 4)]),
    ((4.5, 2.5, 0.0, 0.71), [(r, c) for r in (1, 2, 3) for c in (3, 4, 5)]),  # √½ to the corners
    ((4.5, 2.5, 0.3, 0.2), [(2, 4)]),  # rounded: its straight sides touch
    ((4.5, 2.5, 0.4, 0.13), [(1, 4), (2, 3), (2, 4), (2, 5), (3, 4)]),  # 0.1 · √2 = 0.14 from its corners to the cells'
])
def test_overlapped_cells_by_hand(square, cells):
    assert overlapped_by(square) == sorted(cells)


def test_squares_that_are_not_known_overlap_nothing_and_several_add_up():
    assert overlapped_by((4.5, 2.5, 0.3), (8.5, 9.5, 0.3), known=[0]) == [(2, 4)]
    assert overlapped_by((4.5, 2.5, 0.3), (8.5, 9.5, 0.3)) == [(2, 4), (9, 8)]
    assert overlapped_by((-2.0, 10.75, 0.2), resolution=0.5, origin=(-3.0, 10.0)) == [(1, 1), (1, 2)]


@few_examples
@given(spots, st.sampled_from([(0.3, 0.0), (1.2, 0.0), (0.0, 0.25), (0.0, 0.9), (0.3, 0.9), (1.2, 0.25)]))
def test_overlapped_cells_equal_brute_force(centre, size):
    half_width, rounding = size
    found = overlapped_by((*centre, *size))
    for row, column in np.ndindex(*SHAPE):
        # Signed gaps between the sharp square and the cell along x and y.
        lows = zip(centre, (column, row), strict=True)
        gaps = [max(low - c - half_width, c - half_width - low - 1) for c, low in lows]
        apart = math.hypot(*(max(gap, 0.0) for gap in gaps)) - rounding
        depth = max(gaps) if rounding == 0 else apart
        if abs(depth) > 1e-3:
            assert ((row, column) in found) == (depth < 0), (row, column)


def test_known_grid_has_the_map_the_cells_seen_and_the_squares():
    world = scenario(drawn("#...", "....", "....", "...."), (1.5, 1.5), (3.5, 3.5), hidden=FOUR,
                     squares=[(2.5, 0.5, 0.3)])
    grid = known_grid(world, jnp.asarray(FOUR), jnp.array([True, False]))
    expected = np.asarray(world.grid.occupied) | FOUR
    expected[0, 2] = True
    np.testing.assert_array_equal(grid.occupied, expected)


# Routes.


def route(*points):
    return route_through(jnp.float32([*points, *[points[-1]] * (PLACES - len(points))]), jnp.int32(len(points)))


def is_blocked(points, occupied, target=1, **frame):
    return bool(blocked(route(*points), jnp.int32(target), grid_of(occupied, **frame), CONSTANTS))


def test_route_is_blocked_by_what_comes_nearer_than_radius_and_margin():
    # A square [5, 6] × [5, 6]; radius and margin are 0.3 m together.
    one = ROOM.copy()
    one[5, 5] = True
    assert not is_blocked([(1.5, 4.65), (10.5, 4.65)], one)
    assert is_blocked([(1.5, 4.75), (10.5, 4.75)], one)
    assert is_blocked([(1.5, 1.5), (5.5, 5.5)], one)
    assert not is_blocked([(1.5, 1.5), (4.5, 4.5), (1.5, 9.5)], one)
    assert is_blocked([(0.2, 5.5), (1.5, 5.5)], ROOM)  # the border


def test_only_what_is_ahead_can_block_a_route():
    one = ROOM.copy()
    one[5, 5] = True
    through = [(1.5, 5.5), (9.5, 5.5), (9.5, 9.5), (1.5, 9.5)]
    assert [is_blocked(through, one, target) for target in (0, 1, 2, 3)] == [True, True, False, False]


def test_route_is_judged_in_metres():
    one = ROOM.copy()
    one[5, 5] = True  # [−0.5, 0] × [12.5, 13]
    for gap, expected in ((0.28, True), (0.32, False)):
        points = [(-2.5, 12.5 - gap), (2.5, 12.5 - gap)]
        assert is_blocked(points, one, resolution=0.5, origin=(-3.0, 10.0)) is expected


@few_examples
@given(maps, st.lists(st.tuples(st.floats(1, 11, width=32), st.floats(1, 11, width=32)), min_size=2, max_size=4))
def test_blocked_routes_equal_exact_segment_distances(occupied, points):
    def free(margin):
        exact = [tuple(map(Fraction, point)) for point in points]
        return all(keypoints_reference.segment_free(occupied, a, b, Fraction(margin))
                   for a, b in itertools.pairwise(exact))

    found = is_blocked(points, occupied)
    assert not found or not free(0.301)
    assert found or free(0.299)


def length_of(found):
    return int(found.count)


def legs(found):
    points = np.asarray(found.points, float)[: int(found.count)]
    return list(itertools.pairwise(points))


def nearest(occupied, a, b):
    """Distance from a leg to the nearest occupied square."""
    a, b = (tuple(Fraction(value) for value in point) for point in (a, b))
    return min((math.sqrt(keypoints_reference.squared_segment_to_square(a, b, int(row), int(column)))
                for row, column in np.argwhere(occupied)), default=math.inf)


ACROSS = task(squares=[(6.0, 6.5, 1.0)])
SQUARE_SENSED = jnp.array([True, False])


def test_first_route_is_the_plans_and_ends_at_the_goal_itself():
    world = task(goal=(3.4, 1.6))
    turns = [(0.5, 1.5), (0.5, 0.5), (3.5, 0.5)]
    centres = jnp.float32([*turns, *[(3.5, 1.5)] * (PLACES - 3)])
    memory = first(world, plan_by_hand(centres, jnp.int32(4), field_of(world.grid, subdivision=4)))
    np.testing.assert_array_equal(memory.route.points[:5], np.float32([*turns, (3.4, 1.6), (3.4, 1.6)]))
    assert (int(memory.route.count), int(memory.target), int(memory.replans)) == (4, 1, 0)


def test_nothing_new_on_the_route_changes_nothing():
    memory = begin(ACROSS)
    after = take_in(memory, (2.7, 6.4), ACROSS)
    assert int(after.replans) == 0
    for new, old in zip(jax.tree.leaves(after.route), jax.tree.leaves(memory.route), strict=True):
        np.testing.assert_array_equal(new, old)


def test_square_across_the_route_is_rounded():
    memory = begin(ACROSS)
    assert length_of(memory.route) == 2
    after = take_in(memory, (2.7, 6.4), ACROSS, known=SQUARE_SENSED)
    assert (int(after.replans), int(after.target)) == (1, 1)
    found = after.route
    np.testing.assert_allclose(found.points[0], (2.7, 6.4), rtol=1e-6)
    np.testing.assert_allclose(found.points[length_of(found) - 1], (10.5, 6.5), rtol=1e-6)
    grid = known_grid(ACROSS, after.seen, SQUARE_SENSED)
    assert np.argwhere(grid.occupied).tolist() == [[r, c] for r in (5, 6, 7) for c in (5, 6)]
    assert min(nearest(grid.occupied, a, b) for a, b in legs(found)) > 0.3
    assert not blocked(found, after.target, grid, CONSTANTS)
    # Its length along itself: 2.3 m to x = 5 and on from x = 7, and up or down past the square.
    lengths = [math.dist(a, b) for a, b in legs(found)]
    np.testing.assert_allclose(np.asarray(found.along)[: length_of(found)], [0, *np.cumsum(lengths)], atol=1e-4)
    # What is known once is not planned round again.
    assert int(take_in(after, (3.0, 6.0), ACROSS, known=SQUARE_SENSED).replans) == 1


def test_lost_robot_plans_anew_from_where_it_is():
    memory = begin(ACROSS)
    after = take_in(memory, (3.5, 2.5), ACROSS, lost=True)
    assert int(after.replans) == 1
    np.testing.assert_allclose(after.route.points[:2], [(3.5, 2.5), (10.5, 6.5)], rtol=1e-6)
    assert length_of(after.route) == 2


def test_new_route_goes_by_way_of_the_robots_cell_where_straight_on_is_not_free():
    # From the cell's centre, (2.5, 6.5), the way passes 0.5 m above the square [4, 5] × [5, 6]; from (2.9, 6.05) 0.1 m.
    one = ROOM.copy()
    one[5, 4] = True
    after = take_in(begin(task(one)), (2.9, 6.05), task(one), lost=True)
    assert length_of(after.route) == 3
    np.testing.assert_allclose(after.route.points[:3], [(2.9, 6.05), (2.5, 6.5), (10.5, 6.5)], rtol=1e-6)
    straight = take_in(begin(task(one)), (2.4, 6.6), task(one), lost=True)
    np.testing.assert_allclose(straight.route.points[:2], [(2.4, 6.6), (10.5, 6.5)], rtol=1e-6)


GAP = drawn(*["......#....."] * 6, "............", *["......#....."] * 5)


def test_without_a_way_round_the_old_route_stays():
    # A wall with one gap, and a square in it.
    world = task(GAP, (1.5, 1.5), (10.5, 6.5), squares=[(6.5, 6.5, 0.3)])
    memory = begin(world, (5.5, 6.5))
    after = take_in(memory, (4.0, 5.0), world, target=2, known=SQUARE_SENSED)
    assert (int(after.replans), int(after.target)) == (0, 2)
    for new, old in zip(jax.tree.leaves(after.route), jax.tree.leaves(memory.route), strict=True):
        np.testing.assert_array_equal(new, old)


def test_route_starts_in_the_nearest_free_cell_where_the_robots_own_is_taken():
    # The square overlaps the robot's cell, [2, 3] × [6, 7], without touching the robot at (2.1, 6.3).
    world = task(squares=[(2.8, 6.7, 0.3)])
    after = take_in(begin(world), (2.1, 6.3), world, known=SQUARE_SENSED)
    assert int(after.replans) == 1
    np.testing.assert_allclose(after.route.points[0], (2.1, 6.3), rtol=1e-6)
    occupied = np.asarray(known_grid(world, after.seen, SQUARE_SENSED).occupied)
    assert occupied[6, 2]
    assert all(nearest(occupied, a, b) > 0.3 for a, b in legs(after.route)[1:])
    np.testing.assert_allclose(after.route.points[length_of(after.route) - 1], (10.5, 6.5), rtol=1e-6)


def test_robot_on_a_taken_goal_cell_still_gets_a_route_to_the_goal():
    world = task(goal=(10.2, 6.2), squares=[(10.8, 6.8, 0.15)])
    after = take_in(begin(world), (5.0, 6.5), world, known=SQUARE_SENSED)
    np.testing.assert_allclose(after.route.points[length_of(after.route) - 1], (10.2, 6.2), rtol=1e-6)


def test_hidden_wall_is_rounded_once_it_is_seen():
    wall = np.zeros(SHAPE, bool)
    wall[2:9, 6] = True
    world = task(hidden=wall)
    memory = begin(world)
    far = take_in(memory, (2.5, 6.5), world)  # 3.5 m away, beyond the range of 2 m
    assert (int(far.replans), int(far.seen.sum())) == (0, 0)
    near = take_in(memory, (4.5, 6.5), world)  # 1.5 m away: √(2² − 1.5²) = 1.32 m up and down come into range
    np.testing.assert_array_equal(np.flatnonzero(near.seen[:, 6]), [5, 6, 7])
    assert int(near.replans) == 1
    assert min(nearest(np.asarray(near.seen), a, b) for a, b in legs(near.route)) > 0.3


def test_new_routes_keep_clear_on_random_maps():
    replanned = 0
    for seed in range(12):
        occupied = random_map(seed, SHAPE, 0.12)
        row, column = np.argwhere(~occupied)[np.random.default_rng(seed).integers((~occupied).sum())]
        world = task(occupied, (0.5, 0.5), (11.5, 11.5), squares=[(6.5, 5.5, 0.6), (5.5, 8.5, 0.3)])
        centre = (column + 0.5, row + 0.5)
        after = take_in(begin(world), centre, world, known=[True, True], lost=True)
        taken = np.asarray(known_grid(world, after.seen, jnp.array([True, True])).occupied)
        if int(after.replans) == 0 or taken[row, column] or taken[-1, -1]:
            continue
        replanned += 1
        assert all(nearest(taken, a, b) > 0.3 for a, b in legs(after.route))
        np.testing.assert_allclose(after.route.points[0], centre, rtol=1e-6)
    assert replanned > 5


def test_changing_constants_and_worlds_does_not_retrace():
    for world in (ACROSS, task(GAP, (1.5, 1.5), (10.5, 6.5), squares=[(6.5, 6.5, 0.3)])):
        take_in(begin(world), (4.0, 5.0), world)
    before = learned._cache_size()
    behaviour = replace(CONSTANTS.behaviour, sensor_range=3.0, route_margin=0.1, clearance_margin=0.3)
    take_in(begin(ACROSS), (2.0, 2.0), ACROSS, constants=replace(CONSTANTS, behaviour=behaviour))
    assert learned._cache_size() == before
