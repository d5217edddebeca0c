"""One decision under every rule beyond the paper, candidate by candidate in double precision."""

import math
from dataclasses import dataclass

from tests.reference.dwa import wrap
from tests.reference.prediction import braking, outlook
from tests.reference.route import feet


@dataclass(frozen=True)
class Planner:
    """The constants that the rules need; names as in the code."""

    dt: float
    stride: int
    horizon: int
    halt_steps: int
    v_max: float
    v_reach: float  # what one control step can change [m/s]
    yaw_reach: float  # [rad/s]
    clearance_cap: float
    mover_cap: float
    static_margin: float
    weights: dict  # by term


@dataclass(frozen=True)
class Candidate:
    admissible: bool
    terms: dict  # by name, not yet divided by their scales
    score: float
    badness: float  # the less the better where none is admissible
    closest_call: float  # how little would have changed what is admissible or where the candidate ends


def clip(value, low, high):
    return min(max(value, low), high)


def candidate(pose, v, yaw_rate, v_ahead, yaw_ahead, route, target, outline, around, planner):
    """Judge one candidate that commands (v, yaw_rate) and is predicted to go on as v_ahead and yaw_ahead say."""
    now = around.static(outline, *pose)
    room, wider = (min(margin, now / 2) for margin in (planner.static_margin, 2 * planner.static_margin))
    ahead = outlook(pose, v_ahead, yaw_ahead, planner.horizon, planner.dt, planner.stride, outline, around, wider)
    profile = braking(v, yaw_rate, planner.v_reach, planner.yaw_reach, planner.halt_steps)
    halt = outlook(pose, *profile, planner.halt_steps, planner.dt, 1, outline, around)

    farthest = planner.v_max * planner.dt * planner.stride * planner.horizon
    bearing = math.atan2(target[1] - pose[1], target[0] - pose[0])
    off = [abs(wrap(heading - bearing)) for heading in ahead.headings]
    apart_now, along_now = min(feet(route, *pose[:2]))
    apart_end, along_end = min(feet(route, *ahead.end[:2]))
    _, along_middle = min(feet(route, *ahead.middle))
    terms = {
        "local_heading": math.pi - sum(off) / len(off),
        "clearance": clip(ahead.static, 0.0, planner.clearance_cap),
        "progress": clip((along_end + along_middle) / 2 - along_now + farthest, 0.0, 2 * farthest),
        "on_route": clip(apart_now - apart_end + farthest, 0.0, 2 * farthest),
        "contact_time": ahead.contact_time,
        "mover_clearance": clip(ahead.moving, 0.0, planner.mover_cap),
        "forward": float(v >= 0),
    }
    scales = {"local_heading": math.pi, "clearance": planner.clearance_cap, "progress": farthest, "on_route": farthest,
              "contact_time": len(v_ahead) * planner.stride * planner.dt, "mover_clearance": planner.mover_cap,
              "forward": 1.0}
    score = sum(planner.weights[name] * value / scales[name] for name, value in terms.items())
    stops = halt.static > room
    badness = -ahead.contact_time - 0.01 * clip(halt.moving, -1.0, 1.0) if stops else 1e3 - halt.static
    closest_call = min(ahead.closest_call, abs(halt.static - room), abs(halt.moving))
    return Candidate(stops and halt.moving > 0, terms, score, badness, closest_call)
