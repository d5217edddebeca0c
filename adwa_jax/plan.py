"""The global plan: the steps of §2 in order, and the distance field the local planner drives by.

Composes; every step is a kernel of its own file.
"""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from adwa_jax.astar import SearchOptions, SearchResult, search
from adwa_jax.astar_lanes import search_lanes
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
    blocked, start_cell, goal_cell, weight = _shortest(grid, start, goal, constants, options)
    return _surveyed(grid, search(blocked, start_cell, goal_cell, weight, _exact(options)), options)


def survey_lanes(grids: Grid, starts: jax.Array, goals: jax.Array, constants: Constants,
                 options: PlanOptions) -> Survey:
    """`survey` of B tasks, equal to it in every bit; a leading axis B on everything, constants included."""
    tasks = jax.vmap(partial(_shortest, options=options))(grids, starts, goals, constants)
    found = search_lanes(tasks.blocked, tasks.start_cell, tasks.goal_cell, tasks.weight, _exact(options))
    return lax.map(lambda lane: _surveyed(lane[0], lane[1], options), (grids, found))


def plan(grid: Grid, start: jax.Array, goal: jax.Array, constants: Constants, options: PlanOptions,
         surveyed: Survey | None = None) -> Plan:
    """Density → ω → A* → turning points → key points (§2), from point `start` to point `goal`, [2] (x, y) [m].

    A start or goal off the map or inside the inflated obstacles ends as BAD_START or BAD_GOAL; it is never moved.
    Unbatched. surveyed: the task's `survey`, made if it is not given.
    """
    grid, start, goal = jax.tree.map(jnp.asarray, (grid, start, goal))  # suites hold numpy arrays
    surveyed = survey(grid, start, goal, constants, options) if surveyed is None else surveyed
    blocked, start_cell, goal_cell, weight = _weighted(grid, start, goal, constants, options)
    found = search(blocked, start_cell, goal_cell, weight, options.search)
    return _planned(grid, found, constants, surveyed, options)


def plan_lanes(grids: Grid, starts: jax.Array, goals: jax.Array, constants: Constants, options: PlanOptions,
               surveyed: Survey) -> Plan:
    """`plan` of B tasks, equal to it in every bit; a leading axis B on everything, constants included."""
    tasks = jax.vmap(partial(_weighted, options=options))(grids, starts, goals, constants)
    found = search_lanes(tasks.blocked, tasks.start_cell, tasks.goal_cell, tasks.weight, options.search)

    def one(lane: tuple[Grid, SearchResult, Constants, Survey]) -> Plan:
        grid, found, constants, surveyed = lane
        return _planned(grid, found, constants, surveyed, options)

    return lax.map(one, (grids, found, constants, surveyed))


def _planned(grid: Grid, found: SearchResult, constants: Constants, surveyed: Survey, options: PlanOptions) -> Plan:
    """From the path on."""
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


def _surveyed(grid: Grid, shortest: SearchResult, options: PlanOptions) -> Survey:
    return Survey(path_length(shortest) * grid.resolution, distance_field(grid, options.subdivision))


def path_length(found: SearchResult) -> jax.Array:
    """[] float32: straight + √2 · diagonal steps, in cells."""
    return found.straight_steps.astype(jnp.float32) + found.diagonal_steps.astype(jnp.float32) * SQRT2


class _Search(NamedTuple):
    """What a search is called with."""

    blocked: jax.Array  # [H, W] bool
    start_cell: jax.Array  # [2] int32
    goal_cell: jax.Array  # [2] int32
    weight: jax.Array  # [H, W] float32, ω


def _weighted(grid: Grid, start: jax.Array, goal: jax.Array, constants: Constants, options: PlanOptions) -> _Search:
    """The planner's search: ω by eq. 5, 1 where the scope is `one` (traditional A*)."""
    task = _shortest(grid, start, goal, constants, options)
    if options.scope == "one":
        return task
    safe_start, safe_goal = (jnp.where(inside(grid, cell), cell, 0) for cell in (task.start_cell, task.goal_cell))
    return task._replace(weight=weight_field(grid, safe_start, safe_goal, constants.weight_rule, options.scope))


def _shortest(grid: Grid, start: jax.Array, goal: jax.Array, constants: Constants, options: PlanOptions) -> _Search:
    """The search for the path that SPL compares with: ω = 1. Cells off the map are the search's to refuse."""
    blocked = inflate(grid, constants.robot.radius) if options.inflate else grid.occupied
    return _Search(blocked, cell_of(grid, start), cell_of(grid, goal), jnp.ones(blocked.shape, jnp.float32))


def _exact(options: PlanOptions) -> SearchOptions:
    """Octile, no corner cut: with ω = 1 the optimum."""
    return replace(SearchOptions(), budget=options.search.budget)
