"""Start and goal on a known map, far apart and connected."""

import numpy as np

from scenarios.generators.connectivity import Cell
from scenarios.generators.draws import Draws

PAIR_TRIES = 64
"""Random pairs looked at before the farthest goal from the last start is taken."""


def far_pair(draws: Draws, cells: np.ndarray, least: float) -> tuple[Cell, Cell]:
    """Two of the cells [N, 2] (row, column), N ≥ 2, at least `least` apart, counted in cells, centre to centre.

    Uniform over such pairs; where `PAIR_TRIES` pairs hold none, a random cell and the one farthest from it.
    """
    start = cells[0]
    for _ in range(PAIR_TRIES):
        start, goal = cells[draws.index(len(cells))], cells[draws.index(len(cells))]
        if np.sum((goal - start) ** 2) >= least * least and (goal != start).any():
            return _cell(start), _cell(goal)
    return _cell(start), _cell(cells[np.sum((cells - start) ** 2, axis=1).argmax()])


def _cell(pair: np.ndarray) -> Cell:
    return int(pair[0]), int(pair[1])
