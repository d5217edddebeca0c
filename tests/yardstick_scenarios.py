"""The scenarios of the independent C++ program, from the arrays that it reads.

Dimension letters: N scenarios; H, W map; S unknown discs; M movers.
"""

from typing import Any

import numpy as np

from adwa_jax.scenario import Scenario
from scenarios.generators.assembly import discs_in, grid_of, movers_of, scenario_of, squares_of
from scenarios.generators.task_spec import TaskSpec

TASK = TaskSpec(goal_tolerance=0.4, time_limit=60.0)  # its defaults: goaltol 0.4 m, 600 steps of 0.1 s


def scenarios_of(maps: np.ndarray, ustat: np.ndarray, mov: np.ndarray, start: np.ndarray,
                 goal: np.ndarray) -> list[Scenario]:
    """Cells of 1 m, row 0 at y = 0; the robot faces its first key point; movers' discs stay within the map.

    maps: [N, H, W] of 0 and 1; ustat: [N, S, 3] (x, y, r) of unknown discs; mov: [N, M, 5] (x, y, vx, vy, r);
    start, goal: [N, 2] (x, y). All in metres and m/s.
    """
    return [_scenario(*arrays) for arrays in zip(maps, ustat, mov, start, goal, strict=True)]


def _scenario(occupied: np.ndarray, discs: np.ndarray, movers: np.ndarray, start: np.ndarray,
              goal: np.ndarray) -> Scenario:
    height, width = occupied.shape
    radius = movers[:, 4:]
    unknown: Any = discs_in(squares_of(discs[:, :2], discs[:, 2]))
    moving: Any = movers_of(radius[:, 0], movers[:, :2], movers[:, 2:4], np.repeat(radius, 2, axis=1),
                            (width, height) - radius)
    return scenario_of(grid_of(occupied != 0, 1.0), tuple(start), tuple(goal), TASK, unknown, moving)
