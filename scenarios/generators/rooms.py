"""Rooms with doors, as on one floor of a building."""

from dataclasses import dataclass

import jax

from adwa_jax.scenario import Scenario
from scenarios.generators.draws import streams_of
from scenarios.generators.lattice import draw_lattice
from scenarios.generators.patrolled import scenario_between_rooms
from scenarios.generators.task_spec import TaskSpec, demand_count, demand_fit, demand_number


@dataclass(frozen=True, kw_only=True)
class RoomsSpec(TaskSpec):
    """`rooms` × `rooms` rooms of `room_cells` cells a side, walls a cell thick, doors of `door_cells`.

    Doors connect all rooms; a wall without need of one has one with probability `extra_doors`. Start and goal
    are random cells, at least `separation` times the map's diagonal apart. The map is rooms · (room_cells +
    1) - 1 cells a side; its cells are `resolution` [m] wide.
    """

    rooms: int = 4
    room_cells: int = 7
    door_cells: int = 1
    extra_doors: float = 0.5
    resolution: float = 1.0
    separation: float = 1 / 3
    time_limit: float = 120.0

    def __post_init__(self):
        super().__post_init__()
        demand_count("rooms", self.rooms, 2, 256)
        demand_count("room_cells", self.room_cells, 1, 256)
        demand_count("door_cells", self.door_cells, 1, self.room_cells)
        demand_number("extra_doors", self.extra_doors, 0.0, 1.0)
        demand_number("resolution", self.resolution, 1e-3)
        demand_number("separation", self.separation, 0.0, 1 / 3)
        demand_fit("door_cells", self.door_cells, self.resolution, self.robot_radius)


def generate(key: jax.Array, spec: RoomsSpec) -> Scenario:
    """One scenario with a known map that a robot of `spec.robot_radius` can solve; numpy leaves, origin (0, 0).

    The unknown squares leave the map solvable too. Movers patrol free lanes, doors included. Consumes the
    key: map, task, squares and movers take a stream each.
    """
    streams = streams_of(key)
    occupied = draw_lattice(streams.map, spec.rooms, spec.room_cells, spec.door_cells, spec.extra_doors)
    return scenario_between_rooms(streams, occupied, spec, spec.resolution, spec.separation)
