"""The maps of the paper's simulations (§5): square, from upper left to lower right, obstacles cell by cell."""

from dataclasses import dataclass

import jax
import numpy as np

from adwa_jax.scenario import Scenario
from scenarios.generators.assembly import centre, discs_in, grid_of, scenario_of
from scenarios.generators.connectivity import carved, joined
from scenarios.generators.draws import Draws, streams_of
from scenarios.generators.movers import crossing_movers
from scenarios.generators.squares import place_squares
from scenarios.generators.task_spec import TaskSpec, demand, demand_count, demand_number

RESOLUTION = 1.0
"""Side of a cell [m]; the paper's lengths are in cells."""
MAP_TRIES = 16
"""Maps drawn before a corridor is carved into the last one."""


@dataclass(frozen=True, kw_only=True)
class PaperSpec(TaskSpec):
    """A map of `cells` × `cells` of 1 m, each an obstacle with probability `density`, start and goal never.

    The paper prints maps of 15, 20 and 25 cells but neither density nor counts of obstacles: those are our
    choice. `movers` None: 8 on 25 × 25 cells and in proportion to the area (3 on 15², 5 on 20²). `time_limit`
    is some 2.5 times what a robot of 1 m/s needs across 25 cells a side; larger maps want about 4 s a cell.
    Unknown obstacles are squares, or discs (`unknown_shape`) of `square_half_width` around the same centres.
    """

    cells: int = 25
    density: float = 0.2
    movers: int | None = None
    unknown_shape: str = "square"
    time_limit: float = 100.0

    def __post_init__(self):
        demand_count("cells", self.cells, 8, 4096)
        super().__post_init__()
        demand_number("density", self.density, 0.0, 0.9)
        demand(self.unknown_shape in ("square", "disc"), "unknown_shape", self.unknown_shape, "must be square or disc",
               "choose one")
        demand(self.robot_radius < RESOLUTION / 2, "robot_radius", self.robot_radius,
               "the robot must fit into a cell, half of 1 m to each side", "take less than 0.5 m")
        demand(self.mover_radius[1] <= self.cells / 4, "mover_radius", self.mover_radius,
               "a mover must be at most half as wide as the map", "take a smaller radius or more cells")

    @property
    def mover_count(self) -> int:
        """As given, or in proportion to the area."""
        return round(8 * (self.cells / 25) ** 2) if self.movers is None else self.movers


def generate(key: jax.Array, spec: PaperSpec) -> Scenario:
    """One scenario with a known map that a robot of `spec.robot_radius` can solve; numpy leaves, origin (0, 0).

    The unknown squares leave the map solvable too. Movers cross the whole map in straight lines, mirrored at
    its border. Consumes the key: map, squares and movers take a stream each, so none changes another.
    """
    streams = streams_of(key)
    start, goal = (spec.cells - 1, 0), (0, spec.cells - 1)
    occupied = _draw_map(streams.map, spec, start, goal)
    squares = place_squares(streams.squares, occupied, occupied, start, goal, spec, RESOLUTION)
    if spec.unknown_shape == "disc":
        squares = discs_in(squares)
    movers = crossing_movers(streams.movers, occupied, start, goal, spec, RESOLUTION)
    ends = centre(start, RESOLUTION), centre(goal, RESOLUTION)
    return scenario_of(grid_of(occupied, RESOLUTION), *ends, spec, squares, movers)


def _draw_map(draws: Draws, spec: PaperSpec, start: tuple[int, int], goal: tuple[int, int]) -> np.ndarray:
    """[H, W] bool, start and goal connected; the robot, narrower than a cell, fits into every free one."""
    occupied = np.zeros((spec.cells, spec.cells), np.bool_)
    for _ in range(MAP_TRIES):
        occupied = draws.uniforms(spec.cells, spec.cells) < spec.density
        occupied[start] = occupied[goal] = False
        if joined(occupied, start, goal):
            return occupied
    return carved(draws, occupied, start, goal, RESOLUTION, spec.robot_radius)
