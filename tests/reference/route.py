"""Places on a polyline by looking at every segment, in double precision."""

import itertools
import math


def alongs(points):
    """Distance along the polyline of each of its points."""
    return [0.0, *itertools.accumulate(math.dist(a, b) for a, b in itertools.pairwise(points))]


def feet(points, x, y):
    """For each segment (distance to it, how far along the polyline its nearest point is)."""
    found = []
    for (a, b), along in zip(itertools.pairwise(points), alongs(points), strict=False):
        length = math.dist(a, b)
        share = 0.0
        if length > 0:
            share = ((x - a[0]) * (b[0] - a[0]) + (y - a[1]) * (b[1] - a[1])) / length**2
            share = min(max(share, 0.0), 1.0)
        nearest = (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
        found.append((math.dist((x, y), nearest), along + share * length))
    return found


def place(points, along):
    """(x, y) so far along the polyline; its ends beyond them."""
    for (a, b), begin in zip(itertools.pairwise(points), alongs(points), strict=False):
        length = math.dist(a, b)
        if along <= begin + length and length > 0:
            share = max(along - begin, 0.0) / length
            return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
    return tuple(points[-1])
