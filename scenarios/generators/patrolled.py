"""What blocks, rooms, mazes and a user's own map share: unknown squares and patrols on the map of a task."""

import math

import numpy as np

from adwa_jax.grid import Grid
from adwa_jax.scenario import Scenario
from scenarios.generators.assembly import Point, centre, grid_of, scenario_of
from scenarios.generators.connectivity import Cell, inflated, largest_component
from scenarios.generators.draws import Streams
from scenarios.generators.movers import patrolling_movers
from scenarios.generators.squares import place_squares
from scenarios.generators.task_spec import TaskSpec
from scenarios.generators.tasks import far_pair


def scenario_between_rooms(streams: Streams, occupied: np.ndarray, spec: TaskSpec, resolution: float,
                           separation: float) -> Scenario:
    """A scenario on a map whose largest component spans it: start and goal at least `separation` · diagonal apart.

    occupied: [H, W] bool; consumes all streams but `map`.
    """
    blocked = inflated(occupied, resolution, spec.robot_radius)
    least = separation * math.hypot(*occupied.shape)
    start, goal = far_pair(streams.task, largest_component(blocked), least)
    return patrolled_scenario(streams, grid_of(occupied, resolution), blocked, start, goal, spec, resolution)


def patrolled_scenario(streams: Streams, grid: Grid, blocked: np.ndarray, start: Cell, goal: Cell,
                       spec: TaskSpec, resolution: float, origin: Point = (0.0, 0.0)) -> Scenario:
    """The scenario from start to goal (connected cells) with its unknown squares and patrolling movers.

    grid has numpy leaves; blocked: [H, W] bool, the cells that it denies the robot; resolution [m] and origin
    [m] are the grid's. Consumes the streams `squares` and `movers`.
    """
    occupied = np.asarray(grid.occupied)
    squares = place_squares(streams.squares, occupied, blocked, start, goal, spec, resolution, origin)
    movers = patrolling_movers(streams.movers, occupied, start, goal, spec, resolution, origin)
    ends = centre(start, resolution, origin), centre(goal, resolution, origin)
    return scenario_of(grid, *ends, spec, squares, movers)
