"""Distances to occupied squares by looking at every square; cell (r, c) is [c, c+1] × [r, r+1]."""

from fractions import Fraction
from math import sqrt

import numpy as np


def squared_gap(x, y, row, column, side=1):
    """Squared distance from a point to the closed square of one cell of that side; exact for Fractions and ints."""
    dx = max(column * side - x, 0, x - (column + 1) * side)
    dy = max(row * side - y, 0, y - (row + 1) * side)
    return dx * dx + dy * dy


def squared_distance(occupied, x, y, side=1):
    """Squared distance from a point to the nearest occupied square or to the map's border, 0 beyond it."""
    height, width = occupied.shape
    to_border = min(x, y, width * side - x, height * side - y)
    if to_border <= 0:
        return 0
    gaps = [squared_gap(x, y, row, column, side) for row, column in np.argwhere(occupied).tolist()]
    return min([*gaps, to_border * to_border])


def distance(occupied, x, y):
    """Distance in float64, for points that are not on a lattice."""
    return sqrt(squared_distance(occupied, float(x), float(y)))


def lattice_distance(occupied, subdivision):
    """[H·s + 1, W·s + 1] distances in cells at the lattice points, each from an exact squared distance."""
    height, width = occupied.shape
    return np.array([
        [sqrt(squared_distance(occupied, j, i, subdivision)) / subdivision for j in range(width * subdivision + 1)]
        for i in range(height * subdivision + 1)
    ])


def inflate(occupied, radius):
    """Cells whose centre is within `radius` (cells, taken exactly) of an occupied square or the border."""
    height, width = occupied.shape
    half = Fraction(1, 2)
    limit = Fraction(radius) ** 2
    return np.array([
        [bool(squared_distance(occupied, column + half, row + half) <= limit) for column in range(width)]
        for row in range(height)
    ])
