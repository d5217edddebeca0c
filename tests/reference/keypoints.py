"""Turning points and key points (§2.2.2) with exact segment-to-square distances in Fractions (cell units)."""

from fractions import Fraction

import numpy as np

from tests.reference.distance import squared_gap


def turning_points(path):
    """Cells of a path that are its ends or where three consecutive cells span a triangle of non-zero area."""
    kept = []
    for k, cell in enumerate(path):
        if k in (0, len(path) - 1):
            kept.append(cell)
            continue
        (r0, c0), (r1, c1), (r2, c2) = path[k - 1], cell, path[k + 1]
        twice_area = (c1 - c0) * (r2 - r0) - (c2 - c0) * (r1 - r0)
        if twice_area != 0:
            kept.append(cell)
    return kept


def centre(cell):
    """Exact (x, y) of a cell's centre."""
    return Fraction(2 * cell[1] + 1, 2), Fraction(2 * cell[0] + 1, 2)


def squared_point_to_segment(p, a, b):
    """Squared distance from a point to a segment."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = dx * dx + dy * dy
    t = Fraction(0) if length == 0 else Fraction((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / length
    t = min(max(t, Fraction(0)), Fraction(1))
    ex, ey = a[0] + t * dx - p[0], a[1] + t * dy - p[1]
    return ex * ex + ey * ey


def crosses(a, b, row, column):
    """Whether a segment meets the closed square of a cell: the part of it in both slabs is not empty."""
    low, high = Fraction(0), Fraction(1)
    for start, end, least in ((a[0], b[0], column), (a[1], b[1], row)):
        if start == end:
            if not least <= start <= least + 1:
                return False
            continue
        enter, leave = sorted(Fraction(side - start) / (end - start) for side in (least, least + 1))
        low, high = max(low, enter), min(high, leave)
    return low <= high


def squared_segment_to_square(a, b, row, column):
    """Squared distance between a segment and the closed square of a cell."""
    a, b = tuple(map(Fraction, a)), tuple(map(Fraction, b))
    if crosses(a, b, row, column):
        return Fraction(0)
    corners = [(column + i, row + j) for i in (0, 1) for j in (0, 1)]
    ends = [squared_gap(*a, row, column), squared_gap(*b, row, column)]
    return min(ends + [squared_point_to_segment(corner, a, b) for corner in corners])


def segment_free(occupied, a, b, margin):
    """Distance from the segment to every occupied square, off-map ones included, greater than `margin`."""
    height, width = occupied.shape
    margin = Fraction(margin)
    to_border = min(min(x, y, width - x, height - y) for x, y in (a, b))
    return to_border > margin and all(
        squared_segment_to_square(a, b, int(row), int(column)) > margin * margin
        for row, column in np.argwhere(occupied)
    )


def key_points(occupied, path, margin, rule="anchor"):
    """Cells of the key points, in order, ends included."""
    turning = turning_points(path)
    kept = turning[:1]
    for k in range(1, len(turning) - 1):
        origin = kept[-1] if rule == "anchor" else turning[k - 1]
        if not segment_free(occupied, centre(origin), centre(turning[k + 1]), margin):
            kept.append(turning[k])
    return kept + turning[1:][-1:]
