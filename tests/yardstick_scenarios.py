"""The independent C++ program's scenarios, from the arrays that it reads, its constants, field and outcomes.

Dimension letters: N scenarios; H, W map; S unknown discs; M movers.
"""

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.episode import Outcome
from adwa_jax.grid import BILINEAR_EXCESS, DistanceField, Grid, distance_field
from adwa_jax.presets import paper
from adwa_jax.scenario import Scenario
from scenarios.generators.assembly import discs_in, grid_of, movers_of, scenario_of, squares_of
from scenarios.generators.task_spec import TaskSpec

TASK = TaskSpec(goal_tolerance=0.4, time_limit=60.0)  # its defaults: goaltol 0.4 m, 600 steps of 0.1 s
LOOP = replace(
    paper().constants,
    robot=replace(paper().constants.robot, yaw_brake=1e9),  # its admissibility has no limit on turning
    behaviour=replace(paper().constants.behaviour, stuck_time=1e3),  # nor does it know STUCK
)
LOOP_OPTIONS = paper().options
SAME_END = {
    Outcome.REACHED: 0, Outcome.HIT_KNOWN: 1, Outcome.HIT_UNKNOWN: 2, Outcome.HIT_MOVER: 3, Outcome.STUCK: 4,
    Outcome.TIMEOUT: 4, Outcome.NO_PATH: 5,
}  # fmt: skip


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


def episode_options() -> list[str]:
    """`LOOP` and `LOOP_OPTIONS` in its words."""
    weights, robot, behaviour, dwa = LOOP.weights, LOOP.robot, LOOP.behaviour, LOOP_OPTIONS.dwa
    options = {
        "H": dwa.horizon_steps, "nv": dwa.v_samples, "nw": dwa.yaw_rate_samples, "norm": dwa.normalisation,
        "wl": weights.local_heading, "wD": weights.clearance, "wv": weights.velocity, "wg": weights.global_heading,
        "dcap": behaviour.clearance_cap, "los": behaviour.clearance_margin, "kptol": behaviour.keypoint_tolerance,
        "range": behaviour.sensor_range, "dt": behaviour.dt, "rr": robot.radius, "vmax": robot.v_max,
        "wmax": robot.yaw_rate_max, "amax": robot.acceleration, "alpha": robot.yaw_acceleration,
    }  # fmt: skip
    return [word for name, value in options.items() for word in (f"--{name}", str(value))]


def key_points_of(key: list, world: Scenario) -> np.ndarray:
    """[P, 2] its key points with the goal itself as the last, which repeats."""
    points = np.float32([*key[:-1], world.goal])
    return np.pad(points, ((0, world.grid.occupied.size - len(points)), (0, 0)), mode="edge")


def field_of(occupied: jax.Array) -> DistanceField:
    """Its lattice lies half a step off ours, over a ring of occupied cells, and its look-up is not lowered."""
    ringed = jnp.pad(occupied.astype(bool), 1, constant_values=True)
    side = jnp.int32(ringed.shape[0])
    fine = distance_field(Grid(ringed, side, side, jnp.float32(1.0), jnp.full(2, -1.0)), subdivision=8)
    return DistanceField(fine.distance[1::2, 1::2] + BILINEAR_EXCESS * 0.25, jnp.float32(0.25), jnp.full(2, -0.875))
