"""Mazes: corridors along a random spanning tree."""

from dataclasses import dataclass

import jax

from adwa_jax.scenario import Scenario
from scenarios.generators.draws import streams_of
from scenarios.generators.lattice import draw_lattice
from scenarios.generators.patrolled import scenario_between_rooms
from scenarios.generators.task_spec import TaskSpec, demand_count, demand_fit, demand_number


@dataclass(frozen=True, kw_only=True)
class MazeSpec(TaskSpec):
    """`junctions` × `junctions` places joined by corridors of `corridor_cells`, walls a cell thick.

    `extra_openings` 0 gives a perfect maze (one way between any two places); otherwise each remaining wall is
    opened with that probability. Start and goal are random cells, at least `separation` times the map's
    diagonal apart. The map is junctions · (corridor_cells + 1) - 1 cells a side; its cells are `resolution`
    [m] wide.
    """

    junctions: int = 11
    corridor_cells: int = 2
    extra_openings: float = 0.1
    resolution: float = 1.0
    separation: float = 1 / 3
    movers: int | None = 4
    time_limit: float = 240.0

    def __post_init__(self):
        super().__post_init__()
        demand_count("junctions", self.junctions, 2, 1024)
        demand_count("corridor_cells", self.corridor_cells, 1, 256)
        demand_number("extra_openings", self.extra_openings, 0.0, 1.0)
        demand_number("resolution", self.resolution, 1e-3)
        demand_number("separation", self.separation, 0.0, 1 / 3)
        demand_fit("corridor_cells", self.corridor_cells, self.resolution, self.robot_radius)


def generate(key: jax.Array, spec: MazeSpec) -> Scenario:
    """One scenario with a known map that a robot of `spec.robot_radius` can solve; numpy leaves, origin (0, 0).

    The unknown squares leave the map solvable too. Movers patrol one lane of a corridor. Consumes the key:
    map, task, squares and movers take a stream each.
    """
    streams = streams_of(key)
    corridor = spec.corridor_cells
    occupied = draw_lattice(streams.map, spec.junctions, corridor, corridor, spec.extra_openings)
    return scenario_between_rooms(streams, occupied, spec, spec.resolution, spec.separation)
