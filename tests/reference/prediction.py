"""What becomes of one candidate, step by step in double precision: the oracle of trajectory rollout and of braking."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from tests.reference.dwa import square_distance

NOWHERE = 1e6  # [m] to what is absent


@dataclass(frozen=True)
class Outline:
    """Equal discs along the robot's x axis [m]."""

    radius: float
    offsets: tuple = (0.0,)

    def centres(self, x, y, heading):
        return [(x + offset * math.cos(heading), y + offset * math.sin(heading)) for offset in self.offsets]


@dataclass(frozen=True)
class Surroundings:
    """What the robot may meet."""

    static_distance: Callable  # of a point (x, y) to what is known beforehand [m]
    squares: tuple = ()  # (centre, half width), those known
    movers: tuple = ()  # (position, velocity, radius), those seen
    margin: float = 0.0  # by which movers count as larger [m] ...
    growth: float = 0.0  # ... and by so much more a second

    def static(self, outline, x, y, heading):
        """Least distance from the outline to all that stands."""
        gaps = []
        for centre in outline.centres(x, y, heading):
            gaps.append(self.static_distance(*centre))
            gaps += [square_distance(*centre, square, half_width) for square, half_width in self.squares]
        return min(gaps) - outline.radius

    def moving(self, outline, x, y, heading, time):
        """Least distance from the outline to the movers as they will be, less their margin."""
        gaps = [NOWHERE]
        for centre in outline.centres(x, y, heading):
            for position, velocity, radius in self.movers:
                there = [p + time * u for p, u in zip(position, velocity, strict=True)]
                gaps.append(math.dist(centre, there) - radius)
        return min(gaps) - outline.radius - self.margin - self.growth * time


@dataclass(frozen=True)
class Outlook:
    middle: tuple  # (x, y) after half the horizon
    end: tuple  # (x, y, heading) after the horizon
    headings: tuple  # after each step of the horizon, not wrapped
    static: float  # least clearance to statics over the horizon
    moving: float  # least clearance to movers over all steps
    contact_time: float  # of the first step with less than none; of the last step without any
    closest_call: float  # how little would have changed where it stopped or when it met a mover


def outlook(pose, v_ahead, yaw_ahead, horizon, dt, stride, outline, surroundings, room=None):
    """Follow one candidate: each step is `stride` control steps at one v and one yaw rate, along their mean heading.

    With `room` it stays where its next point would be nearer than that to a static.
    """
    x, y, heading = pose
    least_static = least_moving = closest_call = math.inf
    contact_time = None
    middle = end = static = None
    headings = []
    for count, (v, yaw_rate) in enumerate(zip(v_ahead, yaw_ahead, strict=True), start=1):
        along = heading + yaw_rate * dt * (stride - 1) / 2
        there = (x + v * math.cos(along) * stride * dt, y + v * math.sin(along) * stride * dt)
        heading += yaw_rate * stride * dt
        headings.append(heading)
        least_static = min(least_static, surroundings.static(outline, *there, heading))
        if room is not None:
            closest_call = min(closest_call, abs(least_static - room))
        if room is None or least_static > room:
            x, y = there
        moving = surroundings.moving(outline, x, y, heading, count * stride * dt)
        closest_call = min(closest_call, abs(moving))
        if moving < 0 and contact_time is None:
            contact_time = count * stride * dt
        least_moving = min(least_moving, moving)
        if count == max(horizon // 2, 1):
            middle = (x, y)
        if count == horizon:
            end, static = (x, y, heading), least_static
    if contact_time is None:
        contact_time = len(v_ahead) * stride * dt
    return Outlook(middle, end, tuple(headings[:horizon]), static, least_moving, contact_time, closest_call)


def towards_zero(value, reach):
    """The value brought nearer to 0 by at most `reach`."""
    return max(value - reach, 0.0) if value > 0 else min(value + reach, 0.0)


def braking(v, yaw_rate, v_reach, yaw_reach, steps):
    """One control step at (v, yaw_rate), then as much slower in each as the reaches [a step] allow."""
    speeds, yaw_rates = [v], [yaw_rate]
    for _ in range(steps - 1):
        speeds.append(towards_zero(speeds[-1], v_reach))
        yaw_rates.append(towards_zero(yaw_rates[-1], yaw_reach))
    return speeds, yaw_rates
