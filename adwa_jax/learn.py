"""What the robot learns under way: hidden cells that came into range, and a new route where the old one is blocked.

Rare and expensive, hence apart from the control step: `notices` tells cheaply when it is due.
Dimension letters: H, W map; s subdivision of a cell; P route points; S unknown squares.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from adwa_jax.astar import SearchResult, Status, search
from adwa_jax.constants import Constants, Options
from adwa_jax.grid import DistanceField, Grid, Scalar, cell_of, centre_of, inflate
from adwa_jax.heuristic_weight import weight_field
from adwa_jax.keypoints import key_points, segment_free
from adwa_jax.plan import Plan
from adwa_jax.route import Route, route_through
from adwa_jax.scenario import Scenario, UnknownSquares

TOUCHING = 1e-4  # [cells] overlaps no deeper than this are none


class Memory(NamedTuple):
    """What changes only when the robot learns."""

    route: Route
    target: jax.Array  # [] int32, index of the route point that ends the segment where a new route begins
    replans: jax.Array  # [] int32, routes planned anew
    seen: jax.Array  # [H, W] bool, hidden cells seen so far; [0, 0] without hidden cells
    distance: jax.Array  # [H·s + 1, W·s + 1] float32, the field with them [m]; [0, 0] without hidden cells


def first_memory(scenario: Scenario, plan: Plan) -> Memory:
    """Before anything was sensed."""
    hidden = scenario.hidden.size > 0
    last = jnp.maximum(plan.key_point_count - 1, 0)
    points = jnp.where((jnp.arange(plan.key_points.shape[0]) >= last)[:, None], scenario.goal[None, :],
                       plan.key_points)
    return Memory(
        route=route_through(points, plan.key_point_count),
        target=jnp.minimum(1, last),
        replans=jnp.int32(0),
        seen=jnp.zeros_like(scenario.hidden),
        distance=plan.field.distance if hidden else jnp.zeros((0, 0), jnp.float32),
    )


def learns(scenario: Scenario, options: Options) -> bool:
    """Whether there is anything to learn; static."""
    return options.rules.replan or scenario.hidden.size > 0


def field_of(memory: Memory, plan: Plan) -> DistanceField:
    """The distance field the robot drives by."""
    return replace(plan.field, distance=memory.distance) if memory.distance.size else plan.field


def in_range(scenario: Scenario, position: jax.Array, sensor_range: Scalar) -> jax.Array:
    """[H, W] bool: hidden cells whose square is within range of a point [2] [m]."""
    grid = scenario.grid
    rows, columns = scenario.hidden.shape
    x, y = (position - grid.origin) / grid.resolution
    dx = _gap(x, jnp.arange(columns, dtype=jnp.float32))
    dy = _gap(y, jnp.arange(rows, dtype=jnp.float32))
    reach = sensor_range / grid.resolution
    return scenario.hidden & ((dy * dy)[:, None] + (dx * dx)[None, :] <= reach * reach)


def learn(memory: Memory, position: jax.Array, target: jax.Array, known: jax.Array, lost: jax.Array,
          scenario: Scenario, constants: Constants, options: Options) -> Memory:
    """Take in what is in range at `position`, [2] [m]; then plan a new route if the old one is blocked or `lost`.

    Unbatched. target: [] int32, the route point now headed for; known: [S] bool, squares sensed.
    """
    memory = memory._replace(target=target)
    if scenario.hidden.size:
        now = in_range(scenario, position, constants.behaviour.sensor_range)
        distance = lax.cond(jnp.any(now & ~memory.seen), lambda: _with_cells(memory, now & ~memory.seen, scenario.grid),
                            lambda: memory.distance)  # fmt: skip
        memory = memory._replace(seen=memory.seen | now, distance=distance)
    if not options.rules.replan:
        return memory
    grid = known_grid(scenario, memory.seen, known)
    blocked = lost | route_blocked(memory.route, target, grid, constants)
    return lax.cond(blocked, lambda: _with_new_route(memory, position, grid, scenario, constants, options),
                    lambda: memory)  # fmt: skip


def known_grid(scenario: Scenario, seen: jax.Array, known: jax.Array) -> Grid:
    """The map with the hidden cells seen and with every cell that a known square overlaps."""
    grid = scenario.grid
    occupied = grid.occupied | overlapped(grid, scenario.squares, known)
    return replace(grid, occupied=occupied | seen if seen.size else occupied)


def overlapped(grid: Grid, squares: UnknownSquares, known: jax.Array) -> jax.Array:
    """[H, W] bool: cells that known squares, rounding included, overlap; touching is not overlapping."""
    rows, columns = grid.occupied.shape
    x = (squares.centre[:, 0] - grid.origin[0]) / grid.resolution
    y = (squares.centre[:, 1] - grid.origin[1]) / grid.resolution
    half = squares.half_width / grid.resolution
    reach = squares.rounding / grid.resolution
    dx = _gap(x[:, None], jnp.arange(columns, dtype=jnp.float32)[None, :])
    dy = _gap(y[:, None], jnp.arange(rows, dtype=jnp.float32)[None, :])
    half, reach = half[:, None], reach[:, None, None]
    sharp = (dy < half - TOUCHING)[:, :, None] & (dx < half - TOUCHING)[:, None, :]
    beyond_x, beyond_y = jnp.maximum(dx - half, 0.0), jnp.maximum(dy - half, 0.0)
    apart = jnp.sqrt((beyond_y * beyond_y)[:, :, None] + (beyond_x * beyond_x)[:, None, :])
    return jnp.any(known[:, None, None] & (sharp | (apart < reach - TOUCHING)), axis=0)


def route_blocked(route: Route, target: jax.Array, grid: Grid, constants: Constants) -> jax.Array:
    """[] bool: whether a segment from the one that ends at `target` on comes nearer to an occupied square than the
    robot's radius and `route_margin`.
    """
    margin = (constants.robot.radius + constants.behaviour.route_margin) / grid.resolution * 0.999
    points = (route.points - grid.origin[None, :]) / grid.resolution

    def cond_fun(carry: tuple[jax.Array, jax.Array]) -> jax.Array:
        index, free = carry
        return free & (index < route.count)

    def body_fun(carry: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        index, _ = carry
        return index + 1, segment_free(grid.occupied, points[index - 1], points[index], margin)

    return ~lax.while_loop(cond_fun, body_fun, (jnp.maximum(target, 1), jnp.bool_(True)))[1]


def _with_new_route(memory: Memory, position: jax.Array, grid: Grid, scenario: Scenario, constants: Constants,
                    options: Options) -> Memory:
    """A route over the map as it is known now; the old one where there is none."""
    behaviour, radius = constants.behaviour, constants.robot.radius
    start, goal = cell_of(grid, position), cell_of(grid, scenario.goal)
    weight = weight_field(grid, _on_map(start, grid), _on_map(goal, grid), constants.weight_rule, options.plan.scope)

    def path_with(margin: jax.Array) -> SearchResult:
        blocked = inflate(grid, radius + margin)
        return search(blocked, _nearest_free(blocked, start), _nearest_free(blocked, goal), weight,
                      options.plan.search)

    found = _first_found(path_with, jnp.stack([jnp.float32(behaviour.route_margin), jnp.float32(0.0)]))
    margin = behaviour.clearance_margin / grid.resolution
    kept = key_points(grid.occupied, found.path, found.path_cells, margin, options.plan.keypoint_rule)
    last = jnp.arange(kept.cells.shape[0]) >= kept.count - 1
    points = jnp.where(last[:, None], scenario.goal[None, :], centre_of(grid, kept.cells))
    is_found = found.status == Status.FOUND
    route = jax.tree.map(lambda new, old: jnp.where(is_found, new, old),
                         _from_here(points, kept.count, position, grid, margin), memory.route)  # fmt: skip
    return memory._replace(route=route, target=jnp.where(is_found, 1, memory.target),
                           replans=memory.replans + is_found.astype(jnp.int32))


def _first_found(path_with: Callable[[jax.Array], SearchResult], margins: jax.Array) -> SearchResult:
    """The search with the first of the margins [A] that finds a path, else with the last; one compiled search."""

    def cond_fun(carry: tuple[jax.Array, SearchResult]) -> jax.Array:
        tried, found = carry
        return (tried == 0) | ((found.status != Status.FOUND) & (tried < margins.shape[0]))

    def body_fun(carry: tuple[jax.Array, SearchResult]) -> tuple[jax.Array, SearchResult]:
        return carry[0] + 1, path_with(margins[carry[0]])

    shapes = jax.eval_shape(path_with, margins[0])
    nothing = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), shapes)
    return lax.while_loop(cond_fun, body_fun, (jnp.int32(0), nothing))[1]


def _from_here(points: jax.Array, count: jax.Array, position: jax.Array, grid: Grid, margin: jax.Array) -> Route:
    """From the robot to the second point, or by way of the first, its cell's centre, where that is not free."""
    here, there = ((point - grid.origin) / grid.resolution for point in (position, points[jnp.minimum(1, count - 1)]))
    direct = segment_free(grid.occupied, here, there, margin) | (count < 2)
    by_way = jnp.concatenate([position[None, :], points[:-1]])
    straight = jnp.concatenate([position[None, :], points[1:]])
    return route_through(jnp.where(direct, straight, by_way), jnp.where(direct, jnp.maximum(count, 2), count + 1))


def _nearest_free(blocked: jax.Array, cell: jax.Array) -> jax.Array:
    """[2] int32: the free cell nearest to a cell; the cell itself where it is free."""
    rows = jnp.arange(blocked.shape[0], dtype=jnp.int32) - cell[0]
    columns = jnp.arange(blocked.shape[1], dtype=jnp.int32) - cell[1]
    apart = (rows * rows)[:, None] + (columns * columns)[None, :]
    nearest = jnp.argmin(jnp.where(blocked, jnp.int32(2**30), apart)).astype(jnp.int32)
    return jnp.stack([nearest // blocked.shape[1], nearest % blocked.shape[1]])


def _on_map(cell: jax.Array, grid: Grid) -> jax.Array:
    return jnp.clip(cell, 0, jnp.stack([grid.height, grid.width]) - 1)


def _with_cells(memory: Memory, cells: jax.Array, grid: Grid) -> jax.Array:
    """The field with some more occupied cells: at each lattice point the least of what was and the distance to them."""
    rows, columns = cells.shape
    fine_rows, fine_columns = memory.distance.shape
    subdivision = (fine_rows - 1) // rows
    x = jnp.arange(fine_columns, dtype=jnp.float32) / subdivision
    y = jnp.arange(fine_rows, dtype=jnp.float32) / subdivision
    (places,) = jnp.nonzero(cells.reshape(-1), size=cells.size, fill_value=0)

    def body_fun(index: jax.Array, squared: jax.Array) -> jax.Array:
        row, column = (value.astype(jnp.float32) for value in (places[index] // columns, places[index] % columns))
        dx, dy = _gap(x, column), _gap(y, row)
        return jnp.minimum(squared, (dy * dy)[:, None] + (dx * dx)[None, :])

    in_cells = memory.distance / grid.resolution
    squared = lax.fori_loop(0, jnp.sum(cells, dtype=jnp.int32), body_fun, in_cells * in_cells)
    return jnp.minimum(memory.distance, jnp.sqrt(squared) * grid.resolution)


def _gap(coordinate: jax.Array, low: jax.Array) -> jax.Array:
    """Distance along one axis from a coordinate to the interval [low, low + 1]; shapes fit."""
    return jnp.maximum(0.0, jnp.maximum(low - coordinate, coordinate - low - 1.0))
