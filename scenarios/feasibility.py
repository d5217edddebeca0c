"""Whether any robot can solve a scenario: a search over space and time that knows everything beforehand.

Two robots are searched for, both with perfect foresight of map, hidden cells, unknown squares and movers:

- The optimistic one may be anywhere in a cell of a lattice, turns and accelerates at once, and is in contact only if
  it would be so in every point of its cell. Where it fails, every robot of that size and top speed fails: IMPOSSIBLE.
- The conservative one goes from lattice point to lattice point, stands to turn, takes the time that its acceleration
  limits cost, and keeps `MARGIN`. Where it succeeds, commands exist that drive the real robot there: POSSIBLE.

Contact and arrival are judged as `adwa_jax.simulate.judge` does, at the end of each control step; that a robot which
waits for long counts as STUCK is left out. All distances are of the disc-shaped robot's centre.

A set of lattice points is one whole number: bit row·stride + column. A step of the whole set is then a few shifts.
Dimension letters: H, W map; Y, X rows and columns of the lattice; S unknown squares; M movers; T control steps;
K window around a mover; N scenarios.
"""

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from enum import IntEnum
from typing import NamedTuple

import jax
import numpy as np

from adwa_jax.obstacles import MoverStates, movers_at
from adwa_jax.scenario import Movers, Scenario, UnknownSquares
from adwa_jax.window import RobotLimits
from scenarios.errors import InputError
from scenarios.padding import pad, padded_shape

MARGIN = 0.02
"""By which the conservative robot stays clear of everything, beyond what its proof needs [m]."""
STRETCH = 16
"""Control steps after which the optimistic robot's way is also bounded as a whole, by a disc."""
PARTS = 2
"""For contact with statics a cell is divided so many times a side: it is free where a part is."""
CHUNK = 1 << 19
"""Lattice points, times control steps, that are held as bytes at once."""
TIMES = 256
"""Movers are looked up for whole multiples of so many times, so that few programs are compiled."""
MOST_POINTS = 1 << 26
"""Lattice points of the largest map that is searched."""
HEADINGS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))
"""(rows, columns) of a hop, counterclockwise from the x axis; odd ones are diagonal."""

Progress = Callable[[int, int], None]
"""Called with (scenarios labelled, scenarios in all) after each."""


class Feasibility(IntEnum):
    """What is proven of a scenario."""

    IMPOSSIBLE = 0  # no robot of this radius and top speed reaches the goal clear and in time, whatever it knows
    UNKNOWN = 1  # neither is proven
    POSSIBLE = 2  # from any heading, commands within the robot's limits exist that reach the goal clear and in time


class Arrival(NamedTuple):
    """Bounds of the time [s] in which the best commands reach the goal; inf: not within the time limit."""

    soonest: float  # no robot of this radius and top speed is earlier
    assured: float  # commands exist that need no longer


def feasibility(scenario: Scenario, robot: RobotLimits, dt: float = 0.1) -> Feasibility:
    """What `arrival` proves of a scenario."""
    return _proven(arrival(scenario, robot, dt))


def label(scenarios: Sequence[Scenario], robot: RobotLimits, dt: float = 0.1,
          progress: Progress | None = None) -> np.ndarray:
    """[N] int32, a `Feasibility` for each scenario."""
    labels = []
    for scenario in scenarios:
        labels.append(feasibility(scenario, robot, dt))
        if progress is not None:
            progress(len(labels), len(scenarios))
    return np.array(labels, np.int32)


def arrival(scenario: Scenario, robot: RobotLimits, dt: float = 0.1) -> Arrival:
    """When the optimistic and the conservative robot reach the goal.

    Unbatched, padded or not. robot: one disc, of which the optimistic one has radius and top speed; dt: control step
    [s]. Raises InputError for several discs, a start off the map, numbers that are not finite, and maps of more than
    `MOST_POINTS` squares of v_max·dt. Time grows with the map's area in such squares, times the control steps.
    """
    _check(scenario, robot, dt)
    moving = _mover_ways(scenario, dt)
    soonest = _soonest(scenario, robot, dt, moving)
    assured = _assured(scenario, robot, dt, moving) if math.isfinite(soonest) else math.inf
    return Arrival(soonest, assured)


def _proven(times: Arrival) -> Feasibility:
    if math.isinf(times.soonest):
        return Feasibility.IMPOSSIBLE
    return Feasibility.UNKNOWN if math.isinf(times.assured) else Feasibility.POSSIBLE


def _check(scenario: Scenario, robot: RobotLimits, dt: float) -> None:
    """Raises InputError for what cannot be searched."""
    if np.ndim(scenario.grid.occupied) != 2:
        raise InputError(f"scenario: map of {np.ndim(scenario.grid.occupied)} axes; must be one scenario, [H, W]; "
                         "take them out of the batch")
    if len(robot.disc_offsets) != 1:
        raise InputError(f"robot: {len(robot.disc_offsets)} discs; must be one; leave disc_offsets at (0.0,)")
    if not (math.isfinite(dt) and dt > 0):
        raise InputError(f"dt: {dt!r}; must be a positive number; try 0.1")
    ends = np.concatenate([np.asarray(scenario.start)[:2], np.asarray(scenario.goal)])
    if not np.isfinite(ends).all() or not np.isfinite(scenario.time_limit):
        raise InputError(f"scenario: start, goal {ends.tolist()}, time limit {scenario.time_limit}; "
                         "must be finite numbers; correct it")
    low, high = _box(scenario)
    start = ends[:2].astype(np.float64)
    if (start < low).any() or (start > high).any():
        raise InputError(f"start: {start.tolist()}; must be on the map, {low.tolist()} to {high.tolist()}; move it")


class _Ways(NamedTuple):
    """Where the movers are after each control step, from the first on."""

    position: np.ndarray  # [T, M, 2] float64 [m]
    present: np.ndarray  # [T, M] bool


def _soonest(scenario: Scenario, robot: RobotLimits, dt: float, moving: _Ways) -> float:
    """Arrival [s] of the optimistic robot, inf if it fails."""
    slack = _slack(scenario)
    lattice = _lattice(scenario, _top_speed(robot) * dt + slack)
    radius = max(float(robot.radius) - slack, 0.0)
    within = _bits(_near(lattice, _pair(scenario.goal), float(scenario.goal_tolerance) + slack,
                         -lattice.spacing / 2), lattice)
    free = _free_sets(scenario, lattice, moving, radius, radius, lattice.spacing / 2)
    for step, reached in enumerate(_reachable(free, lattice), 1):
        if reached & within:
            return step * dt
        if not reached:
            break
    return math.inf


def _reachable(free_sets: Iterator[int], lattice: "_Lattice") -> Iterator[int]:
    """After each control step, the cells in which a robot that was never in contact may be.

    A robot's steps are at most one cell side long: from a point of a cell it gets no farther than into one of the
    eight neighbours. That lets it go √2 as fast along diagonals. So every `STRETCH` steps the set is cut to the cells
    within that many steps' straight way of the set back then; it has then gone 7 % too far at most.
    """
    reached = before = 1 << lattice.index(*lattice.start)
    for step, free in enumerate(free_sets, 1):
        beside = reached | reached << 1 | reached >> 1
        reached = (beside | beside << lattice.stride | beside >> lattice.stride) & free
        if step % STRETCH == 0:
            before = reached = reached & _within_disc(before, STRETCH, lattice.stride)
        yield reached


def _within_disc(cells: int, steps: int, stride: int) -> int:
    """The cells with a point no farther than `steps` cell sides from a point of the given cells.

    Rows at distance i reach w columns to each side: max(i - 1, 0)² + max(w - 1, 0)² ≤ steps², and w, i ≤ steps, which
    the steps one by one allow.
    """
    disc, run, width = 0, cells, 0
    for row in range(steps, -1, -1):
        reach = min(steps, 1 + math.isqrt(steps**2 - max(row - 1, 0) ** 2))
        while width < reach:
            more = min(reach - width, 2 * width + 1)
            run |= run << more | run >> more
            width += more
        disc |= run << row * stride | run >> row * stride
    return disc


class _Pace(NamedTuple):
    """What the conservative robot's limits cost it."""

    start: int  # control steps that it stands longer before a straight way, and again after it
    turn: int  # control steps of a turn by 45°, standing
    first: int  # control steps of the turn by up to 180° with which it begins
    lead: float  # by which the real robot is ahead of or behind it on a straight way, at most [m]


class _Driving(NamedTuple):
    """Where the conservative robot may be after a control step; a set for each of `HEADINGS`."""

    rolling: list[int]  # at full pace
    standing: list[int]  # at rest
    free: int  # what is clear


def _assured(scenario: Scenario, robot: RobotLimits, dt: float, moving: _Ways) -> float:
    """Arrival [s] of the conservative robot, at rest in the goal's disc; inf if it fails."""
    lattice, pace, free_sets = _conservative(scenario, robot, dt, moving)
    tolerance = float(scenario.goal_tolerance) - _slack(scenario)
    within = _bits(_near(lattice, _pair(scenario.goal), max(tolerance, 0.0)), lattice)
    for step, driving in enumerate(_driven(free_sets, lattice, pace), 1):
        if any(standing & within for standing in driving.standing):
            return step * dt
    return math.inf


def _conservative(scenario: Scenario, robot: RobotLimits, dt: float,
                  moving: _Ways) -> tuple["_Lattice", _Pace, Iterator[int]]:
    """Lattice, pace and, for each control step, the points at which the conservative robot counts as clear.

    The real robot is always on the straight line of hops between points; a static obstacle at least √(r² + L²/4) from
    both ends of a hop of length L ≤ √2·spacing is at least r from all of it. From the movers' side it is within `lead`
    of the hopping robot, which halfway through a diagonal hop is spacing/√2 from the point it left.
    """
    pace = _pace(robot, dt)
    lattice = _lattice(scenario, float(robot.v_max) * dt)
    radius, spare = float(robot.radius), MARGIN + _slack(scenario)
    halfway = lattice.spacing * math.sqrt(0.5)
    free = _free_sets(scenario, lattice, moving, math.hypot(radius + spare, halfway),
                      radius + spare + halfway + pace.lead, 0.0)
    return lattice, pace, free


def _pace(robot: RobotLimits, dt: float) -> _Pace:
    """Whole control steps, within acceleration a and top speed u, yaw acceleration and top yaw rate.

    Hopping at u from rest to rest after n steps' wait, and waiting n steps at the end, takes as long as speeding up by
    a' ≤ a each step, with Σ max(u - i·a'·dt, 0) = n·u over the steps i ≥ 1, rolling at u and slowing down likewise; on
    ways too short for u, the same profile cut off in its middle covers at least the way, and slower the very way. The
    two are farthest apart after n steps, when the real robot is ahead by Σ min(i·a'·dt, u)·dt, i ≤ n.
    """
    u, gain = float(robot.v_max), float(robot.acceleration) * dt
    missing = sum(max(u - i * gain, 0.0) for i in range(1, math.ceil(u / gain) + 1))
    start = max(math.ceil(missing / u - 1e-9), 1)
    lead = sum(min(i * gain, u) for i in range(1, start + 1)) * dt
    turn, first = (_turn_steps(angle, robot, dt) for angle in (math.pi / 4, math.pi))
    return _Pace(start, turn, first, lead)


def _turn_steps(angle: float, robot: RobotLimits, dt: float) -> int:
    """The fewest control steps in which the standing robot turns by an angle [rad], from rest to rest."""
    rate, gain = float(robot.yaw_rate_max), float(robot.yaw_acceleration) * dt
    steps = 1
    while sum(min(i * gain, (steps + 1 - i) * gain, rate) for i in range(1, steps + 1)) * dt < angle:
        steps += 1
    return steps


def _driven(free_sets: Iterator[int], lattice: "_Lattice", pace: _Pace) -> Iterator[_Driving]:
    """After each control step, the points at which the conservative robot may be; ends where it may be nowhere.

    It begins with a turn on the spot to any heading. An orthogonal hop takes one control step, a diagonal one two, both
    points being clear at each instant.
    """
    start = 1 << lattice.index(*lattice.start)
    nowhere = _Driving([0] * 8, [0] * 8, 0)
    past = deque([nowhere] * (max(pace.start, pace.turn) + 2))  # past[-n]: n steps ago
    for step, free in enumerate(free_sets, 1):
        start &= free
        still = _still(past, free, pace.start), _still(past, free, pace.turn)
        standing = _standing(past, free, still, pace)
        if step == pace.first:
            standing = [start] * 8
        driving = _Driving(_rolling(past, free, still[0], lattice, pace), standing, free)
        past.append(driving)
        past.popleft()
        yield driving
        if not (start if step < pace.first else any(any(then.rolling + then.standing) for then in past)):
            return


def _still(past: Sequence[_Driving], free: int, steps: int) -> int:
    """The points that were clear at each of the last `steps` instants."""
    for back in range(1, steps):
        free &= past[-back].free
    return free


def _rolling(past: Sequence[_Driving], free: int, still: int, lattice: "_Lattice", pace: _Pace) -> list[int]:
    """A hop on, or under way after standing; a set for each heading."""
    rolling = []
    for heading, (row, column) in enumerate(HEADINGS):
        diagonal = heading % 2 == 1
        left = past[-2].rolling[heading] & past[-1].free if diagonal else past[-1].rolling[heading]
        shift = row * lattice.stride + column
        hopped = left << shift if shift > 0 else left >> -shift
        rolling.append(hopped & free | past[-pace.start].standing[heading] & still)
    return rolling


def _standing(past: Sequence[_Driving], free: int, still: tuple[int, int], pace: _Pace) -> list[int]:
    """Waiting on, halted, or turned by 45° to either side; a set for each heading."""
    before = past[-pace.turn].standing
    turned = [before[heading - 1] | before[(heading + 1) % 8] for heading in range(8)]
    return [past[-1].standing[heading] & free | past[-pace.start].rolling[heading] & still[0]
            | turned[heading] & still[1] for heading in range(8)]  # fmt: skip


class _Lattice(NamedTuple):
    """Points over the map, one of which is the robot's start; around each, a cell with sides of `spacing`."""

    x: np.ndarray  # [X] float64 [m]
    y: np.ndarray  # [Y] float64 [m]
    start: tuple[int, int]  # row, column
    spacing: float  # [m]

    @property
    def stride(self) -> int:
        """Bits a row: `STRETCH` more than columns, so that what is shifted past a row's end is in no other row."""
        return len(self.x) + STRETCH

    def index(self, row: int, column: int) -> int:
        """The bit of a point."""
        return row * self.stride + column


def _lattice(scenario: Scenario, spacing: float) -> _Lattice:
    """The lattice whose cells cover the map. Raises InputError for one too large."""
    low, high = _box(scenario)
    if np.prod((high - low) / spacing) > MOST_POINTS:
        raise InputError(f"map: {(high - low).tolist()} m; must have at most {MOST_POINTS} squares of v_max·dt = "
                         f"{spacing:g} m; cut it, or take a larger dt")
    start = np.asarray(scenario.start, np.float64)[:2]
    first, last = np.floor((low - start) / spacing).astype(int), np.ceil((high - start) / spacing).astype(int)
    x, y = (start[axis] + spacing * np.arange(first[axis], last[axis] + 1) for axis in (0, 1))
    return _Lattice(x, y, (-int(first[1]), -int(first[0])), spacing)


def _box(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Low and high corner [2] float64 of the map without padding [m]."""
    grid = scenario.grid
    low = np.asarray(grid.origin, np.float64)
    return low, low + np.array([int(grid.width), int(grid.height)]) * float(grid.resolution)


def _slack(scenario: Scenario) -> float:
    """More than the errors in float32 of positions, of steps and distances, and of movers' ways at up to 10 m/s [m]."""
    farthest = max(float(np.abs(corner).max()) for corner in _box(scenario))
    return 1e-4 + 1e-6 * (farthest + float(scenario.time_limit))


def _top_speed(robot: RobotLimits) -> float:
    return max(float(robot.v_max), -float(robot.v_min))


def _pair(point: jax.Array) -> tuple[float, float]:
    x, y = np.asarray(point, np.float64)
    return float(x), float(y)


def _near(lattice: _Lattice, centre: tuple[float, float], distance: float, half: float = 0.0) -> np.ndarray:
    """[Y, X] bool: points within a distance [m] of `centre`.

    half > 0: all of the square with that half width [m] around the point is; half < 0: some point of the square
    with half width -half is.
    """
    dx, dy = (_gap(line, middle, -half) for line, middle in zip((lattice.x, lattice.y), centre, strict=True))
    return dy[:, None] ** 2 + dx**2 <= distance**2


def _bits(points: np.ndarray, lattice: _Lattice) -> int:
    """The set of points [Y, X] bool."""
    padded = np.pad(points, ((0, 0), (0, lattice.stride - points.shape[1])))
    return int.from_bytes(np.packbits(padded, bitorder="little").tobytes(), "little")


def _free_sets(scenario: Scenario, lattice: _Lattice, moving: _Ways, static_radius: float,
               mover_radius: float, half: float) -> Iterator[int]:
    """For each control step the points whose square of half width `half` [m] is not all in contact.

    All in contact: with one mover, or each of its parts with one static obstacle. Statics count as touched nearer than
    static_radius [m] to the centre of the robot, movers nearer than mover_radius [m] to their outlines.
    """
    clear = np.zeros((len(lattice.y), lattice.stride), np.bool_)
    clear[:, : len(lattice.x)] = ~_static_contact(scenario, lattice, static_radius, half)
    reach = mover_radius + np.asarray(scenario.movers.radius, np.float64)
    together = max(CHUNK // clear.size, 1)
    for begin in range(0, len(moving.present), together):
        part = _Ways(*(field[begin : begin + together] for field in moving))
        free = np.repeat(clear.reshape(1, -1), len(part.present), axis=0)
        step, point = _mover_contact(part, reach, lattice, half)
        free[step, point] = False
        for row in np.packbits(free, axis=1, bitorder="little"):
            yield int.from_bytes(row.tobytes(), "little")


def _static_contact(scenario: Scenario, lattice: _Lattice, radius: float, half: float) -> np.ndarray:
    """[Y, X] bool: points of which all parts are in contact with a cell, the border or an unknown square."""
    parts = PARTS if half > 0 else 1
    offset = half * ((2 * np.arange(parts) + 1) / parts - 1)
    x, y = ((line[:, None] + offset).ravel() for line in (lattice.x, lattice.y))
    contact = _cell_contact(scenario, x, y, radius, half / parts)
    contact |= _square_contact(scenario.squares, x, y, radius, half / parts)
    return np.all(contact.reshape(len(lattice.y), parts, len(lattice.x), parts), axis=(1, 3))


def _square_contact(squares: UnknownSquares, x: np.ndarray, y: np.ndarray, radius: float, half: float) -> np.ndarray:
    """[Y, X] bool: points (x, y) in contact with an unknown square."""
    contact = np.zeros((len(y), len(x)), np.bool_)
    fields = map(np.asarray, (squares.centre, squares.half_width, squares.rounding, squares.valid))
    for centre, half_width, rounding, valid in zip(*fields, strict=True):
        if valid:
            dx, dy = (_gap(line, float(middle), float(half_width) - half)
                      for line, middle in zip((x, y), centre, strict=True))  # fmt: skip
            contact |= dy[:, None] ** 2 + dx**2 < (radius + float(rounding)) ** 2
    return contact


def _cell_contact(scenario: Scenario, x: np.ndarray, y: np.ndarray, radius: float, half: float) -> np.ndarray:
    """[Y, X] bool: points (x, y) in contact with cells of the map, known or hidden; beyond its border all are occupied.

    Looks at the cells around each point's own, one offset after the other.
    """
    grid = scenario.grid
    height, width, side = int(grid.height), int(grid.width), float(grid.resolution)
    occupied = np.asarray(grid.occupied)[:height, :width]
    if np.size(scenario.hidden):
        occupied = occupied | np.asarray(scenario.hidden)[:height, :width]
    ringed = np.pad(occupied, 1, constant_values=True)
    low = _box(scenario)[0]
    contact = np.zeros((len(y), len(x)), np.bool_)
    offsets = range(-math.ceil(radius / side), math.ceil(radius / side) + 1)
    columns = [_neighbours(x - low[0], offset, width, side, half) for offset in offsets]
    for offset in offsets:
        row, dy = _neighbours(y - low[1], offset, height, side, half)
        beside = ringed[row]
        for column, dx in columns:
            contact |= beside[:, column] & (dy[:, None] ** 2 + dx**2 < radius**2)
    return contact


def _neighbours(place: np.ndarray, offset: int, count: int, side: float,
                half: float) -> tuple[np.ndarray, np.ndarray]:
    """Along one axis of a map ringed by a cell: for each place [m] the cell `offset` from its own, and the gap [m]."""
    cell = np.floor(place / side).astype(int) + offset
    return np.clip(cell, -1, count) + 1, _gap(place, (cell + 0.5) * side, side / 2 - half)


def _gap(place: np.ndarray, middle: np.ndarray | float, half_width: float) -> np.ndarray:
    """How far places lie outside the interval middle ± half_width along one axis [m].

    A half width less by h gives the greatest gap within h of the place: so a square is all in contact.
    """
    return np.maximum(np.abs(place - middle) - half_width, 0.0)


def _mover_ways(scenario: Scenario, dt: float) -> _Ways:
    """The movers after each control step up to the time limit."""
    steps = max(int(np.round(np.float32(scenario.time_limit) / np.float32(dt))), 1)
    times = np.arange(1, -(-steps // TIMES) * TIMES + 1, dtype=np.float32) * np.float32(dt)
    movers = pad(scenario, padded_shape(scenario)).movers
    count = len(scenario.movers.valid)
    states = _movers_at_all(movers, jax.device_put(times))
    position = np.asarray(states.position, np.float64)[:steps, :count]
    return _Ways(position, np.asarray(states.present)[:steps, :count])


@jax.jit
def _movers_at_all(movers: Movers, times: jax.Array) -> MoverStates:
    return jax.vmap(movers_at, in_axes=(None, 0))(movers, times)


def _mover_contact(moving: _Ways, reach: np.ndarray, lattice: _Lattice,
                   half: float) -> tuple[np.ndarray, np.ndarray]:
    """Control steps and bits of the points in contact with movers; reach: [M], least distance of the centres [m]."""
    wide = math.ceil(reach.max(initial=0.0) / lattice.spacing)
    column, dx = _windows(moving.position[..., 0], lattice.x, wide, half)
    row, dy = _windows(moving.position[..., 1], lattice.y, wide, half)
    near = dy[..., :, None] ** 2 + dx[..., None, :] ** 2 < (reach**2)[:, None, None]
    near &= moving.present[..., None, None]
    step, mover, r, c = np.nonzero(near)
    return step, row[step, mover, r] * lattice.stride + column[step, mover, c]


def _windows(centre: np.ndarray, line: np.ndarray, wide: int, half: float) -> tuple[np.ndarray, np.ndarray]:
    """Indices [T, M, K] of the points of a line around each centre [T, M], and gaps; off the lattice, inf."""
    spacing = line[1] - line[0]
    index = np.floor((centre - line[0]) / spacing).astype(int)[..., None] + np.arange(-wide, wide + 2)
    gap = np.abs(line[0] + index * spacing - centre[..., None]) + half
    return index, np.where((index >= 0) & (index < len(line)), gap, np.inf)
