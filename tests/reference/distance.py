"""Distances to occupied squares by looking at every square; cell (r, c) is [c, c+1] × [r, r+1]."""

from fractions import Fraction
from math import sqrt

import numpy as np


def squared_gap(x, y, row, column):
    """Squared distance from a point to the closed square of one cell; exact for Fractions and ints."""
    dx = max(column - x, 0, x - column - 1)
    dy = max(row - y, 0, y - row - 1)
    return dx * dx + dy * dy


def squared_distance(occupied, x, y):
    """Squared distance from a point to the nearest occupied square or to the map's border, 0 beyond it."""
    height, width = occupied.shape
    to_border = min(x, y, width - x, height - y)
    if to_border <= 0:
        return 0
    gaps = [squared_gap(x, y, int(row), int(column)) for row, column in np.argwhere(occupied)]
    return min([*gaps, to_border * to_border])


def distance(occupied, x, y):
    """Distance in float64, for points that are not on a lattice."""
    return sqrt(squared_distance(occupied, float(x), float(y)))


def lattice_distance(occupied, subdivision):
    """[H·s + 1, W·s + 1] distances in cells at the lattice points, each from an exact squared distance."""
    height, width = occupied.shape
    return np.array([
        [sqrt(squared_distance(occupied, Fraction(j, subdivision), Fraction(i, subdivision)))
         for j in range(width * subdivision + 1)]
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
