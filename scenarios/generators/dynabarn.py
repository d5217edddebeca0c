"""The task of the DynaBARN benchmark: cross a walled square among discs that move along key frames over and over.

Same frame as the benchmark's worlds, which `scenarios.formats.load_dynabarn` reads.
Dimension letters: J track points.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import jax
import numpy as np

from adwa_jax.scenario import Scenario
from scenarios.generators.assembly import grid_of, scenario_of, squares_of, walkers_of
from scenarios.generators.draws import streams_of
from scenarios.generators.task_spec import TaskSpec, demand

OBSTACLE_RADIUS = 0.5
"""Of every mover [m]."""
START, HEADING, GOAL = (11.0, 0.0), math.pi, (-9.0, 0.0)
"""Start and goal (x, y) [m], heading [rad]."""
LOW, HIGH = (-10.0, -10.0), (13.0, 10.0)
"""Corners of the map, x, y [m]: walls at x = -10 and y = ±10; behind the start it is open, and ends at x = 13."""
RESOLUTION = 0.5
"""Side of a cell [m]."""
LATEST = 600
"""Episodes begin less than so long after the world [s]; obstacles have periods of 12 to 88 s of their own."""
STEP = 0.01
"""The least between the times of key frames [s]."""
JUMP = 1e-3
"""How long a mover takes from its last key frame back to its way from the first [s]; less than `STEP`."""
START_TRIES = 32
"""Times looked at before the one at which the start is clearest is taken."""


@dataclass(frozen=True, kw_only=True)
class DynabarnSpec(TaskSpec):
    """The benchmark's task. No mover's centre is within `mover_distance` of the start at t = 0."""

    robot_radius: float = 0.3
    goal_tolerance: float = 1.0
    squares: int = 0
    movers: int | None = 0
    mover_distance: float = 1.3

    def __post_init__(self):
        super().__post_init__()
        demand(self.squares == 0 and self.mover_count == 0, "squares, movers", (self.squares, self.movers),
               "movers are those of the world", "leave both at 0")


def generate(key: jax.Array, spec: DynabarnSpec, tracks: Sequence[np.ndarray]) -> Scenario:
    """One scenario that begins at a random time less than `LATEST` after the world; numpy leaves, a free map.

    tracks: [J, 3] (t [s], x, y [m]), t from 0 to the mover's own period, `STEP` apart or more. Of `START_TRIES` times
    the first at which the start is clear is taken, or the clearest. Consumes the key: all of it goes to the time.
    """
    draws = streams_of(key).task
    times = (STEP * (draws.index(round(LATEST / STEP)) + 0.5) for _ in range(START_TRIES))
    return beginning_at(_clear_time(times, spec.mover_distance, tracks), spec, tracks)


def beginning_at(offset: float, spec: DynabarnSpec, tracks: Sequence[np.ndarray]) -> Scenario:
    """The scenario that begins `offset` [s] after the world: 0, or half-way between two multiples of `STEP`."""
    rows, columns = (round((HIGH[axis] - LOW[axis]) / RESOLUTION) for axis in (1, 0))
    grid = grid_of(np.zeros((rows, columns), np.bool_), RESOLUTION, LOW)
    radius, period = [OBSTACLE_RADIUS] * len(tracks), [float(track[-1, 0]) for track in tracks]
    movers = walkers_of(radius, [shifted(track, offset) for track in tracks], period)
    return scenario_of(grid, START, GOAL, spec, squares_of([], spec.square_half_width), movers, heading=HEADING)


def shifted(track: np.ndarray, offset: float) -> np.ndarray:
    """The repeating track seen from `offset` [s] on, from t = 0 to its period; [J, 3] or a few rows more.

    The cut puts a row at both ends. Where the period ended the mover takes `JUMP` to get back on its way, and is on
    time again after that; with an offset half-way between two multiples of `STEP`, no control step falls into it.
    """
    period = track[-1, 0]
    cut = offset % period
    if cut == 0.0:
        return track
    here = position_at(track, cut)
    later = track[track[:, 0] > cut] - (cut, 0.0, 0.0)
    earlier = track[track[:, 0] < cut] + (period - cut, 0.0, 0.0)
    jump = min(JUMP, cut / 2)
    earlier[0] = period - cut + jump, *position_at(track, jump)
    return np.concatenate([[(0.0, *here)], later, earlier, [(period, *here)]])


def position_at(track: np.ndarray, time: float) -> tuple[float, float]:
    """(x, y) [m] on a repeating track at a time [s] ≥ 0."""
    now = time % track[-1, 0]
    return float(np.interp(now, track[:, 0], track[:, 1])), float(np.interp(now, track[:, 0], track[:, 2]))


def _clear_time(times: Iterable[float], distance: float, tracks: Sequence[np.ndarray]) -> float:
    """The first time [s] at which all movers are farther than `distance` [m] from the start, or the clearest."""
    gaps: dict[float, float] = {}
    for time in times:
        gaps[time] = min(math.dist(position_at(track, time), START) for track in tracks)
        if gaps[time] > distance:
            return time
    return max(gaps, key=lambda time: gaps[time])
