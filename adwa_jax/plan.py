"""The global plan: the steps of §2 in order, and the distance field the local planner drives by.

Composes; every step is a kernel of its own file.
"""

from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp

from adwa_jax.astar import SearchOptions, SearchResult, search
from adwa_jax.constants import Constants, PlanOptions
from adwa_jax.grid import DistanceField, Grid, cell_of, centre_of, distance_field, inflate, inside
from adwa_jax.heuristic_weight import weight_field
from adwa_jax.keypoints import key_points, polyline_length
from adwa_jax.metrics import PlannedMeasures, planned_measures

SQRT2 = 2.0**0.5


class Plan(NamedTuple):
    """What the robot knows before it starts. Lengths in metres."""

    search: SearchResult
    length: jax.Array  # [] float32, of the grid path; 0 without a path
    key_points: jax.Array  # [P, 2] float32 (x, y), start's and goal's cells included; beyond the count the last repeats
    key_point_count: jax.Array  # [] int32
    key_point_length: jax.Array  # [] float32
    measures: PlannedMeasures
    optimal_length: jax.Array  # [] float32, ℓ: shortest grid path, corner rule `never`; 0 without one
    field: DistanceField


class Survey(NamedTuple):
    """Of the map and the robot's size alone, whatever the constants of eq. 5."""

    optimal_length: jax.Array  # [] float32, ℓ: shortest grid path, corner rule `never`; 0 without one [m]
    field: DistanceField


def survey(grid: Grid, start: jax.Array, goal: jax.Array, constants: Constants, options: PlanOptions) -> Survey:
    """What plans of one task have in common. Unbatched. start, goal: [2] (x, y) [m]."""
    grid, start, goal = jax.tree.map(jnp.asarray, (grid, start, goal))  # suites hold numpy arrays
    shortest = _shortest(_blocked(grid, constants, options), cell_of(grid, start), cell_of(grid, goal), options)
    return Survey(path_length(shortest) * grid.resolution, distance_field(grid, options.subdivision))


def plan(grid: Grid, start: jax.Array, goal: jax.Array, constants: Constants, options: PlanOptions,
         surveyed: Survey | None = None) -> Plan:
    """Density → ω → A* → turning points → key points (§2), from point `start` to point `goal`, [2] (x, y) [m].

    A start or goal off the map or inside the inflated obstacles ends as BAD_START or BAD_GOAL; it is never moved.
    Unbatched. surveyed: the task's `survey`, made if it is not given.
    """
    grid, start, goal = jax.tree.map(jnp.asarray, (grid, start, goal))  # suites hold numpy arrays
    surveyed = survey(grid, start, goal, constants, options) if surveyed is None else surveyed
    start_cell, goal_cell = cell_of(grid, start), cell_of(grid, goal)
    blocked = _blocked(grid, constants, options)
    found = search(blocked, start_cell, goal_cell, _weight(grid, start_cell, goal_cell, constants, options),
                   options.search)
    margin = constants.behaviour.clearance_margin / grid.resolution
    kept = key_points(grid.occupied, found.path, found.path_cells, margin, options.keypoint_rule)
    points = centre_of(grid, kept.cells)
    return Plan(
        search=found,
        length=path_length(found) * grid.resolution,
        key_points=points,
        key_point_count=kept.count,
        key_point_length=polyline_length(points, kept.count),
        measures=planned_measures(grid, found.path, found.path_cells, kept),
        optimal_length=surveyed.optimal_length,
        field=surveyed.field,
    )


def path_length(found: SearchResult) -> jax.Array:
    """[] float32: straight + √2 · diagonal steps, in cells."""
    return found.straight_steps.astype(jnp.float32) + found.diagonal_steps.astype(jnp.float32) * SQRT2


def _blocked(grid: Grid, constants: Constants, options: PlanOptions) -> jax.Array:
    return inflate(grid, constants.robot.radius) if options.inflate else grid.occupied


def _weight(grid: Grid, start_cell: jax.Array, goal_cell: jax.Array, constants: Constants,
            options: PlanOptions) -> jax.Array:
    """[H, W] ω; 1 where the scope is `one` (traditional A*). Cells off the map are the search's to refuse."""
    if options.scope == "one":
        return jnp.ones(grid.occupied.shape, jnp.float32)
    safe_start = jnp.where(inside(grid, start_cell), start_cell, 0)
    safe_goal = jnp.where(inside(grid, goal_cell), goal_cell, 0)
    return weight_field(grid, safe_start, safe_goal, constants.weight_rule, options.scope)


def _shortest(blocked: jax.Array, start_cell: jax.Array, goal_cell: jax.Array, options: PlanOptions) -> SearchResult:
    """The A*-optimal path that SPL compares with: ω = 1, octile, no corner cut."""
    exact = replace(SearchOptions(), budget=options.search.budget)
    return search(blocked, start_cell, goal_cell, jnp.ones(blocked.shape, jnp.float32), exact)
