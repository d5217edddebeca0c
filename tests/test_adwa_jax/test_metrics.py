"""Measures of planned and driven paths against plain loops."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adwa_jax.keypoints import KeyPoints
from adwa_jax.metrics import Step, finish_measures, measure_step, planned_measures, start_measures
from tests.reference import astar as astar_reference
from tests.reference import keypoints as keypoints_reference
from tests.reference import metrics as reference
from tests.test_adwa_jax.worlds import SHAPE, drawn, few_examples, grid_of, random_map

CAPACITY = SHAPE[0] * SHAPE[1]
DT = 0.25
STEPS = 30


def buffer(cells):
    return jnp.asarray([*cells, *[cells[-1]] * (CAPACITY - len(cells))], jnp.int32)


measure_plan = jax.jit(planned_measures)
one_step = jax.jit(measure_step)
finish = jax.jit(finish_measures)


def planned(occupied, path, kept):
    found = measure_plan(grid_of(occupied), buffer(path), jnp.int32(len(path)),
                         KeyPoints(buffer(kept), jnp.int32(len(kept))))
    return tuple(int(count) for count in found)


def test_planned_points_by_hand():
    path = [(0, 0), (1, 1), (2, 2), (2, 3)]
    occupied = drawn(".#..", "....", ".#..", "....")
    # One turn; steps (0,0)→(1,1) and (1,1)→(2,2) pass an obstacle. The straight line from (0, 0) to (2, 2) touches
    # corners (1, 1) and (2, 2); the last leg keeps 0.5 away.
    assert planned(occupied, path, [(0, 0), (2, 2), (2, 3)]) == (1, 2, 1, 2)
    assert planned(occupied, path, [(0, 0), (0, 0)]) == (1, 2, 0, 0)
    assert planned(occupied, [(1, 1)], [(1, 1)]) == (0, 0, 0, 0)


def test_no_path_has_no_points():
    nothing = KeyPoints(buffer([(0, 0)]), jnp.int32(0))
    found = measure_plan(grid_of(drawn("..")), buffer([(0, 0)]), jnp.int32(0), nothing)
    assert tuple(int(count) for count in found) == (0, 0, 0, 0)


def test_corner_shared_by_cells_and_legs_is_one_danger_point():
    # Both squares touch (1, 1); both legs pass through it.
    assert planned(drawn(".#.", "#..", "..."), [(0, 0), (1, 1), (0, 0)], [(0, 0), (1, 1), (0, 0)])[3] == 1


def test_planned_points_equal_plain_loops():
    checked = 0
    for seed in range(20):
        occupied = random_map(seed, (12, 10), 0.25)
        path = list(astar_reference.search(occupied, (0, 0), (11, 9), corner_rule="always").path)
        if not path:
            continue
        checked += 1
        kept = keypoints_reference.key_points(occupied, path, 0, "literal")
        points = [keypoints_reference.centre(key) for key in kept]
        assert planned(occupied, path, kept) == (
            reference.planned_breaking_points(path),
            reference.planned_danger_points(occupied, path),
            len(kept) - 2,
            reference.polyline_danger_points(occupied, points),
        )
    assert checked > 8


def driven(turns, speeds=None, clearances=None, danger_clearance=0.2):
    """Measures of a drive by eq. 7 from (0, 0, 0): one heading change [rad] and speed a step; and its positions."""
    speeds = [1.0] * len(turns) if speeds is None else speeds
    clearances = [1.0] * len(turns) if clearances is None else clearances
    running, heading = start_measures(), 0.0
    positions, headings = [(0.0, 0.0)], [0.0]
    for turn, v, clearance in zip(turns, speeds, clearances, strict=True):
        dx, dy = v * math.cos(heading) * DT, v * math.sin(heading) * DT
        heading += turn
        step = Step(*map(jnp.float32, (dx, dy, turn, v, turn / DT, clearance)))
        running = one_step(running, step, jnp.float32(danger_clearance))
        positions.append((positions[-1][0] + dx, positions[-1][1] + dy))
        headings.append(heading)
    return running, positions, headings


def finished(running, success=True, shortest=1.0, length=1.0):
    return finish(running, jnp.bool_(success), jnp.float32(DT), jnp.float32(shortest), jnp.float32(length))


@pytest.mark.parametrize(("degrees", "turns"), [
    ([90, 0, 90], 2),  # a straight step parts them
    ([8, 8], 1),
    ([8, 0, 8], 0),
    ([14.99], 0),
    ([15.01], 1),
    ([10, -10, 10], 0),  # to and fro
    ([20, -20, 20], 3),
    ([10] * 9, 1),  # once a turn
    ([], 0),
])
def test_a_turn_counts_once_past_fifteen_degrees(degrees, turns):
    running, _, headings = driven([math.radians(turn) for turn in degrees])
    assert int(running.breaking_points) == turns == reference.driven_breaking_points(headings)


def test_danger_points_are_separate_intervals():
    running, _, _ = driven([0.0] * 6, clearances=[0.1, 0.3, 0.1, 0.1, 0.2, 0.1])
    assert int(running.danger_points) == 3
    measures = finished(running)
    assert float(measures.least_clearance) == pytest.approx(0.1)
    assert float(measures.mean_clearance) == pytest.approx(0.9 / 6)


def test_scores_by_hand():
    running, _, _ = driven([0.0] * 20)  # 5 m in 5 s
    measures = finished(running, shortest=4.0, length=4.0)
    assert float(measures.time) == 5.0
    assert float(measures.length) == pytest.approx(5.0)
    assert float(measures.length_ratio) == pytest.approx(1.25)
    assert float(measures.spl) == pytest.approx(0.8)
    assert float(measures.barn_score) == pytest.approx(2 / 5)  # T* = 2 s, 5 s is within 4 … 16 s
    assert float(finished(running, length=8.0).barn_score) == pytest.approx(0.5)  # 5 s clipped to 2 T* = 8 s
    assert float(finished(running, length=0.5).barn_score) == pytest.approx(0.125)  # clipped to 8 T* = 2 s
    assert float(finished(running, shortest=6.0).spl) == 1.0  # shorter than the grid's shortest
    failed = finished(running, success=False, shortest=4.0, length=4.0)
    assert (float(failed.spl), float(failed.barn_score)) == (0.0, 0.0)


def test_jerk_of_a_cubic():
    # x = t³ in steps: third difference 6, over DT³.
    running = start_measures()
    for k in range(4):
        dx = (k + 1) ** 3 - k**3
        running = one_step(running, Step(*map(jnp.float32, (dx, 0, 0, 0, 0, 1))), jnp.float32(0))
    assert float(finished(running).jerk) == pytest.approx(6 / DT**3)


turns_and_speeds = st.lists(
    st.tuples(st.sampled_from([0.0, 0.05, -0.05, 0.2, -0.3, 1.0]), st.sampled_from([0.0, 0.25, 1.0, -0.5]),
              st.sampled_from([0.05, 0.15, 0.25, 0.9])),
    min_size=0, max_size=STEPS)


@few_examples
@given(turns_and_speeds)
def test_every_measure_equals_plain_loops(steps):
    turns, speeds, clearances = (list(column) for column in zip(*steps, strict=True)) if steps else ([], [], [])
    running, positions, headings = driven(turns, speeds, clearances)
    measures = finished(running, shortest=2.0, length=3.0)
    expected = {
        "time": len(steps) * DT,
        "length": reference.length(positions),
        "spl": reference.spl(True, 2.0, reference.length(positions)),
        "breaking_points": reference.driven_breaking_points(headings),
        "danger_points": reference.driven_danger_points(clearances, 0.2),
        "least_clearance": min(clearances, default=0.0),
        "mean_clearance": sum(clearances) / len(steps) if steps else 0.0,
        "curvature": reference.curvature(positions, headings),
        "angle_over_length": reference.angle_over_length(positions, headings),
        "command_variation": reference.command_variation([0.0, *speeds], [0.0, *[turn / DT for turn in turns]]),
        "jerk": reference.jerk(positions, DT),
        "barn_score": reference.barn_score(True, len(steps) * DT, 3.0),
    }
    for name, value in expected.items():
        assert float(getattr(measures, name)) == pytest.approx(value, rel=1e-4, abs=1e-4), name


def test_nothing_driven_is_finite():
    measures = finished(start_measures(), shortest=0.0, length=0.0)
    assert all(np.isfinite(value) for value in measures)
    assert float(measures.length) == float(measures.length_ratio) == 0.0
    assert float(measures.spl) == 1.0  # nothing to drive, nothing driven


def test_gradients_are_finite_when_standing_still():
    def total(dx):
        running = start_measures()
        for _ in range(3):
            running = measure_step(running, Step(dx, dx, *[jnp.float32(0.0)] * 4), jnp.float32(0.1))
        measures = finish_measures(running, jnp.bool_(True), jnp.float32(DT), jnp.float32(1), jnp.float32(1))
        return measures.length + measures.jerk + measures.curvature + measures.spl + measures.mean_clearance

    assert np.isfinite(jax.jit(jax.grad(total))(jnp.float32(0.0)))
    assert np.isfinite(jax.jit(jax.grad(total))(jnp.float32(0.3)))
