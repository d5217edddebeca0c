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
from scenarios.padding import ladder_size, pad_grid

Planner = Literal["improved", "traditional", "dijkstra"]
DECIMALS = 4  # of coordinates in JSON: a tenth of a millimetre, beyond which float32 on a map of 1 km knows nothing
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


def as_json(answer: PlannedPath, to_world: Callable[[np.ndarray], np.ndarray], expected: Any = None,
            listed: bool = False) -> dict[str, Any]:
    """The command line's JSON object for one query, in the world's frame; `expected` where the file lists one."""

    def world(points: Any) -> list:
        return np.round(to_world(np.asarray(points, np.float64)), DECIMALS).tolist()

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
