"""The composed global plan against the oracles in the same order."""

import math
from dataclasses import replace
from fractions import Fraction
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from adwa_jax.astar import SearchOptions, Status
from adwa_jax.constants import PlanOptions
from adwa_jax.heuristic_weight import WeightRule
from adwa_jax.plan import plan
from adwa_jax.presets import paper
from tests.reference import astar as astar_reference
from tests.reference import density as density_reference
from tests.reference import distance as distance_reference
from tests.reference import keypoints as keypoints_reference
from tests.reference import metrics as metrics_reference
from tests.test_adwa_jax.worlds import counting, drawn, grid_of, random_map

RULE = {"dense_base": 0.25, "dense_gain": 0.5, "sparse_base": 1.25, "sparse_gain": 0.5}
CONSTANTS = replace(
    paper().constants,
    weight_rule=WeightRule(**RULE),
    robot=replace(paper().constants.robot, radius=0.25),
    behaviour=replace(paper().constants.behaviour, clearance_margin=0.25),
)
NODE = PlanOptions(subdivision=2)
TRADITIONAL = PlanOptions(SearchOptions(corner_rule="always", stop_rule="generated"), scope="one", inflate=False,
                          subdivision=2)
planned, traces = counting(plan, static_argnames="options")


def with_radius(radius):
    return replace(CONSTANTS, robot=replace(CONSTANTS.robot, radius=radius))


def run(occupied, start, goal, constants=CONSTANTS, options=NODE, **frame):
    return planned(grid_of(occupied, **frame), jnp.float32(start), jnp.float32(goal), constants, options)


def key_cells(found):
    return [(int(y), int(x)) for x, y in np.asarray(found.key_points)[: int(found.key_point_count)]]


def test_way_round_a_wall_by_hand():
    occupied = drawn("....", ".##.", "....")
    found = run(occupied, (0.5, 1.5), (3.5, 1.5))
    assert int(found.search.status) == Status.FOUND
    assert float(found.length) == 5.0
    assert key_cells(found) == [(1, 0), (0, 0), (0, 3), (1, 3)]
    assert float(found.key_point_length) == 5.0
    assert tuple(int(count) for count in found.measures) == (2, 0, 2, 0)
    cut = run(occupied, (0.5, 1.5), (3.5, 1.5), options=TRADITIONAL)
    assert float(cut.length) == pytest.approx(1 + 2 * math.sqrt(2))
    assert float(cut.optimal_length) == 5.0  # the shortest without cutting corners
    assert int(cut.measures.danger_points) == 2


def test_lengths_and_key_points_are_in_metres():
    occupied = drawn("....", ".##.", "....")
    found = run(occupied, (-2.9, 10.6), (-1.4, 10.85), with_radius(0.1), resolution=0.5, origin=(-3.0, 10.0))
    np.testing.assert_allclose(found.key_points[:4], [(-2.75, 10.75), (-2.75, 10.25), (-1.25, 10.25), (-1.25, 10.75)])
    assert float(found.length) == float(found.key_point_length) == 2.5
    assert float(found.field.spacing) == 0.25


@pytest.mark.parametrize(("start", "goal", "radius", "status"), [
    ((0.5, 0.5), (3.5, 0.5), 0.25, Status.FOUND),
    ((0.5, 0.5), (3.5, 0.5), 0.5, Status.BAD_START),  # the border is exactly the radius away: not moved, reported
    ((1.5, 1.5), (3.5, 0.5), 0.25, Status.BAD_START),
    ((0.5, 0.5), (1.5, 1.5), 0.25, Status.BAD_GOAL),
    ((-0.1, 0.5), (3.5, 0.5), 0.25, Status.BAD_START),
    ((0.5, 0.5), (3.5, 3.01), 0.25, Status.BAD_GOAL),
    ((0.5, 0.5), (4.5, 0.5), 0.25, Status.UNREACHABLE),
])
def test_statuses(start, goal, radius, status):
    found = run(drawn("....#.", ".##.##", "....##"), *[(x if x < 4 else 5.5, y) for x, y in (start, goal)],
                with_radius(radius))
    assert Status(int(found.search.status)) is status
    if status is not Status.FOUND:
        assert float(found.length) == float(found.key_point_length) == int(found.key_point_count) == 0
        assert all(int(count) == 0 for count in found.measures)
        assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(found))


def oracle(occupied, start, goal, radius, margin, node_weights):
    """Search answer and key points by the oracles in a row."""
    blocked = distance_reference.inflate(occupied, radius)
    weight = partial(density_reference.weight_1024, occupied, goal=goal, **RULE) if node_weights else None
    answer = astar_reference.search(blocked, start, goal, weight)
    kept = keypoints_reference.key_points(occupied, list(answer.path), margin) if answer.path else []
    return answer, kept


def test_plans_equal_the_oracles_in_a_row():
    found_some = 0
    for seed in range(24):
        occupied = random_map(seed, (12, 10), (0.1, 0.2, 0.3)[seed % 3])
        answer, kept = oracle(occupied, (0, 0), (11, 9), Fraction(1, 4), Fraction(1, 4), node_weights=True)
        found = run(occupied, (0.5, 0.5), (9.5, 11.5))
        assert Status(int(found.search.status)).name == answer.status
        assert int(found.search.expansions) == answer.expansions
        path = [tuple(pair) for pair in np.asarray(found.search.path)[: int(found.search.path_cells)].tolist()]
        assert path == list(answer.path)
        assert key_cells(found) == kept
        if not path:
            continue
        found_some += 1
        optimum = astar_reference.cheapest_cost(occupied, (0, 0), (11, 9))
        assert float(found.optimal_length) == pytest.approx(optimum / astar_reference.ONE, rel=1e-6)
        assert float(found.length) == pytest.approx(answer.cost / astar_reference.ONE, rel=1e-6)
        centres = [keypoints_reference.centre(key) for key in kept]
        assert float(found.key_point_length) == pytest.approx(metrics_reference.length(centres), rel=1e-6)
        assert tuple(int(count) for count in found.measures) == (
            metrics_reference.planned_breaking_points(path), 0, len(kept) - 2, 0)
    assert found_some > 8


def test_wider_robot_keeps_its_radius_from_obstacles():
    # Radius 0.75 m on 0.5 m cells: the inflation is 1.5 cells.
    occupied = np.zeros((12, 12), bool)
    occupied[5, 5] = True
    found = run(occupied, (1.25, 1.25), (4.75, 4.75), with_radius(0.75), resolution=0.5)
    answer, _ = oracle(occupied, (2, 2), (9, 9), Fraction(3, 2), Fraction(1, 2), node_weights=True)
    path = np.asarray(found.search.path)[: int(found.search.path_cells)]
    assert [tuple(pair) for pair in path.tolist()] == list(answer.path)
    assert all(distance_reference.distance(occupied, c + 0.5, r + 0.5) > 1.5 for r, c in path)


def test_changing_constants_and_frames_does_not_retrace():
    run(np.zeros((9, 9), bool), (0.5, 0.5), (8.5, 8.5))
    before = len(traces)
    for k in range(3):
        constants = replace(with_radius(0.1 * k), weight_rule=replace(CONSTANTS.weight_rule, sparse_gain=0.1 * k))
        run(random_map(k, (9, 9), 0.2), (0.5, 0.5), (8.5, 8.5), constants, resolution=1.0 + k)
    assert len(traces) == before
