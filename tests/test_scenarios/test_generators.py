import dataclasses
import math
from collections import deque

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from adwa_jax.grid import Grid, inflate
from adwa_jax.obstacles import movers_at
from scenarios.errors import InputError
from scenarios.generators import barn, blocks, crowd, dynabarn, maze, on_map, paper, rooms, toy
from scenarios.generators.assembly import grid_of
from scenarios.generators.connectivity import carved, components, inflated
from scenarios.generators.draws import streams_of

KINDS = {
    "paper": (paper, paper.PaperSpec(cells=15)),
    "blocks": (blocks, blocks.BlocksSpec(cells=24)),
    "rooms": (rooms, rooms.RoomsSpec()),
    "maze": (maze, maze.MazeSpec()),
    "barn": (barn, barn.BarnSpec()),
    "crowd": (crowd, crowd.CrowdSpec()),
}
WITH_SQUARES = ("paper", "blocks", "rooms", "maze")
PATROLLED = ("blocks", "rooms", "maze")
SEEDS = st.integers(0, 2**32 - 1)

kernel_inflate = jax.jit(inflate)
kernel_movers_at = jax.jit(movers_at)


def flood(free, start):
    """The cells 4-connected to start, cell by cell."""
    reached, queue = {start}, deque([start])
    while queue:
        row, column = queue.popleft()
        for cell in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
            inside = 0 <= cell[0] < free.shape[0] and 0 <= cell[1] < free.shape[1]
            if inside and free[cell] and cell not in reached:
                reached.add(cell)
                queue.append(cell)
    return reached


def cell_at(scenario, point):
    resolution, origin = float(scenario.grid.resolution), scenario.grid.origin
    column, row = ((float(value) - float(corner)) / resolution for value, corner in zip(point, origin, strict=True))
    return math.floor(row + 1e-6), math.floor(column + 1e-6)


def solvable(scenario, radius, occupied=None):
    """Whether start and goal are connected on the map as `adwa_jax` inflates it."""
    grid = scenario.grid if occupied is None else dataclasses.replace(scenario.grid, occupied=occupied)
    blocked = np.asarray(kernel_inflate(grid, jnp.float32(radius)))
    start, goal = cell_at(scenario, scenario.start[:2]), cell_at(scenario, scenario.goal)
    return not blocked[start] and not blocked[goal] and goal in flood(~blocked, start)


def with_squares(scenario):
    """The known map with every cell that an unknown square overlaps taken as occupied."""
    occupied = scenario.grid.occupied.copy()
    resolution = float(scenario.grid.resolution)
    rows, columns = np.indices(occupied.shape)
    for centre, half in zip(scenario.squares.centre, scenario.squares.half_width, strict=True):
        x, y = (centre - scenario.grid.origin) / resolution
        reach = half / resolution + 0.5 - 1e-4
        occupied |= (np.abs(columns + 0.5 - x) < reach) & (np.abs(rows + 0.5 - y) < reach)
    return occupied


def same_bits(one, other):
    leaves = zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True)
    return all(a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes() for a, b in leaves)


def scenarios_of(kind, count=8, **changes):
    module, spec = KINDS[kind]
    spec = dataclasses.replace(spec, **changes)
    return [module.generate(jax.random.key(seed), spec) for seed in range(count)]


# Connectivity


@pytest.mark.parametrize(
    ("resolution", "radius"),
    [(1.0, 0.25), (1.0, 0.5), (0.15, 0.3), (0.15, 0.35), (0.1, 0.25), (0.1, 0.05), (0.05, 0.3), (0.05, 0.0)],
)
def test_inflation_equals_the_kernel_ties_included(resolution, radius):
    for seed in range(4):
        occupied = np.random.default_rng(seed).random((20, 24)) < 0.04
        kernel = kernel_inflate(grid_of(occupied, resolution), jnp.float32(radius))
        np.testing.assert_array_equal(inflated(occupied, resolution, radius), np.asarray(kernel))


@settings(max_examples=40, deadline=None)
@given(rows=st.integers(1, 12), columns=st.integers(1, 12), share=st.floats(0.0, 1.0), seed=SEEDS)
def test_components_are_those_of_a_flood_fill(rows, columns, share, seed):
    free = np.random.default_rng(seed).random((rows, columns)) >= share
    label = components(free)
    assert (label[~free] == -1).all()
    for cell in map(tuple, np.argwhere(free)):
        assert set(map(tuple, np.argwhere(label == label[cell]))) == flood(free, cell)


@settings(max_examples=20, deadline=None)
@given(seed=SEEDS, flipped=st.booleans())
def test_a_carved_corridor_fits_the_robot(seed, flipped):
    occupied = np.ones((16, 24), np.bool_)
    a, b = ((12, 3), (3, 20)) if flipped else ((3, 3), (12, 20))
    free = ~inflated(carved(streams_of(jax.random.key(seed)).map, occupied, a, b, 0.15, 0.3), 0.15, 0.3)
    assert b in flood(free, a)


# What every generator promises


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=25, deadline=None)
@given(seed=SEEDS)
def test_every_known_map_is_solvable(kind, seed):
    module, spec = KINDS[kind]
    assert solvable(module.generate(jax.random.key(seed), spec), spec.robot_radius)


@settings(max_examples=25, deadline=None)
@given(density=st.floats(0.0, 0.9), seed=SEEDS)
@example(density=0.9, seed=0)
def test_paper_maps_are_solvable_at_every_density(density, seed):
    spec = paper.PaperSpec(cells=15, density=density, robot_radius=0.49)
    scenario = paper.generate(jax.random.key(seed), spec)
    assert solvable(scenario, spec.robot_radius)
    assert solvable(scenario, spec.robot_radius, with_squares(scenario))


@settings(max_examples=25, deadline=None)
@given(density=st.floats(0.0, 0.9), radius=st.sampled_from([0.25, 0.5, 0.75]), seed=SEEDS)
@example(density=0.9, radius=0.75, seed=0)
def test_block_maps_are_solvable_at_every_density_and_radius(density, radius, seed):
    spec = blocks.BlocksSpec(cells=24, resolution=0.5, density=density, robot_radius=radius)
    scenario = blocks.generate(jax.random.key(seed), spec)
    assert solvable(scenario, radius)
    assert solvable(scenario, radius, with_squares(scenario))


@settings(max_examples=15, deadline=None)
@given(fill=st.floats(0.0, 0.9), smoothings=st.integers(0, 5), seed=SEEDS)
@example(fill=0.9, smoothings=4, seed=0)
def test_barn_worlds_are_solvable_at_every_fill(fill, smoothings, seed):
    spec = barn.BarnSpec(fill=(fill,), smoothings=(smoothings,))
    assert solvable(barn.generate(jax.random.key(seed), spec), spec.robot_radius)


@pytest.mark.parametrize("kind", KINDS)
def test_the_key_decides_every_bit(kind):
    module, spec = KINDS[kind]
    one, again = (module.generate(jax.random.key(7), spec) for _ in range(2))
    other = module.generate(jax.random.key(8), spec)
    assert same_bits(one, again)
    assert not all(np.array_equal(a, b) for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True))


@pytest.mark.parametrize("kind", [*KINDS, "toy"])
def test_leaves_are_numpy_of_the_documented_types(kind):
    module, spec = {**KINDS, "toy": (toy, toy.ToySpec())}[kind]
    scenario = module.generate(jax.random.key(0), spec)
    assert all(isinstance(leaf, np.ndarray) for leaf in jax.tree.leaves(scenario))
    squares, movers, points = len(scenario.squares.valid), len(scenario.movers.valid), scenario.movers.track.shape[1]
    rows, columns = scenario.grid.occupied.shape
    f, i, b = np.float32, np.int32, np.bool_
    expected = [
        (b, (rows, columns)), (i, ()), (i, ()), (f, ()), (f, (2,)),
        (b, (0, 0)), (f, (3,)), (b, ()), (f, (2,)), (f, ()), (f, ()), (f, ()),
        (f, (squares, 2)), (f, (squares,)), (f, (squares,)), (b, (squares,)),
        (f, (movers,)), (f, (movers, 2)), (f, (movers, 2)), (f, (movers, 2)), (f, (movers, 2)),
        (f, (movers, points, 3)), (i, (movers,)), (f, (movers,)), (b, (movers,)),
    ]  # fmt: skip
    assert [(leaf.dtype, leaf.shape) for leaf in jax.tree.leaves(scenario)] == expected
    assert (int(scenario.grid.height), int(scenario.grid.width)) == (rows, columns)
    assert scenario.squares.valid.all()
    assert scenario.movers.valid.all()


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "barn"])
def test_the_number_of_movers_leaves_map_task_and_squares_alone(kind):
    for some, none in zip(scenarios_of(kind), scenarios_of(kind, movers=0), strict=True):
        assert len(some.movers.valid) > 0
        assert len(none.movers.valid) == 0
        assert same_bits(dataclasses.replace(some, movers=none.movers), none)


@pytest.mark.parametrize("kind", WITH_SQUARES)
def test_unknown_squares_leave_the_map_solvable_and_the_ends_free(kind):
    spec = KINDS[kind][1]
    for scenario in scenarios_of(kind, count=20):
        assert len(scenario.squares.valid) == 5
        assert len(np.unique(scenario.squares.centre, axis=0)) == 5
        assert solvable(scenario, spec.robot_radius, with_squares(scenario))
        for centre in scenario.squares.centre:
            assert not scenario.grid.occupied[cell_at(scenario, centre)]
            assert np.abs(centre - scenario.start[:2]).max() > spec.square_distance
            assert np.abs(centre - scenario.goal).max() > spec.square_distance


def test_a_map_without_room_gets_fewer_squares_and_movers():
    scenario = paper.generate(jax.random.key(0), paper.PaperSpec(cells=8, density=0.9, squares=40, movers=3))
    assert len(scenario.squares.valid) < 40
    assert solvable(scenario, 0.25, with_squares(scenario))


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "barn"])
def test_movers_start_clear_of_the_robot_and_stay_on_the_map(kind):
    spec = KINDS[kind][1]
    for scenario in scenarios_of(kind):
        movers, grid = scenario.movers, scenario.grid
        assert len(movers.valid) == spec.mover_count
        assert ((movers.radius >= spec.mover_radius[0]) & (movers.radius <= spec.mover_radius[1])).all()
        size = np.array(grid.occupied.shape[::-1]) * grid.resolution
        for time in (0.0, 1.7, 13.0, 59.9):
            states = kernel_movers_at(movers, jnp.float32(time))
            position, speed = np.asarray(states.position), np.linalg.norm(np.asarray(states.velocity), axis=1)
            radius = movers.radius[:, None]
            assert np.asarray(states.present).all()
            assert ((position >= radius - 1e-4) & (position <= size - radius + 1e-4)).all()
            assert ((speed > spec.mover_speed[0] - 1e-4) & (speed < spec.mover_speed[1] + 1e-4)).all()
            if time == 0.0:
                assert (np.linalg.norm(position - scenario.start[:2], axis=1) > spec.mover_distance).all()


@pytest.mark.parametrize("kind", PATROLLED)
def test_patrols_never_touch_the_known_map(kind):
    for scenario in scenarios_of(kind):
        low, high = np.argwhere(scenario.grid.occupied)[:, ::-1], np.argwhere(scenario.grid.occupied)[:, ::-1] + 1
        for time in np.linspace(0.0, 60.0, 25):
            for position, radius in zip(np.asarray(kernel_movers_at(scenario.movers, jnp.float32(time)).position),
                                        scenario.movers.radius, strict=True):
                gap = np.maximum(0.0, np.maximum(low - position, position - high))
                assert np.linalg.norm(gap, axis=1).min() > radius


# Each generator's own shape


@pytest.mark.parametrize(("cells", "movers"), [(15, 3), (20, 5), (25, 8)])
def test_paper_runs_from_the_upper_left_to_the_lower_right_corner(cells, movers):
    scenario = paper.generate(jax.random.key(3), paper.PaperSpec(cells=cells))
    np.testing.assert_allclose(scenario.start, [0.5, cells - 0.5, -math.pi / 4], rtol=1e-6)
    np.testing.assert_array_equal(scenario.goal, [cells - 0.5, 0.5])
    assert not scenario.heading_given
    assert scenario.grid.occupied.shape == (cells, cells)
    assert len(scenario.movers.valid) == movers
    assert float(scenario.time_limit) == 100.0


def test_paper_density_is_the_share_of_occupied_cells():
    share = np.mean([scenario.grid.occupied.mean() for scenario in scenarios_of("paper", count=100, density=0.2)])
    assert abs(share - 0.2) < 0.01  # 100 · 225 cells: standard deviation 0.0027, less what solvability takes


def test_blocks_fill_the_map_up_to_the_density():
    for density in (0.0, 0.1, 0.35):
        for scenario in scenarios_of("blocks", density=density):
            assert density <= scenario.grid.occupied.mean() < density + 16 / 24**2  # at most the last block over


@pytest.mark.parametrize("kind", PATROLLED)
def test_start_and_goal_are_a_third_of_the_diagonal_apart(kind):
    for scenario in scenarios_of(kind, count=20):
        diagonal = math.hypot(*scenario.grid.occupied.shape)
        assert math.dist(scenario.start[:2], scenario.goal) >= diagonal / 3 - 1e-4


def test_a_perfect_maze_has_one_opening_less_than_places():
    for scenario in scenarios_of("maze", junctions=6, corridor_cells=3, extra_openings=0.0):
        assert scenario.grid.occupied.shape == (23, 23)
        assert (~scenario.grid.occupied).sum() == 36 * 9 + 35 * 3


def test_rooms_with_all_extra_doors_have_a_door_in_every_wall():
    for scenario in scenarios_of("rooms", rooms=3, room_cells=5, door_cells=2, extra_doors=1.0):
        assert scenario.grid.occupied.shape == (17, 17)
        assert (~scenario.grid.occupied).sum() == 9 * 25 + 12 * 2


def test_barn_with_an_empty_field_is_the_walled_corridor():
    scenario = barn.generate(jax.random.key(0), barn.BarnSpec(fill=(0.0,), smoothings=(3,)))
    expected = np.zeros((96, 30), np.bool_)
    expected[0] = expected[:, 0] = expected[:, -1] = True
    np.testing.assert_array_equal(scenario.grid.occupied, expected)
    np.testing.assert_allclose(scenario.start, [-2.25, 3.0, math.pi / 2], rtol=1e-6)
    np.testing.assert_array_equal(scenario.goal, [-2.25, 13.0])
    np.testing.assert_array_equal(scenario.grid.origin, [-4.5, 0.0])
    assert scenario.heading_given
    assert (float(scenario.goal_tolerance), float(scenario.time_limit)) == (1.0, 100.0)
    assert len(scenario.squares.valid) == len(scenario.movers.valid) == 0


@pytest.mark.parametrize("smoothings", [1, 2, 4])
def test_barn_smooths_as_its_automaton_says(smoothings):
    def filled_neighbours(field, row, column):
        count = 0
        for r in range(row - 1, row + 2):
            for c in range(column - 1, column + 2):
                if c < 0 or c > 29:
                    count += 1
                elif 0 <= r <= 29 and (r, c) != (row, column):
                    count += field[r][c]
        return count

    def smoothed(field):
        def cell(row, column):
            count = filled_neighbours(field, row, column)
            return True if count > 4 else False if count < 2 else field[row][column]

        return [[cell(row, column) for column in range(30)] for row in range(30)]

    def field_after(count):
        spec = barn.BarnSpec(fill=(0.2,), smoothings=(count,), robot_radius=0.0)  # so that the first field is taken
        return barn.generate(jax.random.key(5), spec).grid.occupied[34:64].tolist()

    field = field_after(0)
    for _ in range(smoothings):
        field = smoothed(field)
    assert field == field_after(smoothings)


@pytest.mark.realdata
def test_barn_fields_are_about_as_dense_as_the_benchmarks(data_folder):
    real = np.load(data_folder / "barn" / "grids.npz")["field"].mean(axis=(1, 2))
    ours = np.array([scenario.grid.occupied[34:64].mean() for scenario in scenarios_of("barn", count=150)])
    np.testing.assert_allclose(np.quantile(ours, [0.25, 0.5, 0.75]), np.quantile(real, [0.25, 0.5, 0.75]), atol=0.05)


def test_crowd_walks_are_closed_steady_and_on_opposite_sides():
    spec = KINDS["crowd"][1]
    for scenario in scenarios_of("crowd"):
        movers = scenario.movers
        assert not scenario.grid.occupied.any()
        np.testing.assert_array_equal(movers.track[:, 0, 1:], movers.track[:, -1, 1:])
        np.testing.assert_array_equal(movers.period, movers.track[:, -1, 0])
        np.testing.assert_array_equal(movers.track_length, spec.legs + 1)
        steps = np.diff(movers.track, axis=1)
        assert (np.linalg.norm(steps[:, :, 1:], axis=2) >= spec.side - 2 * spec.mover_radius[1] - 1e-4).all()
        speed = np.linalg.norm(steps[:, :, 1:], axis=2) / steps[:, :, 0]
        np.testing.assert_allclose(speed, np.broadcast_to(speed[:, :1], speed.shape), rtol=1e-4)


TRACKS = [
    np.array([[0.0, 0.0, 0.0], [10.0, 10.0, 0.0]]),  # along the lower side
    np.array([[2.0, 0.0, 10.0], [4.0, 4.0, 10.0], [8.0, 4.0, 6.0]]),
]


def test_a_recording_shorter_than_the_limit_is_replayed_whole():
    scenario = crowd.from_tracks(jax.random.key(0), crowd.CrowdSpec(resolution=0.5, mover_distance=0.0), TRACKS)
    movers = scenario.movers
    np.testing.assert_array_equal(movers.track_length, [2, 3])
    np.testing.assert_array_equal(movers.track[0], [[0, 0, 0], [10, 10, 0], [10, 10, 0]])
    np.testing.assert_array_equal(movers.track[1], TRACKS[1])
    np.testing.assert_array_equal(movers.period, 0.0)
    np.testing.assert_array_equal(scenario.grid.origin, [-1.0, -1.0])
    assert scenario.grid.occupied.shape == (24, 24)  # 10 m and a margin of 1 m on each side, cells of 0.5 m


def test_a_stretch_of_a_recording_is_cut_at_its_ends():
    spec = crowd.CrowdSpec(time_limit=3.0, mover_distance=0.0)
    for seed in range(10):
        movers = crowd.from_tracks(jax.random.key(seed), spec, TRACKS).movers
        first = movers.track[0, : movers.track_length[0]]
        begin = first[0, 1]  # the first person is at x = t
        np.testing.assert_allclose(first[[0, -1]], [[0, begin, 0], [3, begin + 3, 0]], atol=1e-5)
        assert 0.0 <= begin <= 7.0
        for track, length in zip(movers.track, movers.track_length, strict=True):
            assert (np.diff(track[:length, 0]) > 0).all()
            assert 0.0 <= track[0, 0] < track[length - 1, 0] <= 3.0


def test_recorded_people_at_the_robots_start_are_left_out():
    everywhere = [np.array([[0.0, x, y], [50.0, x, y]]) for x in np.arange(0, 10.1) for y in np.arange(0, 10.1)]
    scenario = crowd.from_tracks(jax.random.key(0), crowd.CrowdSpec(), everywhere)
    gaps = np.linalg.norm(scenario.movers.track[:, 0, 1:] - scenario.start[:2], axis=1)
    assert 0 < len(gaps) < len(everywhere)
    assert (gaps > 2.0).all()


@pytest.mark.parametrize(
    ("tracks", "found"),
    [
        ([], "none given"),
        ([np.zeros((1, 3))], "shape (1, 3)"),
        ([TRACKS[0], TRACKS[0][::-1]], "tracks[1]: times"),
        ([TRACKS[0] * np.nan], "tracks[0]: times"),
    ],
)
def test_tracks_that_are_none_are_refused(tracks, found):
    with pytest.raises(InputError) as refusal:
        crowd.from_tracks(jax.random.key(0), crowd.CrowdSpec(), tracks)
    assert found in str(refusal.value)


@pytest.mark.realdata
def test_real_pedestrians_make_a_crowd(data_folder):
    from scenarios.formats.tracks import load_tracks

    tracks = load_tracks(data_folder / "pedestrians" / "ucy" / "crowds_zara01.txt")
    spec = crowd.CrowdSpec()
    for seed in range(3):
        scenario = crowd.from_tracks(jax.random.key(seed), spec, tracks)
        assert len(scenario.movers.valid) > 5
        assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(scenario))
        assert solvable(scenario, spec.robot_radius)
        states = kernel_movers_at(scenario.movers, jnp.float32(0.0))
        here = np.asarray(states.position)[np.asarray(states.present)]
        assert (np.linalg.norm(here - scenario.start[:2], axis=1) > spec.mover_distance).all()


# Recorded key frames

SHUTTLE = np.array([[0.0, -10.0, 0.0], [4.0, 0.0, 0.0], [10.0, 0.0, 8.0]])
"""2.5 m/s, then 4/3 m/s, then at once back."""
AT_START = np.array([[0.0, 10.0, 0.0], [4.0, 10.0, 0.0], [5.0, 10.0, -9.0], [20.0, 10.0, -9.0]])


def expected_on(track, time):
    now = time % track[-1, 0]
    return [np.interp(now, track[:, 0], track[:, axis]) for axis in (1, 2)]


def test_a_track_is_cut_where_the_episode_begins():
    jump = dynabarn.JUMP
    expected = [[0, -5, 0], [2, 0, 0], [8, 0, 8], [8 + jump, -10 + 2.5 * jump, 0], [10, -5, 0]]
    np.testing.assert_allclose(dynabarn.shifted(SHUTTLE, 2.0), expected, rtol=1e-12)
    np.testing.assert_allclose(dynabarn.shifted(SHUTTLE, 42.0), expected, rtol=1e-12)
    np.testing.assert_array_equal(dynabarn.shifted(SHUTTLE, 30.0), SHUTTLE)
    on_a_frame = [[0, 0, 0], [6, 0, 8], [6 + jump, -10 + 2.5 * jump, 0], [10, 0, 0]]
    np.testing.assert_allclose(dynabarn.shifted(SHUTTLE, 4.0), on_a_frame, rtol=1e-12)


@pytest.mark.parametrize("offset", [0.0, 0.005, 3.995, 4.005, 9.995, 123.455])
def test_movers_are_where_the_world_has_them_at_that_time_and_never_seen_on_the_way_back(offset):
    tracks = [SHUTTLE, AT_START]
    scenario = dynabarn.beginning_at(offset, dynabarn.DynabarnSpec(), tracks)
    for step in range(600):
        state = kernel_movers_at(scenario.movers, jnp.float32(step * 0.1))
        assert state.present.all()
        expected = [expected_on(track, offset + step * 0.1) for track in tracks]
        if offset:  # at 0 the jumps fall on control steps, where either end will do
            np.testing.assert_allclose(state.position, expected, atol=1e-4)
        assert np.linalg.norm(state.velocity, axis=1).max() <= 9.001


def test_the_task_is_the_benchmarks():
    scenario = dynabarn.beginning_at(0.0, dynabarn.DynabarnSpec(), [SHUTTLE])
    np.testing.assert_array_equal(scenario.start, np.float32([11.0, 0.0, math.pi]))
    assert scenario.heading_given
    np.testing.assert_array_equal(scenario.goal, [-9.0, 0.0])
    assert (scenario.goal_tolerance, scenario.time_limit, scenario.reference_length) == (1.0, 60.0, 0.0)
    np.testing.assert_array_equal(scenario.grid.origin, [-10.0, -10.0])
    assert scenario.grid.occupied.shape == (40, 46)
    assert not scenario.grid.occupied.any()
    np.testing.assert_array_equal(scenario.movers.period, [10.0])
    np.testing.assert_array_equal(scenario.movers.radius, [0.5])


def test_no_episode_begins_with_a_mover_at_the_start_if_that_can_be():
    spec = dynabarn.DynabarnSpec()
    for seed in range(20):
        scenario = dynabarn.generate(jax.random.key(seed), spec, [AT_START])
        assert math.dist(scenario.movers.position[0], scenario.start[:2]) > spec.mover_distance
    always_there = AT_START * (1.0, 1.0, 0.0)
    assert dynabarn.generate(jax.random.key(0), spec, [always_there]).movers.valid.all()


def test_times_differ_and_come_from_the_key():
    first, again, other = (dynabarn.generate(jax.random.key(seed), dynabarn.DynabarnSpec(), [SHUTTLE])
                           for seed in (0, 0, 1))
    assert same_bits(first, again)
    assert not same_bits(first, other)


def test_dynabarn_takes_no_other_obstacles():
    with pytest.raises(InputError, match="squares, movers: \\(0, 3\\); movers are those of the world"):
        dynabarn.DynabarnSpec(movers=3)


# Unknown discs


def test_discs_take_the_place_of_the_squares():
    squares, discs = (paper.generate(jax.random.key(3), paper.PaperSpec(cells=15, unknown_shape=shape))
                      for shape in ("square", "disc"))
    np.testing.assert_array_equal(discs.squares.centre, squares.squares.centre)
    np.testing.assert_array_equal(squares.squares.half_width, np.full(5, 0.3, np.float32))
    np.testing.assert_array_equal(discs.squares.rounding, np.full(5, 0.3, np.float32))
    assert not discs.squares.half_width.any()
    assert not squares.squares.rounding.any()
    assert same_bits(dataclasses.replace(discs, squares=squares.squares), squares)


def test_another_shape_of_unknown_obstacle_is_refused():
    with pytest.raises(InputError, match="unknown_shape: 'star'; must be square or disc; choose one"):
        paper.PaperSpec(unknown_shape="star")


def test_a_toy_is_as_drawn():
    scenario = toy.generate(jax.random.key(0), toy.ToySpec(drawing="S.#\n.o>\n..G", resolution=2.0))
    np.testing.assert_array_equal(scenario.grid.occupied, [[0, 0, 0], [0, 0, 0], [0, 0, 1]])
    np.testing.assert_array_equal(scenario.start[:2], [1.0, 5.0])
    np.testing.assert_array_equal(scenario.goal, [5.0, 1.0])
    np.testing.assert_array_equal(scenario.squares.centre, [[3.0, 3.0]])
    np.testing.assert_array_equal(scenario.movers.position, [[5.0, 3.0]])
    np.testing.assert_array_equal(scenario.movers.velocity, [[0.5, 0.0]])
    np.testing.assert_allclose(scenario.movers.high, [[5.7, 5.7]])


# On a user's own map


def two_rooms():
    """A wall with no door; the right room is the larger one."""
    occupied = np.zeros((20, 40), np.bool_)
    occupied[:, 12] = True
    return grid_of(occupied, 0.25, (-2.0, 3.0))


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS)
def test_tasks_on_a_map_lie_far_apart_in_its_largest_part(seed):
    ground = on_map.prepare(two_rooms(), 0.3)
    spec = on_map.spec_for(ground, squares=3, movers=2, robot_radius=0.3)
    scenario = on_map.generate(jax.random.key(seed), spec, ground)
    assert scenario.grid is ground.grid
    assert solvable(scenario, 0.3)
    assert solvable(scenario, 0.3, with_squares(scenario))
    assert math.dist(scenario.start[:2], scenario.goal) >= math.hypot(5.0, 10.0) / 3 - 1e-4
    assert min(scenario.start[0], scenario.goal[0]) > -2.0 + 13 * 0.25


def test_movers_find_a_place_in_a_small_room_on_a_large_map():
    occupied = np.ones((150, 150), np.bool_)
    occupied[60:90, 60:90] = False  # 6 m a side
    ground = on_map.prepare(grid_of(occupied, 0.2), 0.2)
    spec = on_map.spec_for(ground, squares=0, movers=3, robot_radius=0.2)
    for seed in range(5):
        assert on_map.generate(jax.random.key(seed), spec, ground).movers.valid.sum() == 3


def test_a_map_too_small_for_a_third_of_its_diagonal_takes_the_farthest_goal():
    occupied = np.ones((30, 30), np.bool_)
    occupied[5, 5:8] = False
    ground = on_map.prepare(grid_of(occupied, 1.0), 0.25)
    spec = on_map.spec_for(ground, squares=0, movers=0, robot_radius=0.25)
    ends = set()
    for seed in range(30):
        scenario = on_map.generate(jax.random.key(seed), spec, ground)
        ends.add((float(scenario.start[0]), float(scenario.goal[0])))
    assert ends == {(5.5, 7.5), (7.5, 5.5), (6.5, 5.5)}  # from the middle both ends are as far; the first is taken


@pytest.mark.parametrize("free_cells", [0, 1])
def test_a_map_without_two_connected_cells_is_refused(free_cells):
    occupied = np.ones((6, 6), np.bool_)
    occupied[2, 2 : 2 + free_cells] = False
    with pytest.raises(InputError, match=r"cellar: no two connected cells for robot_radius 0\.25 m; .*; take"):
        on_map.prepare(grid_of(occupied, 1.0), 0.25, "cellar")


def test_jax_leaves_serve_as_a_map_too():
    grid = two_rooms()
    on_device = Grid(*(jnp.asarray(leaf) for leaf in jax.tree.leaves(grid)))
    assert same_bits(on_map.prepare(on_device, 0.3).grid, grid)


# Specs


@pytest.mark.parametrize(
    ("make", "found"),
    [
        (lambda: paper.PaperSpec(cells=7), "cells: 7; must be a whole number from 8 to 4096; try 8"),
        (lambda: paper.PaperSpec(cells=15.0), "cells: 15.0; must be a whole number"),  # pyright: ignore
        (lambda: paper.PaperSpec(density=math.nan), "density: nan; must be a finite number from 0 to 0.9; try 0"),
        (lambda: paper.PaperSpec(density=0.95), "try 0.9"),
        (lambda: paper.PaperSpec(robot_radius=0.5), "robot_radius: 0.5; the robot must fit into a cell"),
        (lambda: paper.PaperSpec(movers=-1), "movers: -1"),
        (lambda: paper.PaperSpec(mover_speed=(1.0, 0.5)), "mover_speed: (1.0, 0.5); must be (least, greatest)"),
        (lambda: paper.PaperSpec(mover_radius=(0.2, 7.0)), "at most half as wide as the map"),
        (lambda: paper.PaperSpec(time_limit=math.inf), "time_limit: inf"),
        (lambda: blocks.BlocksSpec(longest_side=0), "longest_side: 0"),
        (lambda: blocks.BlocksSpec(cells=8, robot_radius=3.0), "between the borders"),
        (lambda: rooms.RoomsSpec(door_cells=8), "door_cells: 8; must be a whole number from 1 to 7"),
        (lambda: rooms.RoomsSpec(resolution=0.5), "its middle cell must be farther than robot_radius 0.25 m"),
        (lambda: maze.MazeSpec(junctions=1), "junctions: 1"),
        (lambda: maze.MazeSpec(extra_openings=1.1), "extra_openings: 1.1"),
        (lambda: barn.BarnSpec(fill=()), "fill: (); needs at least one share"),
        (lambda: barn.BarnSpec(smoothings=(-1,)), "smoothings: -1"),
        (lambda: barn.BarnSpec(movers=2), "BARN worlds have neither"),
        (lambda: crowd.CrowdSpec(legs=5), "legs: 5; must be even"),
        (lambda: crowd.CrowdSpec(side=16.2), "must be a whole number of cells"),
        (lambda: crowd.CrowdSpec(inset=0.2), "inset: 0.2"),
        (lambda: toy.ToySpec(drawing="S.G\n.."), "its lines must be equally long"),
        (lambda: toy.ToySpec(drawing="S.GG"), "needs exactly one G"),
        (lambda: toy.ToySpec(drawing="S?G"), "drawing: '?'; knows only"),
        (lambda: toy.ToySpec(drawing=""), "drawing: ''"),
    ],
)
def test_nonsense_specs_are_refused_in_one_line(make, found):
    with pytest.raises(ValueError, match=r"; .*; ") as refusal:
        make()
    assert found in str(refusal.value)
    assert "\n" not in str(refusal.value)
