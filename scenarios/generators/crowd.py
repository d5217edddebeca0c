"""People in an open place: movers only, on made-up or recorded tracks.

Dimension letters: J track points.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import jax
import numpy as np

from adwa_jax.scenario import Movers, Scenario
from scenarios.errors import InputError
from scenarios.generators.assembly import Point, grid_of, scenario_of, squares_of, walkers_of
from scenarios.generators.draws import Draws, streams_of
from scenarios.generators.task_spec import Range, TaskSpec, demand, demand_count, demand_number, demand_range

MARGIN = 1.0
"""Recorded tracks: free ground around the box of all recorded points [m]."""
PLACE_TRIES = 32
"""Starting points looked at for a person (made-up tracks) or the robot (recorded ones); the clearest is taken."""


@dataclass(frozen=True, kw_only=True)
class CrowdSpec(TaskSpec):
    """A free square place of `side` [m] with walls around it; `movers` people cross it to and fro.

    Each person walks between two opposite sides at a steady speed, meeting them at `legs` (even) random
    points in turn and then repeating. The robot crosses too, from `inset` [m] before one side to `inset`
    before the opposite one. No person is within `mover_distance` of its start at t = 0.
    """

    side: float = 16.0
    resolution: float = 0.5
    legs: int = 6
    inset: float = 1.0
    squares: int = 0
    movers: int | None = 12
    mover_speed: Range = (0.8, 1.6)
    mover_radius: Range = (0.25, 0.35)
    mover_distance: float = 2.0

    def __post_init__(self):
        super().__post_init__()
        demand_number("side", self.side, 4.0)
        demand_number("resolution", self.resolution, 1e-3, self.side / 4)
        cells = self.side / self.resolution
        demand(abs(cells - round(cells)) < 1e-6, "side", self.side, "must be a whole number of cells",
               f"take a multiple of resolution {self.resolution:g}")
        demand_count("legs", self.legs, 2, 1000)
        demand(self.legs % 2 == 0, "legs", self.legs, "must be even: the walk closes", f"try {self.legs + 1}")
        demand_number("inset", self.inset, self.robot_radius + self.resolution, self.side / 4)
        demand_range("mover_speed", self.mover_speed, 1e-3)
        demand_range("mover_radius", self.mover_radius, 1e-3, self.side / 4)
        demand_number("mover_distance", self.mover_distance, 0.0, self.side / 4)
        demand(self.squares == 0, "squares", self.squares, "a crowd has movers only", "leave it at 0")


def generate(key: jax.Array, spec: CrowdSpec) -> Scenario:
    """One scenario with made-up people; the known map is free, hence solvable. Numpy leaves, origin (0, 0).

    Consumes the key: task and movers take a stream each.
    """
    streams = streams_of(key)
    cells = round(spec.side / spec.resolution)
    start, goal = _crossing(streams.task, (0.0, 0.0), (spec.side, spec.side), spec.inset)
    radius = [streams.movers.uniform(*spec.mover_radius) for _ in range(spec.mover_count)]
    tracks = [_walk(streams.movers, spec, each, start) for each in radius]
    movers = walkers_of(radius, tracks, [track[-1, 0] for track in tracks])
    return _in_the_open((cells, cells), (0.0, 0.0), start, goal, spec, movers)


def from_tracks(key: jax.Array, spec: CrowdSpec, tracks: Sequence[np.ndarray]) -> Scenario:
    """One scenario with recorded people: a random stretch of `spec.time_limit` seconds of the recording.

    tracks: a sequence of [J, 3] (t [s], x, y [m]), t increasing. The place is the box of all points and
    `MARGIN` around it, free, at `spec.resolution`; `side`, `movers`, `legs` and `mover_speed` of the spec do
    not apply. A person is there from the first to the last recorded point within the stretch. The robot
    crosses as in `generate`; of `PLACE_TRIES` starting points the clearest at t = 0 is taken, and a person
    still within `mover_distance` of it then is left out. Raises InputError for tracks that are none. Consumes
    the key: task and movers take a stream each.
    """
    _check_tracks(tracks)
    streams = streams_of(key)
    low, high = _extent(tracks)
    shape = tuple(int(n) for n in np.ceil((high - low) / spec.resolution)[::-1])
    high = low + np.array(shape[::-1]) * spec.resolution
    people = _stretch(streams.movers, spec.time_limit, tracks)
    inset = min(spec.inset, float(min(high - low)) / 3)
    if inset < spec.robot_radius + spec.resolution:
        raise InputError(f"robot_radius: {spec.robot_radius:g} m; too large for the place of these tracks, "
                         f"{shape[1] * spec.resolution:g} × {shape[0] * spec.resolution:g} m; take a smaller one")
    tries = [_crossing(streams.task, tuple(low), tuple(high), inset) for _ in range(PLACE_TRIES)]
    start, goal = max(tries, key=lambda ends: min(_gaps_at_start(people, ends[0]), default=math.inf))
    clear = [gap > spec.mover_distance for gap in _gaps_at_start(people, start)]
    kept = [person for person, is_clear in zip(people, clear, strict=True) if is_clear]
    radius = [streams.movers.uniform(*spec.mover_radius) for _ in kept]
    return _in_the_open(shape, tuple(low), start, goal, spec, walkers_of(radius, kept, [0.0] * len(kept)))


def _in_the_open(shape: tuple[int, ...], origin: Point, start: Point, goal: Point, spec: CrowdSpec,
                 movers: Movers) -> Scenario:
    """The scenario on a free map of `shape` (rows, columns)."""
    grid = grid_of(np.zeros(shape, np.bool_), spec.resolution, origin)
    return scenario_of(grid, start, goal, spec, squares_of([], spec.square_half_width), movers)


def _crossing(draws: Draws, low: Point, high: Point, inset: float) -> tuple[Point, Point]:
    """Start and goal on opposite sides of a box, `inset` [m] from its sides."""
    across_x, backwards = draws.index(2) == 0, draws.index(2) == 1
    along = 1 if across_x else 0
    ends = [low[1 - along] + inset, high[1 - along] - inset]
    beside = [draws.uniform(low[along] + inset, high[along] - inset) for _ in ends]
    points = [(end, side) if across_x else (side, end) for end, side in zip(ends, beside, strict=True)]
    return (points[1], points[0]) if backwards else (points[0], points[1])


def _walk(draws: Draws, spec: CrowdSpec, radius: float, robot: Point) -> np.ndarray:
    """[J, 3] one round of a person's walk, whose first point is clear of the robot."""
    speed, across_x, swap = draws.uniform(*spec.mover_speed), draws.index(2) == 0, draws.index(2)
    beside = radius + draws.uniforms(spec.legs) * (spec.side - 2 * radius)
    across = np.where((np.arange(spec.legs) + swap) % 2 == 0, radius, spec.side - radius)
    points = np.stack([across, beside] if across_x else [beside, across], axis=1)
    points[0] = _clear_point(draws, spec, radius, robot, points[0], 1 if across_x else 0)
    points = np.concatenate([points, points[:1]])
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate([np.concatenate([[0.0], np.cumsum(lengths / speed)])[:, None], points], axis=1)


def _clear_point(draws: Draws, spec: CrowdSpec, radius: float, robot: Point, point: np.ndarray,
                 axis: int) -> np.ndarray:
    """A point moved along its side until it is clear of the robot; at worst to the farthest of several."""
    best = point
    for _ in range(PLACE_TRIES):
        if math.dist(best, robot) > spec.mover_distance:
            break
        other = point.copy()
        other[axis] = draws.uniform(radius, spec.side - radius)
        best = max(best, other, key=lambda candidate: math.dist(candidate, robot))
    return best


def _check_tracks(tracks: Sequence[np.ndarray]) -> None:
    """Raises InputError unless there are tracks, each [J ≥ 2, 3], finite, t increasing."""
    if not len(tracks):
        raise InputError("tracks: none given; needs at least one [J, 3] array; load a file of tracks")
    for index, track in enumerate(tracks):
        shape = np.shape(track)
        if len(shape) != 2 or shape[0] < 2 or shape[1] != 3:
            raise InputError(f"tracks[{index}]: shape {shape}; must be [J, 3], J at least 2; give rows t, x, y")
        if not np.isfinite(track).all() or not (np.diff(np.asarray(track)[:, 0]) > 0).all():
            raise InputError(f"tracks[{index}]: times or places are out of order or not numbers; must be finite "
                             "with t increasing; sort the rows by time and drop repeated ones")


def _extent(tracks: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Low and high corner [2] of the box of all points and the margin [m]."""
    points = np.concatenate([np.asarray(track, np.float64)[:, 1:] for track in tracks])
    return points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN


def _stretch(draws: Draws, duration: float, tracks: Sequence[np.ndarray]) -> list[np.ndarray]:
    """The tracks within a random stretch of the recording, cut at its ends; t = 0 at its beginning."""
    first, last = min(track[0, 0] for track in tracks), max(track[-1, 0] for track in tracks)
    begin = draws.uniform(first, max(first, last - duration))
    seen = [track for track in tracks if track[0, 0] < begin + duration and track[-1, 0] > begin]
    cut = [_cut(np.asarray(track, np.float64), begin, begin + duration) for track in seen]
    return [track for track in cut if len(track) >= 2]


def _cut(track: np.ndarray, begin: float, end: float) -> np.ndarray:
    """[J, 3] the part of a track between two times, with points put in at the cuts; may be empty."""
    t = track[:, 0] - begin
    ends = np.array([max(0.0, t[0]), min(end - begin, t[-1])])
    times = np.concatenate([ends, t[(t > ends[0]) & (t < ends[1])]]) if ends[0] < ends[1] else ends[:0]
    times = np.unique(times.astype(np.float32)).astype(np.float64)  # increasing in the precision of the movers
    return np.stack([times, *(np.interp(times, t, track[:, axis]) for axis in (1, 2))], axis=1)


def _gaps_at_start(people: Sequence[np.ndarray], robot: Point) -> list[float]:
    """Distance [m] of each person to the robot's start at t = 0; infinite for one not there yet."""
    return [math.dist(person[0, 1:], robot) if person[0, 0] <= 0.0 else math.inf for person in people]
