"""Plans on one known map, without driving: what `adwa plan` computes."""

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.astar import SearchOptions, SearchResult, Status
from adwa_jax.constants import Constants, PlanOptions
from adwa_jax.grid import Grid
from adwa_jax.heuristic_weight import Scope, WeightRule
from adwa_jax.metrics import PlannedMeasures
from adwa_jax.plan import plan
from adwa_jax.presets import paper
from scenarios.formats import MapFile
from scenarios.padding import ladder_size, pad_grid

Planner = Literal["improved", "traditional", "dijkstra"]
DECIMALS = 4  # of coordinates in JSON, at least; a thousandth of a cell where that is finer
WORKERS = 2  # searches side by side; one alone keeps one core busy


@dataclass(frozen=True)
class PlannedPath:
    """One query's answer. Points are (x, y) [m] in the grid's frame, lengths in metres."""

    start: tuple[float, float]
    goal: tuple[float, float]
    status: Status
    length: float  # of the grid path; 0 without one
    expansions: int
    measures: dict[str, int]  # breaking and danger points, of the grid path and of the key-point polyline
    path: np.ndarray  # [P, 2] float32, cell centres; empty without a path
    key_points: np.ndarray  # [Q, 2] float32
    key_point_length: float


class _Found(NamedTuple):
    """The parts of a plan that are reported; the rest is never computed."""

    search: SearchResult
    key_points: jax.Array
    key_point_count: jax.Array
    key_point_length: jax.Array
    measures: PlannedMeasures


def planner_options(planner: Planner, scope: Scope = "node", budget: int | None = None) -> PlanOptions:
    """The three planners as settings of one kernel (§2).

    `improved`: no corner is cut, ω by eq. 5. `traditional`: ω = 1, and diagonals past an obstacle's corner allowed, the
    paper's danger points. `dijkstra`: no heuristic, no corner cut: the shortest path.
    """
    if planner == "improved":
        return PlanOptions(search=SearchOptions(budget=budget), scope=scope)
    if planner == "traditional":
        return PlanOptions(search=SearchOptions(corner_rule="always", budget=budget), scope="one")
    return PlanOptions(search=SearchOptions(heuristic="zero", budget=budget), scope="one")


def planner_constants(rule: WeightRule | None = None, robot_radius: float = 0.0) -> Constants:
    """The paper's constants for a robot of some radius [m]; key-point segments keep that radius from obstacles."""
    constants = paper().constants
    return replace(
        constants,
        weight_rule=rule or constants.weight_rule,
        robot=replace(constants.robot, radius=robot_radius),
        behaviour=replace(constants.behaviour, clearance_margin=robot_radius),
    )


def plan_paths(grid: Grid, queries: np.ndarray, constants: Constants, options: PlanOptions,
               progress: Callable[[int, int], None] | None = None) -> Iterator[PlannedPath]:
    """Answers to queries [Q, 2, 2] (start and goal, (x, y) [m], grid frame) on one map, in order.

    Maps are padded to a ladder of sizes, so that maps of like size share one compiled program.
    """
    rows, columns = (ladder_size(side) for side in grid.occupied.shape)
    padded = jax.device_put(pad_grid(grid, rows, columns))
    constants = jax.tree.map(np.float32, constants)
    with ThreadPoolExecutor(WORKERS) as pool:
        answers = pool.map(partial(_answer, padded, constants, options), np.asarray(queries, np.float64))
        for done, answer in enumerate(answers, start=1):
            if progress:
                progress(done, len(queries))
            yield answer


def _answer(grid: Grid, constants: Constants, options: PlanOptions, query: np.ndarray) -> PlannedPath:
    found = jax.device_get(_plan(grid, jnp.asarray(query, jnp.float32), constants, options))
    search = found.search
    cells = search.path[: search.path_cells]
    resolution, origin = float(grid.resolution), np.asarray(grid.origin)
    return PlannedPath(
        start=tuple(query[0].tolist()),
        goal=tuple(query[1].tolist()),
        status=Status(int(search.status)),
        length=path_length(search) * resolution,
        expansions=int(search.expansions),
        measures={name: int(value) for name, value in found.measures._asdict().items()},
        path=((cells[:, ::-1] + 0.5) * resolution + origin).astype(np.float32),
        key_points=found.key_points[: found.key_point_count],
        key_point_length=float(found.key_point_length),
    )


def path_length(found: SearchResult) -> float:
    """Length [cells] of a path fetched from the device, in double precision: benchmarks list eight decimals."""
    return int(found.straight_steps) + int(found.diagonal_steps) * math.sqrt(2.0)


@partial(jax.jit, static_argnames="options")
def _plan(grid: Grid, query: jax.Array, constants: Constants, options: PlanOptions) -> _Found:
    found = plan(grid, query[0], query[1], constants, options)
    return _Found(*(getattr(found, name) for name in _Found._fields))


def why_blocked(map_file: MapFile, point: np.ndarray, robot_radius: float) -> str:
    """Why no search can start or end at a point [2] (x, y) [m], grid frame, and what to do: "rule; remedy"."""
    height, width = map_file.occupied.shape
    low, side = np.asarray(map_file.origin, np.float32), np.float32(map_file.resolution)
    column, row = np.floor((np.asarray(point, np.float32) - low) / side).tolist()  # float32, as the kernels see it
    if not (0 <= row < height and 0 <= column < width):
        (x0, y0), (x1, y1) = map_file.origin, low + side * np.array([width, height], np.float32)
        frame = " in its own frame" if map_file.yaw else ""
        return f"lies outside the map, which spans x {x0:g}..{x1:g}, y {y0:g}..{y1:g} m{frame}; choose a point on it"
    if map_file.occupied[int(row), int(column)]:
        return "lies in an obstacle; choose a free point"
    if map_file.unknown[int(row), int(column)]:
        return "lies in an unknown cell; choose a known one, or count them as free with --unknown free"
    return (f"is too near to an obstacle or the border for --robot-radius {robot_radius:g}; choose a point with more "
            "room or a smaller radius")


def as_json(answer: PlannedPath, map_file: MapFile, expected: float | None = None,
            listed: bool = False) -> dict[str, Any]:
    """The command line's JSON object for one query, in the world's frame; `expected` where the file lists one."""
    decimals = max(DECIMALS, 3 - math.floor(math.log10(map_file.resolution)))

    def world(points: Any) -> list:
        return np.round(map_file.to_world(np.asarray(points, np.float64)), decimals).tolist()

    record = {
        "start": world(answer.start),
        "goal": world(answer.goal),
        "status": answer.status.name,
        "length": answer.length,
        "expansions": answer.expansions,
        **answer.measures,
        "path": world(answer.path),
        "key_points": world(answer.key_points),
        "key_point_length": answer.key_point_length,
    }
    return {**record, "expected": expected} if listed else record
