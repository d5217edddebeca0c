"""Rectangular blocks, dropped until a density is reached."""

import math
from dataclasses import dataclass

import jax
import numpy as np

from adwa_jax.scenario import Scenario
from scenarios.generators.assembly import grid_of
from scenarios.generators.connectivity import Cell, border_cells, carved, inflated, largest_component
from scenarios.generators.draws import Draws, streams_of
from scenarios.generators.patrolled import patrolled_scenario
from scenarios.generators.task_spec import TaskSpec, demand, demand_count, demand_number
from scenarios.generators.tasks import far_pair

MAP_TRIES = 8
"""Maps drawn before a corridor is carved into the last one."""


@dataclass(frozen=True, kw_only=True)
class BlocksSpec(TaskSpec):
    """A `cells` × `cells` map with blocks of 1 … `longest_side` cells a side, which may overlap.

    Blocks fall until their share of the map is at least `density`. Start and goal are random cells, at least
    `separation` times the map's diagonal apart. Cells are `resolution` [m] wide.
    """

    cells: int = 32
    resolution: float = 1.0
    density: float = 0.2
    longest_side: int = 4
    separation: float = 1 / 3
    time_limit: float = 120.0

    def __post_init__(self):
        super().__post_init__()
        demand_count("cells", self.cells, 8, 4096)
        demand_number("resolution", self.resolution, 1e-3)
        demand_number("density", self.density, 0.0, 0.9)
        demand_count("longest_side", self.longest_side, 1, self.cells)
        demand_number("separation", self.separation, 0.0, 0.5)
        room = self.cells - 2 * border_cells(self.resolution, self.robot_radius)
        demand(2 * room >= self.cells, "robot_radius", self.robot_radius,
               "it must have at least half of the map's side between the borders", "take a smaller radius")


def generate(key: jax.Array, spec: BlocksSpec) -> Scenario:
    """One scenario with a known map that a robot of `spec.robot_radius` can solve; numpy leaves, origin (0, 0).

    The unknown squares leave the map solvable too. Movers patrol free lanes. Consumes the key: map, task,
    squares and movers take a stream each.
    """
    streams = streams_of(key)
    occupied, start, goal = _draw_task(streams.map, streams.task, spec)
    blocked = inflated(occupied, spec.resolution, spec.robot_radius)
    grid = grid_of(occupied, spec.resolution)
    return patrolled_scenario(streams, grid, blocked, start, goal, spec, spec.resolution)


def _draw_task(draws: Draws, task: Draws, spec: BlocksSpec) -> tuple[np.ndarray, Cell, Cell]:
    """A map with start and goal in its largest component; dense maps may need several tries."""
    least = spec.separation * math.sqrt(2) * spec.cells
    occupied = np.zeros((spec.cells, spec.cells), np.bool_)
    for _ in range(MAP_TRIES):
        occupied = _drop_blocks(draws, spec)
        cells = largest_component(inflated(occupied, spec.resolution, spec.robot_radius))
        if len(cells) >= 2:
            start, goal = far_pair(task, cells, least)
            if math.dist(start, goal) >= least:
                return occupied, start, goal
    first = border_cells(spec.resolution, spec.robot_radius)
    last = spec.cells - 1 - first
    start, goal = (first, first), (last, last)
    return carved(draws, occupied, start, goal, spec.resolution, spec.robot_radius), start, goal


def _drop_blocks(draws: Draws, spec: BlocksSpec) -> np.ndarray:
    """[H, W] bool; a block that reaches over the border is cut off there."""
    occupied = np.zeros((spec.cells, spec.cells), np.bool_)
    missing = math.ceil(spec.density * occupied.size)
    while missing > 0:
        height, width = 1 + draws.index(spec.longest_side), 1 + draws.index(spec.longest_side)
        row, column = draws.index(spec.cells + height - 1), draws.index(spec.cells + width - 1)
        block = occupied[max(0, row - height + 1) : row + 1, max(0, column - width + 1) : column + 1]
        missing -= block.size - int(np.count_nonzero(block))
        block[:] = True
    return occupied
