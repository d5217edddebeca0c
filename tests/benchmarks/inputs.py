"""What is timed: maps, single decisions and closed-loop scenarios, as arrays that any program can be given.

Dimension letters: N items; H, W map; M movers; S unknown discs. Metres, m/s and radians; cells of 1 m, row 0 at y = 0.
"""

from collections import deque
from collections.abc import Iterator

import numpy as np

DENSITY, MOVERS, DISCS = 0.2, 8, 5
Arrays = dict[str, np.ndarray]


def maps(side: int, count: int, seed: int = 0) -> np.ndarray:
    """[N, side, side] uint8, a fifth occupied at random; the opposite corners are joined."""
    random = np.random.default_rng((seed, side))
    found: list[np.ndarray] = []
    while len(found) < count:
        occupied = random.random((side, side)) < DENSITY
        occupied[0, 0] = occupied[-1, -1] = False
        if corners_joined(occupied):
            found.append(occupied)
    return np.array(found, np.uint8)


def scenes(count: int, side: int = 25, seed: int = 1) -> Arrays:
    """Robots at random in free cells, at random speeds, among movers up to 6 m away, headed for another free cell."""
    random, grids = np.random.default_rng(seed), maps(side, count)
    places = [free_places(grid, 2, random) for grid in grids]
    state, disc = np.zeros((count, 5)), np.zeros((count, MOVERS, 5))
    for index, (here, _) in enumerate(places):
        state[index] = [*(here + random.uniform(-0.15, 0.15, 2)), random.uniform(-np.pi, np.pi),
                        random.uniform(0.0, 1.0), random.uniform(-1.5, 1.5)]  # fmt: skip
        for mover in range(MOVERS):
            offset = next(drawn for drawn in drawings(random, -6, 6) if np.hypot(*drawn) > 1.2)
            disc[index, mover] = moving_disc(state[index, :2] + offset, random)
    local = np.array([there for _, there in places])
    return {"maps": grids, "state": state, "local": local, "goal": np.full((count, 2), side - 0.5), "disc": disc}


def scenarios(count: int, side: int = 25, seed: int = 2) -> Arrays:
    """From corner to corner among unknown discs, which leave the corners joined, and movers, mirrored at the border."""
    random, grids = np.random.default_rng(seed), maps(side, count)
    return {"maps": grids, "start": np.full((count, 2), 0.5), "goal": np.full((count, 2), side - 0.5),
            "ustat": np.array([unknown_discs(grid, random) for grid in grids]),
            "mov": np.array([[moving_disc(far_from_corners(side, random), random) for _ in range(MOVERS)]
                             for _ in grids])}  # fmt: skip


def corners_joined(occupied: np.ndarray) -> bool:
    """Whether a way through orthogonal neighbours leads from corner to corner: then one without cut corners does."""
    side = len(occupied)
    seen, waiting = {(0, 0)}, deque([(0, 0)])
    while waiting:
        row, column = waiting.popleft()
        for near in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
            if min(near) >= 0 and max(near) < side and not occupied[near] and near not in seen:
                seen.add(near)
                waiting.append(near)
    return (side - 1, side - 1) in seen


def free_places(grid: np.ndarray, count: int, random: np.random.Generator) -> np.ndarray:
    """[count, 2] (x, y) of free cells' centres."""
    free = np.argwhere(grid == 0)
    return free[random.integers(len(free), size=count)][:, ::-1] + 0.5


def unknown_discs(grid: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """[S, 3] (x, y, radius) in free cells away from the corners."""
    occupied, found = grid.astype(bool), []
    while len(found) < DISCS:
        ((x, y),) = free_places(occupied.astype(np.uint8), 1, random)
        row, column = int(y), int(x)
        tried = occupied.copy()
        tried[row, column] = True
        if max(row, column) >= 3 and min(row, column) <= len(grid) - 4 and corners_joined(tried):
            occupied = tried
            found.append((x, y, 0.3))
    return np.array(found)


def moving_disc(place: np.ndarray, random: np.random.Generator) -> list[float]:
    """(x, y, vx, vy, radius)."""
    speed, direction = random.uniform(0.2, 0.8), random.uniform(-np.pi, np.pi)
    return [*place, speed * np.cos(direction), speed * np.sin(direction), random.uniform(0.2, 0.4)]


def far_from_corners(side: int, random: np.random.Generator) -> np.ndarray:
    """[2] (x, y)."""
    return next(place for place in drawings(random, 1, side - 1)
                if np.hypot(*(place - 0.5)) > 4 and np.hypot(*(place - side + 0.5)) > 4)  # fmt: skip


def drawings(random: np.random.Generator, low: float, high: float) -> Iterator[np.ndarray]:
    """[2] (x, y), again and again."""
    while True:
        yield random.uniform(low, high, 2)
