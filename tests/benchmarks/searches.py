"""A* from corner to corner, a fifth of the cells occupied, no corner cut, ω = 1."""

from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.astar import SearchOptions
from adwa_jax.astar_lanes import search_lanes
from tests.benchmarks.inputs import maps
from tests.benchmarks.timing import Figure, contest, in_threads, rate_of
from tests.benchmarks.yardstick import Yardstick, doubled, peer
from tuning.engine import usable_cores

SIZES = ((25, 1000, 250), (100, 100, 25), (512, 10, 1))  # side, maps, maps in one call
SLOW = {25: 100, 100: 10, 512: 2}  # maps for peers that take one at a time


def against_peers(yardstick: Yardstick | None, side: int, count: int, chunk: int) -> list[Figure]:
    """The same maps searched by all. pyastar2d and python-motion-planning cut corners: their paths are others."""
    grids = maps(side, count)
    contestants: dict[str, Callable[[], float]] = {"adwa-jax": ours(grids, chunk)}
    if yardstick:
        contestants["C++"] = lambda: yardstick.rate("astar", {"maps": grids}, "--repeat", "5")
    few = grids[: SLOW[side]]
    if (python := peer("numba_astar")) is not None:
        tasks = [python.make(grid) for grid in few]
        contestants["numba"] = lambda: one_core(python.search, tasks)
    if find_spec("pyastar2d"):
        contestants["pyastar2d (cuts corners)"] = pyastar2d(few)
    if find_spec("python_motion_planning") and side < 512:
        contestants["python-motion-planning (cuts corners)"] = motion_planning(few[: 1000 // side])
    return contest(f"A*, {side} × {side} cells", "searches", contestants, rounds=3 if side == 512 else 5)


def ours(grids: np.ndarray, chunk: int) -> Callable[[], float]:
    """Chunk after chunk, a thread a core."""
    side = grids.shape[1]
    blocked = jnp.asarray(grids, bool)
    start, goal = jnp.zeros((chunk, 2), jnp.int32), jnp.full((chunk, 2), side - 1, jnp.int32)
    weight = jnp.ones((chunk, side, side), jnp.float32)
    search = jax.jit(search_lanes, static_argnames="options")
    parts = [blocked[first : first + chunk] for first in range(0, len(grids), chunk)]

    def share(worker: int) -> None:
        for part in parts[worker :: usable_cores()]:
            jax.block_until_ready(search(part, start, goal, weight, options=SearchOptions()))

    return lambda: rate_of(len(grids), lambda: in_threads(partial(share, core) for core in range(usable_cores())))


def one_core(search: Callable[[Any], Any], tasks: list) -> float:
    """What as many processes as cores would reach."""
    def work() -> None:
        for task in tasks:
            search(task)

    return doubled([rate_of(len(tasks), work)])


def pyastar2d(grids: np.ndarray) -> Callable[[], float]:
    """Octile distance, diagonals always allowed."""
    from pyastar2d import astar_path  # pyright: ignore

    last = grids.shape[1] - 1
    tasks = [np.where(grid, np.inf, 1.0).astype(np.float32) for grid in grids]
    return lambda: one_core(lambda task: astar_path(task, (0, 0), (last, last), allow_diagonal=True), tasks)


def motion_planning(grids: np.ndarray) -> Callable[[], float]:
    """Pure Python."""
    import python_motion_planning as library  # pyright: ignore

    side = grids.shape[1]

    def task(occupied: np.ndarray) -> Any:
        grid = library.Grid(bounds=[[0, side], [0, side]])
        grid.type_map[occupied > 0] = library.TYPES.OBSTACLE
        return library.AStar(map_=grid, start=(0, 0), goal=(side - 1, side - 1))

    tasks = [task(grid) for grid in grids]
    return lambda: one_core(lambda task: task.plan(), tasks)
