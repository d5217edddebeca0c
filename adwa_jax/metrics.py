"""Measures of a planned path and of a driven one.

A driven path is measured as it is driven: `start_measures`, then `measure_step` after each control step, then
`finish_measures`; nothing need be kept of the path itself.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from adwa_jax.grid import Grid, Scalar
from adwa_jax.keypoints import KeyPoints, turning_points

TURN = np.float32(np.deg2rad(15.0))  # a turn counts as a breaking point once it has accumulated more than this
BARN_SPEED = 2.0  # [m/s], at which the BARN score's ideal robot drives the reference path


class PlannedMeasures(NamedTuple):
    """Of the grid path and of its key-point polyline. [] int32 each; 0 without a path."""

    breaking_points: jax.Array  # turning points of the grid path, ends not counted
    danger_points: jax.Array  # diagonal steps of the grid path with an occupied orthogonal neighbour
    key_point_breaking_points: jax.Array  # key points, ends not counted
    key_point_danger_points: jax.Array  # corners of occupied cells nearer than a tenth of a cell to the polyline


class Step(NamedTuple):
    """One control step as it was driven, [] float32 each."""

    dx: jax.Array  # displacement [m]
    dy: jax.Array  # [m]
    turn: jax.Array  # change of heading [rad]
    v: jax.Array  # command [m/s]
    yaw_rate: jax.Array  # command [rad/s]
    clearance: jax.Array  # after the step, from the robot's outline to the nearest obstacle of any kind [m]


class Running(NamedTuple):
    """Sums and extremes so far."""

    steps: jax.Array  # [] int32
    length: jax.Array
    turned: jax.Array  # Σ|Δθ| [rad]
    turn: jax.Array  # heading change accumulated in the present turn [rad], signed
    breaking_points: jax.Array  # [] int32
    danger_points: jax.Array  # [] int32
    in_danger: jax.Array  # [] bool
    least_clearance: jax.Array
    clearance_sum: jax.Array
    curvature_sum: jax.Array
    moving_steps: jax.Array  # [] int32
    command_variation: jax.Array
    jerk_sum: jax.Array
    last: Step
    before_last: Step


class Measures(NamedTuple):
    """Of one episode. Lengths [m], times [s], angles [rad]; [] float32 unless stated."""

    time: jax.Array
    length: jax.Array
    # length ÷ ℓ, the shortest 8-connected grid path between cell centres; 0 where ℓ is. Below 1 for a robot that cuts
    # the grid's corners and may stop short of the goal by its tolerance.
    length_ratio: jax.Array
    spl: jax.Array  # success · ℓ / max(length, ℓ); success itself where ℓ = 0
    breaking_points: jax.Array  # [] int32
    danger_points: jax.Array  # [] int32, separate intervals with clearance < danger_clearance
    least_clearance: jax.Array
    mean_clearance: jax.Array
    curvature: jax.Array  # mean |Δθ|/Δs over the steps that moved [1/m]
    angle_over_length: jax.Array  # Σ|Δθ| / length [rad/m]
    command_variation: jax.Array  # Σ |Δv| + |Δyaw_rate|, from standstill
    jerk: jax.Array  # mean |Δ³p| / dt³ [m/s³]
    barn_score: jax.Array  # success · T* / clip(time, 2T*, 8T*)


def planned_measures(grid: Grid, path: jax.Array, path_cells: jax.Array, kept: KeyPoints) -> PlannedMeasures:
    """Breaking and danger points of a grid path (§5.1) and of its key-point polyline. Unbatched. path: [P, 2]."""
    turns = jnp.sum(turning_points(path, path_cells), dtype=jnp.int32)
    return PlannedMeasures(
        breaking_points=jnp.maximum(turns - 2, 0),
        danger_points=jnp.sum(danger_steps(grid, path, path_cells), dtype=jnp.int32),
        key_point_breaking_points=jnp.maximum(kept.count - 2, 0),
        key_point_danger_points=jnp.sum(danger_corners(grid, kept), dtype=jnp.int32),
    )


def danger_steps(grid: Grid, path: jax.Array, path_cells: jax.Array) -> jax.Array:
    """[P − 1] bool: diagonal steps with an occupied orthogonal neighbour, the paper's danger points."""
    here, there = path[:-1], path[1:]
    diagonal = jnp.all(here != there, axis=1)
    beside = grid.occupied[here[:, 0], there[:, 1]] | grid.occupied[there[:, 0], here[:, 1]]
    used = jnp.arange(1, path.shape[0]) < path_cells
    return diagonal & beside & used


def danger_corners(grid: Grid, kept: KeyPoints) -> jax.Array:
    """[H + 1, W + 1] bool: corners of occupied cells closer than a tenth of a cell to the key-point polyline."""
    rows, columns = grid.occupied.shape
    on_map = (jnp.arange(rows)[:, None] < grid.height) & (jnp.arange(columns)[None, :] < grid.width)
    ringed = jnp.pad(grid.occupied & on_map, 1)
    corner = ringed[:-1, :-1] | ringed[1:, :-1] | ringed[:-1, 1:] | ringed[1:, 1:]
    y = jnp.arange(rows + 1, dtype=jnp.float32)[:, None]
    x = jnp.arange(columns + 1, dtype=jnp.float32)[None, :]
    points = kept.cells[:, ::-1].astype(jnp.float32) + 0.5

    def body_fun(index: jax.Array, near: jax.Array) -> jax.Array:
        return near | (_squared_distance_to_segment(x, y, points[index], points[index + 1]) < 0.01)

    return corner & lax.fori_loop(0, kept.count - 1, body_fun, jnp.zeros_like(corner))


def _squared_distance_to_segment(x: jax.Array, y: jax.Array, a: jax.Array, b: jax.Array) -> jax.Array:
    span = b - a
    share = ((x - a[0]) * span[0] + (y - a[1]) * span[1]) / jnp.maximum(jnp.sum(span * span), 1e-12)
    share = jnp.clip(share, 0.0, 1.0)
    dx, dy = x - a[0] - share * span[0], y - a[1] - share * span[1]
    return dx * dx + dy * dy


def start_measures() -> Running:
    """Nothing driven, standing still. `least_clearance` is infinite until the first step."""
    zero, none = jnp.float32(0.0), jnp.int32(0)
    still = Step(*(zero,) * len(Step._fields))
    return Running(
        steps=none, length=zero, turned=zero, turn=zero, breaking_points=none, danger_points=none,
        in_danger=jnp.bool_(False), least_clearance=jnp.float32(jnp.inf), clearance_sum=zero, curvature_sum=zero,
        moving_steps=none, command_variation=zero, jerk_sum=zero, last=still, before_last=still,
    )  # fmt: skip


def measure_step(running: Running, step: Step, danger_clearance: Scalar) -> Running:
    """Take one more step into account. Unbatched."""
    moved = _norm(step.dx, step.dy)
    moves = moved > 1e-6
    turn, breaks = _turn(running.turn, step.turn)
    danger = step.clearance < danger_clearance
    last, before = running.last, running.before_last
    third = _norm(step.dx - 2.0 * last.dx + before.dx, step.dy - 2.0 * last.dy + before.dy)
    return Running(
        steps=running.steps + 1,
        length=running.length + moved,
        turned=running.turned + jnp.abs(step.turn),
        turn=turn,
        breaking_points=running.breaking_points + breaks.astype(jnp.int32),
        danger_points=running.danger_points + (danger & ~running.in_danger).astype(jnp.int32),
        in_danger=danger,
        least_clearance=jnp.minimum(running.least_clearance, step.clearance),
        clearance_sum=running.clearance_sum + step.clearance,
        curvature_sum=running.curvature_sum + jnp.where(moves, jnp.abs(step.turn) / jnp.where(moves, moved, 1.0), 0.0),
        moving_steps=running.moving_steps + moves.astype(jnp.int32),
        command_variation=running.command_variation + jnp.abs(step.v - last.v) + jnp.abs(step.yaw_rate - last.yaw_rate),
        jerk_sum=running.jerk_sum + jnp.where(running.steps >= 2, third, 0.0),
        last=step,
        before_last=last,
    )


def _turn(accumulated: jax.Array, turn: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The turn so far, and whether this step takes it past 15°: once a run of heading changes of one sign."""
    goes_on = accumulated * turn > 0
    before = jnp.where(goes_on, accumulated, 0.0)
    after = before + turn
    return after, (jnp.abs(before) <= TURN) & (jnp.abs(after) > TURN)


def finish_measures(running: Running, success: jax.Array, dt: Scalar, shortest: jax.Array,
                    reference: jax.Array) -> Measures:
    """Means and scores. success: [] bool; shortest ℓ and BARN reference length: [] [m]. No division by zero."""
    steps = running.steps.astype(jnp.float32)
    time = steps * dt
    success = success.astype(jnp.float32)
    ideal = reference / BARN_SPEED
    return Measures(
        time=time,
        length=running.length,
        length_ratio=_ratio(running.length, shortest),
        spl=success * jnp.where(shortest > 0, _ratio(shortest, jnp.maximum(running.length, shortest)), 1.0),
        breaking_points=running.breaking_points,
        danger_points=running.danger_points,
        least_clearance=jnp.where(running.steps > 0, running.least_clearance, 0.0),
        mean_clearance=_ratio(running.clearance_sum, steps),
        curvature=_ratio(running.curvature_sum, running.moving_steps.astype(jnp.float32)),
        angle_over_length=_ratio(running.turned, running.length),
        command_variation=running.command_variation,
        jerk=_ratio(running.jerk_sum, jnp.maximum(steps - 2.0, 0.0) * dt * dt * dt),
        barn_score=success * _ratio(ideal, jnp.clip(time, 2.0 * ideal, 8.0 * ideal)),
    )


def _ratio(numerator: jax.Array, denominator: jax.Array) -> jax.Array:
    positive = denominator > 0
    return jnp.where(positive, numerator / jnp.where(positive, denominator, 1.0), 0.0)


def _norm(dx: jax.Array, dy: jax.Array) -> jax.Array:
    squared = dx * dx + dy * dy
    return jnp.where(squared > 0, jnp.sqrt(jnp.where(squared > 0, squared, 1.0)), 0.0)
