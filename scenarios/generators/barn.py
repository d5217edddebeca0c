"""Worlds in the manner of the BARN benchmark (Perille, Truong, Xiao, Stone 2020): a cellular automaton.

A field of 30 × 30 cells of 0.15 m is filled at random and smoothed: a cell with more than 4 of its 8
neighbours filled becomes filled, one with fewer than 2 becomes empty, others stay. The two side columns start
filled and what lies beyond them counts as filled; what lies beyond the field's ends counts as empty. The
benchmark's 300 worlds are 25 for each pair of a fill share in {0.15, 0.20, 0.25, 0.30} and 2, 3 or 4
smoothings.

Same frame as the benchmark's worlds as `scenarios.formats` loads them: x from -4.5 m, y from 0; 34 rows of a
walled entry corridor, the field, then 32 rows, walled at the sides, to beyond the goal.
"""

import math
from dataclasses import dataclass

import jax
import numpy as np

from adwa_jax.scenario import Scenario
from scenarios.generators.assembly import grid_of, movers_of, scenario_of, squares_of
from scenarios.generators.connectivity import Cell, carved, inflated, joined
from scenarios.generators.draws import Draws, streams_of
from scenarios.generators.task_spec import TaskSpec, demand, demand_count, demand_number

RESOLUTION = 0.15
"""Side of a cell [m]."""
ORIGIN = (-4.5, 0.0)
"""Outer corner of cell (0, 0) [m]."""
FIELD_CELLS = 30
ENTRY_ROWS = 34
EXIT_ROWS = 32
START, HEADING, GOAL = (-2.25, 3.0), math.pi / 2, (-2.25, 13.0)
"""Start and goal (x, y) [m], heading [rad]."""
FILL_ABOVE, CLEAR_BELOW = 4, 2
"""A cell with more filled neighbours than the first is filled, with fewer than the second emptied."""
MAP_TRIES = 16
"""Fields drawn before a corridor is carved into the last one."""


@dataclass(frozen=True, kw_only=True)
class BarnSpec(TaskSpec):
    """Each world takes one of the `fill` shares and one of the `smoothings`, at random.

    A world without a path for `robot_radius` is drawn again. No unknown squares and no movers.
    """

    fill: tuple[float, ...] = (0.15, 0.20, 0.25, 0.30)
    smoothings: tuple[int, ...] = (2, 3, 4)
    robot_radius: float = 0.3
    goal_tolerance: float = 1.0
    time_limit: float = 100.0
    squares: int = 0
    movers: int | None = 0

    def __post_init__(self):
        super().__post_init__()
        demand(len(self.fill) > 0, "fill", self.fill, "needs at least one share", "try (0.2,)")
        demand(len(self.smoothings) > 0, "smoothings", self.smoothings, "needs at least one", "try (4,)")
        for share in self.fill:
            demand_number("fill", share, 0.0, 0.9)
        for count in self.smoothings:
            demand_count("smoothings", count, 0, 100)
        demand(self.robot_radius <= 1.5, "robot_radius", self.robot_radius,
               "the corridor is 4.2 m wide, and the carved way must fit into it", "take at most 1.5 m")
        demand(self.squares == 0 and self.mover_count == 0, "squares, movers", (self.squares, self.movers),
               "BARN worlds have neither", "leave both at 0")


def generate(key: jax.Array, spec: BarnSpec) -> Scenario:
    """One scenario with a known map that a robot of `spec.robot_radius` can solve; numpy leaves.

    The heading is given (+y). Consumes the key: all of it goes to the map.
    """
    occupied = _draw_map(streams_of(key).map, spec)
    grid = grid_of(occupied, RESOLUTION, ORIGIN)
    squares, movers = squares_of([], spec.square_half_width), movers_of([], [], [], [], [])
    return scenario_of(grid, START, GOAL, spec, squares, movers, heading=HEADING)


def _draw_map(draws: Draws, spec: BarnSpec) -> np.ndarray:
    """[H, W] bool, start and goal connected."""
    start, goal = _cell_of(START), _cell_of(GOAL)
    fill = spec.fill[draws.index(len(spec.fill))]
    smoothings = spec.smoothings[draws.index(len(spec.smoothings))]
    occupied = np.zeros((ENTRY_ROWS + FIELD_CELLS + EXIT_ROWS, FIELD_CELLS), np.bool_)
    occupied[0] = occupied[:, 0] = occupied[:, -1] = True
    for _ in range(MAP_TRIES):
        occupied[ENTRY_ROWS : ENTRY_ROWS + FIELD_CELLS] = _draw_field(draws, fill, smoothings)
        if joined(inflated(occupied, RESOLUTION, spec.robot_radius), start, goal):
            return occupied
    return carved(draws, occupied, start, goal, RESOLUTION, spec.robot_radius)


def _draw_field(draws: Draws, fill: float, smoothings: int) -> np.ndarray:
    """[30, 30] bool, row along y, column along x."""
    field = draws.uniforms(FIELD_CELLS, FIELD_CELLS) < fill
    field[:, 0] = field[:, -1] = True
    for _ in range(smoothings):
        neighbours = _filled_neighbours(field)
        field = (field | (neighbours > FILL_ABOVE)) & (neighbours >= CLEAR_BELOW)
    return field


def _filled_neighbours(field: np.ndarray) -> np.ndarray:
    """[30, 30] int8: how many of the 8 neighbours are filled; all beyond the sides are, none beyond the ends."""
    ringed = np.pad(field.astype(np.int8), ((1, 1), (0, 0)))
    ringed = np.pad(ringed, ((0, 0), (1, 1)), constant_values=1)
    rows = ringed[:-2] + ringed[1:-1] + ringed[2:]
    return rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:] - field


def _cell_of(point: tuple[float, float]) -> Cell:
    """(row, column) of the cell that holds a point [m]."""
    return int((point[1] - ORIGIN[1]) / RESOLUTION), int((point[0] - ORIGIN[0]) / RESOLUTION)
