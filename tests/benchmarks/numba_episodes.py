"""The closed loop in numba, as one who knows it would write it: scalar loops in double precision, compiled as a whole.

Each step is that of the yardstick (EPISODE at the top of adwa_ref.cpp), from its plans and its field, which are given.
Dimension letters: N episodes; H, W map; P key points; M discs, the still ones first; C candidates. Metres, s, radians.
"""

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numba import njit

from tests.benchmarks.inputs import Arrays
from tests.yardstick_scenarios import LOOP, LOOP_OPTIONS, TASK

SPEEDS, TURNS, HORIZON = LOOP_OPTIONS.dwa.v_samples, LOOP_OPTIONS.dwa.yaw_rate_samples, LOOP_OPTIONS.dwa.horizon_steps
RADIUS, SPEED, TURN = LOOP.robot.radius, LOOP.robot.v_max, LOOP.robot.yaw_rate_max
ACCELERATION, YAW_ACCELERATION = LOOP.robot.acceleration, LOOP.robot.yaw_acceleration
DT, CAP, SENSED = LOOP.behaviour.dt, LOOP.behaviour.clearance_cap, LOOP.behaviour.sensor_range
REACHED, PASSED, STEPS = TASK.goal_tolerance, LOOP.behaviour.keypoint_tolerance, round(TASK.time_limit / DT)
LOCAL, CLEARANCE = LOOP.weights.local_heading, LOOP.weights.clearance
VELOCITY, GLOBAL = LOOP.weights.velocity, LOOP.weights.global_heading
FAR = max(CAP, SPEED * SPEED / (2.0 * ACCELERATION))  # more clearance than this changes nothing
LATTICE = 4.0  # points of the field a metre
GOAL, HIT_KNOWN, HIT_UNKNOWN, HIT_MOVER, TIMEOUT = range(5)  # as the yardstick counts them
ON_THE_WAY = -1
AT_ONCE = 8  # episodes in one call
compiled = njit(nogil=True, fastmath=True)


class Worlds(NamedTuple):
    """Episodes to be driven, with their plans."""

    maps: np.ndarray  # [N, H, W] uint8
    fields: np.ndarray  # [N, 4(H+2), 4(W+2)] float32 [m], over a ring of occupied cells
    points: np.ndarray  # [N, P, 2] key points, the start first; the goal is the last and repeats
    discs: np.ndarray  # [N, M, 5] (x, y, vx, vy, radius)
    still: int  # of the M


def worlds_of(arrays: Arrays, key: list[list], field: Callable[[np.ndarray], np.ndarray]) -> Worlds:
    """From the yardstick's scenarios, the key points that it finds in them, and what makes its field of a map."""
    longest = max(map(len, key))
    points = [np.pad(np.array([*points[:-1], goal]), ((0, longest - len(points)), (0, 0)), mode="edge")
              for points, goal in zip(key, arrays["goal"], strict=True)]  # fmt: skip
    still = arrays["ustat"]
    resting = np.concatenate([still[..., :2], np.zeros_like(still[..., :2]), still[..., 2:]], axis=-1)
    return Worlds(arrays["maps"], np.array([field(grid) for grid in arrays["maps"]], np.float32), np.array(points),
                  np.concatenate([resting, arrays["mov"]], axis=1), still.shape[1])  # fmt: skip


def driven(worlds: Worlds, threads: int = 1) -> np.ndarray:
    """[N, 3] how each episode ended, its control steps, and the metres driven; a free thread takes some more."""
    found = np.zeros((len(worlds.maps), 3))
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(lambda first: drive_some(worlds, first, found), range(0, len(found), AT_ONCE)))
    return found


@compiled
def drive_some(worlds, first, found):
    """Fill some rows of `found`, from the first."""
    for index in range(first, min(first + AT_ONCE, len(found))):
        end, steps, metres = drive(worlds.maps[index], worlds.fields[index], worlds.points[index],
                                   worlds.discs[index].copy(), worlds.still)  # fmt: skip
        found[index, 0], found[index, 1], found[index, 2] = end, steps, metres


@compiled
def drive(occupied, field, points, discs, still):
    """(end, steps, metres) of an episode; moves the discs."""
    x, y = points[0, 0], points[0, 1]
    heading = math.atan2(points[1, 1] - y, points[1, 0] - x)
    v = turn = length = 0.0
    target, end, step = 1, ON_THE_WAY, 0
    seen, terms = np.empty_like(discs), np.empty((SPEEDS * TURNS, 4))
    while end == ON_THE_WAY and step < STEPS:
        target = next_point(x, y, points, target)
        count = sense(x, y, discs, seen)
        v, turn = decide(x, y, heading, v, turn, points[target], points[-1], field, seen[:count], terms)
        x += v * math.cos(heading) * DT
        y += v * math.sin(heading) * DT
        heading = wrapped(heading + turn * DT)
        length += v * DT
        move(discs[still:], occupied.shape)
        end = judge(x, y, occupied, discs, still, points[-1])
        step += 1
    return (TIMEOUT if end == ON_THE_WAY else end), step, length


@compiled
def next_point(x, y, points, target):
    """The first key point from the target on that is not near; the last at most."""
    while target < len(points) - 1 and math.hypot(x - points[target, 0], y - points[target, 1]) <= PASSED:
        target += 1
    return target


@compiled
def sense(x, y, discs, seen):
    """Copy the discs within range; their number. The robot's radius is added to theirs."""
    count = 0
    for disc in discs:
        if math.hypot(disc[0] - x, disc[1] - y) - disc[4] <= SENSED:
            seen[count] = disc
            seen[count, 4] += RADIUS
            count += 1
    return count


@compiled
def decide(x, y, heading, v, turn, local, goal, field, seen, terms):
    """(speed, yaw rate) of the best candidate, or of braking. terms: [C, 4] room to work in."""
    slow, fast = max(0.0, v - ACCELERATION * DT), min(SPEED, v + ACCELERATION * DT)
    left, right = max(-TURN, turn - YAW_ACCELERATION * DT), min(TURN, turn + YAW_ACCELERATION * DT)
    faster, further = (fast - slow) / (SPEEDS - 1), (right - left) / (TURNS - 1)
    rate_all(x, y, heading, slow, faster, left, further, local, goal, field, seen, terms)
    best = best_of(terms)
    if best < 0:
        wanted = wrapped(math.atan2(local[1] - y, local[0] - x) - heading) / DT
        return slow, min(max(wanted, left), right)
    return slow + best // TURNS * faster, left + best % TURNS * further


@compiled
def rate_all(x, y, heading, slow, faster, left, further, local, goal, field, seen, terms):
    """Fill in the terms of every candidate; a clearance below 0 marks one that is not admissible."""
    c, s = math.cos(heading), math.sin(heading)
    for j in range(TURNS):
        dc, ds = math.cos((left + j * further) * DT), math.sin((left + j * further) * DT)
        for i in range(SPEEDS):
            v, row = slow + i * faster, terms[i * TURNS + j]
            clear, x_end, y_end, c_end, s_end = roll_out(x, y, c, s, dc, ds, v, field, seen)
            row[1] = clear
            if clear > 0.0:
                row[0] = math.pi - angle(local[0] - x_end, local[1] - y_end, c_end, s_end)
                row[2] = v
                row[3] = math.pi - angle(goal[0] - x_end, goal[1] - y_end, c_end, s_end)


@compiled
def roll_out(x, y, c, s, dc, ds, v, field, seen):
    """(least clearance up to its cap, end, cosine and sine of the heading there); -1 once it cannot be admitted."""
    least, needed = FAR, v * v / (2.0 * ACCELERATION)
    for k in range(1, HORIZON + 1):
        x += v * c * DT
        y += v * s * DT
        c, s = c * dc - s * ds, s * dc + c * ds
        least = min(least, distance(x, y, field) - RADIUS)
        for disc in seen:
            dx, dy = x - disc[0] - k * DT * disc[2], y - disc[1] - k * DT * disc[3]
            least = min(least, math.sqrt(dx * dx + dy * dy) - disc[4])
        if least <= 0.0 or least < needed:
            return -1.0, x, y, c, s
    return min(least, CAP), x, y, c, s


@compiled
def distance(x, y, field):
    """To the nearest occupied cell, between the lattice's points."""
    rows, columns = field.shape
    across = min(max((x + 1.0) * LATTICE - 0.5, 0.0), columns - 1.0)
    up = min(max((y + 1.0) * LATTICE - 0.5, 0.0), rows - 1.0)
    i, j = min(int(up), rows - 2), min(int(across), columns - 2)
    a, b = across - j, up - i
    low = field[i, j] + a * (field[i, j + 1] - field[i, j])
    high = field[i + 1, j] + a * (field[i + 1, j + 1] - field[i + 1, j])
    return low + b * (high - low)


@compiled
def angle(dx, dy, c, s):
    """Between the direction (dx, dy) and the heading, 0 to π."""
    return math.atan2(abs(c * dy - s * dx), c * dx + s * dy)


@compiled
def best_of(terms):
    """The candidate with the largest weighted sum of terms, each over its sum; the first of equals; -1 if none."""
    sums = np.zeros(4)
    for row in terms:
        if row[1] > 0.0:
            sums += row
    shares = np.array((LOCAL, CLEARANCE, VELOCITY, GLOBAL))
    for term in range(4):
        shares[term] = shares[term] / sums[term] if sums[term] > 0.0 else 0.0
    best, most = -1, -1.0
    for index, row in enumerate(terms):
        if row[1] > 0.0:
            score = shares[0] * row[0] + shares[1] * row[1] + shares[2] * row[2] + shares[3] * row[3]
            if score > most:
                best, most = index, score
    return best


@compiled
def move(movers, shape):
    """A step onwards; mirrored where one would leave the map."""
    for mover in movers:
        for axis in range(2):
            low, high = mover[4], shape[1 - axis] - mover[4]
            mover[axis] += mover[2 + axis] * DT
            if mover[axis] < low or mover[axis] > high:
                mover[axis] = 2.0 * (low if mover[axis] < low else high) - mover[axis]
                mover[2 + axis] = -mover[2 + axis]


@compiled
def judge(x, y, occupied, discs, still, goal):
    """How the episode has ended, if it has."""
    if hits_map(x, y, occupied):
        return HIT_KNOWN
    for index, disc in enumerate(discs):
        if math.hypot(disc[0] - x, disc[1] - y) < disc[4] + RADIUS:
            return HIT_UNKNOWN if index < still else HIT_MOVER
    return GOAL if math.hypot(x - goal[0], y - goal[1]) <= REACHED else ON_THE_WAY


@compiled
def hits_map(x, y, occupied):
    """Whether the robot meets the border or an occupied cell."""
    height, width = occupied.shape
    if min(x, y, width - x, height - y) < RADIUS:
        return True
    for row in range(int(y - RADIUS), min(int(y + RADIUS) + 1, height)):
        for column in range(int(x - RADIUS), min(int(x + RADIUS) + 1, width)):
            dx, dy = max(column - x, x - column - 1.0, 0.0), max(row - y, y - row - 1.0, 0.0)
            if occupied[row, column] and dx * dx + dy * dy < RADIUS * RADIUS:
                return True
    return False


@compiled
def wrapped(turned):
    """Within [-π, π]."""
    return math.atan2(math.sin(turned), math.cos(turned))
