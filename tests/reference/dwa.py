"""One decision of the improved DWA (§3) in double precision and plain loops."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Robot:
    """Limits [m, s, rad]; brake and yaw_brake are the decelerations of the admissibility test."""

    v_min: float
    v_max: float
    yaw_rate_max: float
    a_max: float
    yaw_a_max: float
    brake: float
    yaw_brake: float
    radius: float


@dataclass(frozen=True)
class Weights:
    local_heading: float
    clearance: float
    velocity: float
    global_heading: float


@dataclass(frozen=True)
class Candidate:
    v: float
    yaw_rate: float
    clearance: float  # least over the rollout, outline to obstacle, not capped
    admissible: bool
    terms: tuple  # local heading, capped clearance, velocity, global heading
    score: float  # -inf where not admissible


@dataclass(frozen=True)
class Decision:
    v: float
    yaw_rate: float
    index: int  # -1: no admissible candidate, braking
    candidates: tuple


def wrap(angle):
    """The same angle in (-π, π]."""
    while angle > math.pi:
        angle -= 2 * math.pi
    while angle <= -math.pi:
        angle += 2 * math.pi
    return angle


def samples(now, reach, least, most, count):
    """Eq. 6 along one axis: [now ± reach] ∩ [least, most], evenly sampled, endpoints included (count ≥ 2)."""
    low, high = max(least, now - reach), min(most, now + reach)
    if low > high:  # beyond the limits: the one reachable value nearest to them
        low = high = now - reach if now > most else now + reach
    return [low + i * (high - low) / (count - 1) for i in range(count)]


def rollout(pose, v, yaw_rate, dt, steps):
    """Eq. 7: poses after steps 1…K of forward Euler, the heading updated last and not wrapped."""
    x, y, heading = pose
    poses = []
    for _ in range(steps):
        x += v * math.cos(heading) * dt
        y += v * math.sin(heading) * dt
        heading += yaw_rate * dt
        poses.append((x, y, heading))
    return poses


def square_distance(x, y, centre, half_width):
    """Distance from a point to an axis-aligned square, zero inside."""
    return math.hypot(max(abs(x - centre[0]) - half_width, 0.0), max(abs(y - centre[1]) - half_width, 0.0))


def rollout_clearance(poses, dt, radius, static_distance, squares, movers):
    """Least distance from the outline to anything over points k = 1…K, each mover as it will be at k·dt.

    squares: (centre, half_width); movers: (position, velocity, radius), those sensed only.
    """
    least = math.inf
    for k, (x, y, _) in enumerate(poses, start=1):
        gaps = [static_distance(x, y)]
        gaps += [square_distance(x, y, centre, half_width) for centre, half_width in squares]
        for position, velocity, mover_radius in movers:
            there = (position[0] + k * dt * velocity[0], position[1] + k * dt * velocity[1])
            gaps.append(math.hypot(x - there[0], y - there[1]) - mover_radius)
        least = min(least, min(gaps) - radius)
    return least


def heading_term(pose, target):
    """π − |angle between the end heading and the bearing from the end to the target|; π on the target."""
    if (pose[0], pose[1]) == (target[0], target[1]):
        return math.pi
    bearing = math.atan2(target[1] - pose[1], target[0] - pose[0])
    return math.pi - abs(wrap(bearing - pose[2]))


def is_admissible(v, yaw_rate, clearance, robot):
    """Clear, and able to stop and to stop turning within the clearance; in reverse as well as forwards."""
    return (clearance > 0 and abs(v) <= math.sqrt(2 * clearance * robot.brake)
            and abs(yaw_rate) <= math.sqrt(2 * clearance * robot.yaw_brake))


def normalised(values, admissible, rule, scale):
    """One term of all candidates, divided as the rule says; 0 where the divisor is 0."""
    kept = [value for value, good in zip(values, admissible, strict=True) if good]
    if rule == "none":
        return [value / scale for value in values]
    if rule == "sum":
        offset, divisor = 0.0, sum(kept)
    else:
        offset, divisor = min(kept), max(kept) - min(kept)
    return [(value - offset) / divisor if divisor else 0.0 for value in values]


def brake(v_samples, yaw_samples, pose, local_target, dt):
    """The speed of the window nearest to zero, turning to the local target as the window allows."""
    wanted = wrap(math.atan2(local_target[1] - pose[1], local_target[0] - pose[0]) - pose[2]) / dt
    return min(max(0.0, v_samples[0]), v_samples[-1]), min(max(wanted, yaw_samples[0]), yaw_samples[-1])


def decide(pose, v, yaw_rate, local_target, goal, robot, weights, *, static_distance, squares=(), movers=(),
           dt, steps, v_count, yaw_count, clearance_cap, normalisation="sum"):
    """The candidate with the largest score (eq. 9), the lower v-major index among equals, or the brake."""
    v_samples = samples(v, robot.a_max * dt, robot.v_min, robot.v_max, v_count)
    most = robot.yaw_rate_max
    yaw_samples = samples(yaw_rate, robot.yaw_a_max * dt, -most, most, yaw_count)
    commands = [(each_v, each_yaw) for each_v in v_samples for each_yaw in yaw_samples]
    clearances, terms = [], []
    for each_v, each_yaw in commands:
        poses = rollout(pose, each_v, each_yaw, dt, steps)
        clearance = rollout_clearance(poses, dt, robot.radius, static_distance, squares, movers)
        clearances.append(clearance)
        terms.append((heading_term(poses[-1], local_target), min(clearance, clearance_cap), each_v,
                      heading_term(poses[-1], goal)))
    admissible = [is_admissible(*command, clearance, robot)
                  for command, clearance in zip(commands, clearances, strict=True)]
    scores = [-math.inf] * len(commands)
    if any(admissible):
        scales = (math.pi, clearance_cap, robot.v_max, math.pi)
        columns = [normalised(values, admissible, normalisation, scale)
                   for values, scale in zip(zip(*terms, strict=True), scales, strict=True)]
        share = (weights.local_heading, weights.clearance, weights.velocity, weights.global_heading)
        scores = [sum(share[i] * columns[i][n] for i in range(4)) if good else -math.inf
                  for n, good in enumerate(admissible)]
    candidates = tuple(Candidate(*command, *rest) for command, *rest in zip(
        commands, clearances, admissible, terms, scores, strict=True))
    if not any(admissible):
        return Decision(*brake(v_samples, yaw_samples, pose, local_target, dt), -1, candidates)
    index = scores.index(max(scores))
    return Decision(*commands[index], index, candidates)
