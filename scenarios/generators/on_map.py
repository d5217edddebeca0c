"""Random tasks on a user's own map: reachable start and goal, unknown squares, patrolling movers."""

import math
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from adwa_jax.grid import Grid
from adwa_jax.scenario import Scenario
from scenarios.errors import InputError
from scenarios.generators.assembly import float32, int32
from scenarios.generators.connectivity import inflated, largest_component
from scenarios.generators.draws import streams_of
from scenarios.generators.patrolled import patrolled_scenario
from scenarios.generators.task_spec import Range, TaskSpec, demand_number
from scenarios.generators.tasks import far_pair

SECONDS_PER_METRE = 4.0
"""The time limit for each metre of the map's diagonal [s/m]."""


@dataclass(frozen=True, kw_only=True)
class OnMapSpec(TaskSpec):
    """Tasks on a given map; start and goal `separation` times its diagonal apart where the map allows it."""

    separation: float = 1 / 3
    square_distance: float = 1.5
    mover_radius: Range = (0.2, 0.3)

    def __post_init__(self):
        super().__post_init__()
        demand_number("separation", self.separation, 0.0, 1.0)


@dataclass(frozen=True)
class Ground:
    """A user's map, made ready once for many tasks; N reachable cells."""

    grid: Grid  # numpy leaves
    resolution: float  # [m]
    origin: tuple[float, float]  # [m]
    blocked: np.ndarray  # [H, W] bool, cells that the map denies the robot
    reachable: np.ndarray  # [N, 2] int (row, column), the largest component of the others


def prepare(grid: Grid, robot_radius: float, name: str = "map") -> Ground:
    """The map made ready for tasks of a robot of `robot_radius` [m], which start and end in its largest component.

    grid: unpadded, numpy or jax leaves. Raises InputError where no two cells are connected.
    """
    occupied = np.asarray(grid.occupied, np.bool_)
    resolution, origin = float(grid.resolution), tuple(float(value) for value in np.asarray(grid.origin))
    blocked = inflated(occupied, resolution, robot_radius)
    reachable = largest_component(blocked)
    if len(reachable) < 2:
        raise InputError(f"{name}: no two connected cells for robot_radius {robot_radius:g} m; a task needs a start "
                         "and a goal; take a smaller radius or a map with more free space")
    height, width = occupied.shape
    cells: Any = occupied
    host = Grid(cells, int32(height), int32(width), float32(grid.resolution), float32(grid.origin))
    return Ground(host, resolution, (origin[0], origin[1]), blocked, reachable)


def spec_for(ground: Ground, squares: int, movers: int, robot_radius: float) -> OnMapSpec:
    """The spec with a time limit in keeping with the map's size, and a mover distance with where a robot can get: the
    map may have a margin far wider, in which nothing moves.
    """
    diagonal = math.hypot(*ground.blocked.shape) * ground.resolution
    reach = math.hypot(*(np.ptp(ground.reachable, axis=0) + 1)) * ground.resolution
    return OnMapSpec(robot_radius=robot_radius, squares=squares, movers=movers,
                     time_limit=max(60.0, SECONDS_PER_METRE * diagonal), mover_distance=min(4.0, reach / 6))


def generate(key: jax.Array, spec: OnMapSpec, ground: Ground) -> Scenario:
    """One scenario on the map, numpy leaves; all scenarios of a ground share its grid.

    `ground` must have been prepared for `spec.robot_radius`. Consumes the key: task, squares and movers take
    a stream each.
    """
    streams = streams_of(key)
    least = spec.separation * math.hypot(*ground.blocked.shape)
    start, goal = far_pair(streams.task, ground.reachable, least)
    return patrolled_scenario(streams, ground.grid, ground.blocked, start, goal, spec, ground.resolution,
                              ground.origin)
