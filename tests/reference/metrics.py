"""The measures of the specification in plain loops and double precision."""

import itertools
import math
from fractions import Fraction

import numpy as np

from tests.reference.dwa import wrap
from tests.reference.keypoints import squared_point_to_segment, turning_points

TURN_THRESHOLD = math.radians(15)


def length(positions):
    """Sum of the distances between successive positions [m]."""
    return sum(math.dist(a, b) for a, b in itertools.pairwise(positions))


def changes(headings):
    """Successive heading changes, each the short way round [rad]."""
    return [wrap(b - a) for a, b in itertools.pairwise(headings)]


def driven_breaking_points(headings):
    """Turns, maximal runs of non-zero heading changes of one sign, that accumulate more than 15°."""
    count, turned = 0, 0.0
    for change in [*changes(headings), 0.0]:
        if change * turned > 0:
            turned += change
        else:
            count += abs(turned) > TURN_THRESHOLD
            turned = change
    return count + (abs(turned) > TURN_THRESHOLD)


def driven_danger_points(clearances, danger_clearance):
    """Separate intervals in which the clearance is below the threshold."""
    count, inside = 0, False
    for clearance in clearances:
        below = clearance < danger_clearance
        count += below and not inside
        inside = below
    return count


def curvature(positions, headings):
    """Mean over the steps that move of |Δθ| / Δs [rad/m]; 0 where nothing moves."""
    ratios = []
    for a, b, change in zip(positions, positions[1:], changes(headings), strict=False):
        step = math.dist(a, b)
        if step > 0:
            ratios.append(abs(change) / step)
    return sum(ratios) / len(ratios) if ratios else 0.0


def angle_over_length(positions, headings):
    """Σ|Δθ| over the length [rad/m]; 0 where the length is 0."""
    driven = length(positions)
    return sum(map(abs, changes(headings))) / driven if driven > 0 else 0.0


def command_variation(v, yaw_rate):
    """Σ|Δv| + Σ|Δ yaw_rate| between successive commands."""
    return sum(abs(b - a) for series in (v, yaw_rate) for a, b in itertools.pairwise(series))


def jerk(positions, dt):
    """Mean |third difference of the position| / dt³ [m/s³]; 0 with fewer than four positions."""
    sizes = []
    for p in zip(positions, positions[1:], positions[2:], positions[3:], strict=False):
        third = [p[3][i] - 3 * p[2][i] + 3 * p[1][i] - p[0][i] for i in (0, 1)]
        sizes.append(math.hypot(*third))
    return sum(sizes) / len(sizes) / dt**3 if sizes else 0.0


def spl(success, shortest, driven):
    """success · ℓ / max(p, ℓ)."""
    longest = max(driven, shortest)
    return float(success) * shortest / longest if longest > 0 else float(success)


def barn_score(success, time, reference_length):
    """success · T* / clip(time, 2 T*, 8 T*) with T* = reference length / (2 m/s)."""
    ideal = reference_length / 2.0
    return float(success) * ideal / min(max(time, 2 * ideal), 8 * ideal)


def planned_breaking_points(path):
    """Turning points, ends not counted."""
    return max(len(turning_points(path)) - 2, 0)


def planned_danger_points(occupied, path):
    """Diagonal steps of a cell path with an occupied cell at either side of the step."""
    return sum(bool(a[0] != b[0] and a[1] != b[1] and (occupied[a[0], b[1]] or occupied[b[0], a[1]]))
               for a, b in itertools.pairwise(path))


def occupied_corners(occupied):
    """Corner points (x, y), in cells, of occupied cells, each once."""
    return {(int(column) + i, int(row) + j)
            for row, column in np.argwhere(occupied) for i in (0, 1) for j in (0, 1)}


def polyline_danger_points(occupied, points, reach=Fraction(1, 10)):
    """Corners of occupied cells closer than `reach` cells to a polyline of points (x, y) in cells."""
    segments = list(itertools.pairwise(points)) or [(points[0], points[0])]
    return sum(any(squared_point_to_segment(corner, a, b) < reach * reach for a, b in segments)
               for corner in occupied_corners(occupied))
