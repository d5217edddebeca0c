"""The world of one episode: the known map, the task, and what the robot does not know beforehand (§4 D).

Dimension letters: H, W map; S unknown squares; M movers; J track points of a mover.
"""

from dataclasses import dataclass
from functools import partial

import jax

from adwa_jax.grid import Grid


@partial(jax.tree_util.register_dataclass, data_fields=["centre", "half_width", "rounding", "valid"],
         meta_fields=[])
@dataclass(frozen=True)
class UnknownSquares:
    """Static obstacles that are not on the map: axis-aligned squares, sharp or rounded, and discs."""

    centre: jax.Array  # [S, 2] float32, x, y [m]
    half_width: jax.Array  # [S] float32 [m]
    rounding: jax.Array  # [S] float32 [m]: the square grown by a disc of this radius; half_width 0 and r is a disc
    valid: jax.Array  # [S] bool; False is padding


@partial(jax.tree_util.register_dataclass,
         data_fields=["radius", "position", "velocity", "low", "high", "track", "track_length", "period", "valid"],
         meta_fields=[])
@dataclass(frozen=True)
class Movers:
    """Moving discs that do not react to the robot.

    A mover with `track_length` 0 starts at `position`, keeps its speed and is mirrored at the box [`low`, `high`].
    One with a track moves linearly between its track points; before the first and after the last it is absent,
    unless `period` > 0, in which case the track repeats (the track then spans [0, period]).
    """

    radius: jax.Array  # [M] float32 [m]
    position: jax.Array  # [M, 2] float32, x, y at t = 0 [m]
    velocity: jax.Array  # [M, 2] float32 at t = 0 [m/s]
    low: jax.Array  # [M, 2] float32, least x, y of the centre [m]
    high: jax.Array  # [M, 2] float32, greatest x, y of the centre [m]
    track: jax.Array  # [M, J, 3] float32, rows t [s], x [m], y [m], t increasing; padding repeats the last row
    track_length: jax.Array  # [M] int32, rows in use; 0: no track; a track has at least 2
    period: jax.Array  # [M] float32 [s]; 0: the track is run once
    valid: jax.Array  # [M] bool; False is padding


@partial(jax.tree_util.register_dataclass,
         data_fields=["grid", "hidden", "start", "heading_given", "goal", "goal_tolerance", "time_limit",
                      "reference_length", "squares", "movers"],
         meta_fields=[])
@dataclass(frozen=True)
class Scenario:
    """One episode's world and task. Unbatched; `vmap` adds a leading axis."""

    grid: Grid  # what the robot knows beforehand
    hidden: jax.Array  # [H, W] bool: occupied cells not on the robot's map until in its range; [0, 0] without any
    start: jax.Array  # [3] float32, x [m], y [m], heading [rad]
    heading_given: jax.Array  # [] bool; False: the robot starts facing its first key point
    goal: jax.Array  # [2] float32, x, y [m]
    goal_tolerance: jax.Array  # [] float32, reached within this distance [m]
    time_limit: jax.Array  # [] float32 [s]
    reference_length: jax.Array  # [] float32, path length for the BARN score [m]; 0: the A*-optimal length
    squares: UnknownSquares
    movers: Movers
