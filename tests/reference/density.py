"""Obstacle densities by counting cells (eqs. 2-3) and the weight rule (eq. 5) with exact thresholds."""

from fractions import Fraction


def share(occupied, cell, goal):
    """P (eq. 2): exact share of occupied cells in the inclusive rectangle spanned by two cells (row, col)."""
    rows = range(min(cell[0], goal[0]), max(cell[0], goal[0]) + 1)
    columns = range(min(cell[1], goal[1]), max(cell[1], goal[1]) + 1)
    hits = sum(bool(occupied[row, column]) for row in rows for column in columns)
    return Fraction(hits, len(rows) * len(columns))


def map_share(occupied):
    """Q (eq. 3): exact share of occupied cells in the whole map."""
    height, width = occupied.shape
    return share(occupied, (0, 0), (height - 1, width - 1))


def heuristic_weight(p, q, dense_base, dense_gain, sparse_base, sparse_gain, dense_ratio=1.5,
                     sparse_ratio=0.5):
    """ω of eq. 5; arguments become exact Fractions, so the thresholds are no matter of rounding."""
    p, q = Fraction(p), Fraction(q)
    if q == 0:
        return Fraction(1)
    if p >= Fraction(dense_ratio) * q:
        return Fraction(dense_base) + Fraction(dense_gain) * q / p
    if p < Fraction(sparse_ratio) * q:
        return Fraction(sparse_base) + Fraction(sparse_gain) * p / q
    return Fraction(1)


def weight_1024(occupied, cell, goal, **rule):
    """ω at a cell as a whole number of 1024ths (halves round to even), as the search uses it."""
    return round(1024 * heuristic_weight(share(occupied, cell, goal), map_share(occupied), **rule))
