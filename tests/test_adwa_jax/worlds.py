"""Small maps and tasks for the kernel tests: all padded to one shape, so that each kernel compiles once."""

from functools import wraps

import jax
import jax.numpy as jnp
import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

from adwa_jax.astar import SearchResult, Status
from adwa_jax.grid import Grid
from adwa_jax.metrics import PlannedMeasures
from adwa_jax.plan import Plan
from adwa_jax.scenario import Movers, Scenario, UnknownSquares

SHAPE = (12, 12)
SIZES = ((9, 9), (12, 10), (5, 12))
CAPACITY = 2  # unknown squares and movers

few_examples = settings(max_examples=15, deadline=None, derandomize=True)
many_examples = settings(max_examples=50, deadline=None, derandomize=True)


def drawn(*rows):
    """Occupancy from rows of '#' and '.', the first row being row 0."""
    return np.array([[cell == "#" for cell in row] for row in rows])


def random_map(seed, size, density):
    """Occupied cells strewn at random; the first and last free cells are at opposite corners."""
    occupied = np.random.default_rng(seed).random(size) < density
    occupied[0, 0] = occupied[-1, -1] = False
    return occupied


densities = st.sampled_from((0.0, 0.1, 0.25, 0.4))
maps = st.builds(random_map, st.integers(0, 2**32 - 1), st.sampled_from(SIZES), densities)


def padded(occupied, shape=SHAPE):
    """[H, W] occupancy with occupied padding."""
    height, width = occupied.shape
    return np.pad(occupied, ((0, shape[0] - height), (0, shape[1] - width)), constant_values=True)


def grid_of(occupied, shape=SHAPE, resolution=1.0, origin=(0.0, 0.0)):
    """A padded Grid; `shape` None leaves the map as it is."""
    height, width = occupied.shape
    return Grid(
        occupied=jnp.asarray(occupied if shape is None else padded(occupied, shape)),
        height=jnp.int32(height),
        width=jnp.int32(width),
        resolution=jnp.float32(resolution),
        origin=jnp.asarray(origin, jnp.float32),
    )


def free_cells(occupied, seed, count):
    """`count` free cells (row, col) drawn with repetition."""
    free = np.argwhere(~occupied)
    picked = np.random.default_rng(seed).integers(len(free), size=count)
    return [tuple(int(i) for i in free[k]) for k in picked]


def counting(function, **jit_options):
    """The jitted function and a list that grows by one each time it is traced."""
    traces = []

    @wraps(function)
    def counted(*args, **kwargs):
        traces.append(1)
        return function(*args, **kwargs)

    return jax.jit(counted, **jit_options), traces


def cell(row_column):
    """[2] int32 of a (row, col) pair."""
    return jnp.asarray(row_column, jnp.int32)


def squares_of(squares):
    """Unknown squares from (x, y, half width) or (x, y, half width, rounding), up to `CAPACITY`; then invalid ones."""
    rows = [(*square, 0.0)[:4] for square in squares]
    boxes = jnp.asarray([*rows, *[(6.0, 6.0, 9.0, 0.0)] * (CAPACITY - len(rows))], jnp.float32)
    return UnknownSquares(boxes[:, :2], boxes[:, 2], boxes[:, 3], jnp.arange(CAPACITY) < len(rows))


def movers_of(movers):
    """Movers (x, y, vx, vy, radius) mirrored in the 12 × 12 m box, up to `CAPACITY`; then invalid ones."""
    discs = jnp.asarray([*movers, *[(6.0, 6.0, 0.0, 0.0, 9.0)] * (CAPACITY - len(movers))], jnp.float32)
    return Movers(
        radius=discs[:, 4], position=discs[:, :2], velocity=discs[:, 2:4],
        low=jnp.zeros((CAPACITY, 2), jnp.float32), high=jnp.full((CAPACITY, 2), 12.0, jnp.float32),
        track=jnp.zeros((CAPACITY, 0, 3), jnp.float32), track_length=jnp.zeros(CAPACITY, jnp.int32),
        period=jnp.zeros(CAPACITY, jnp.float32), valid=jnp.arange(CAPACITY) < len(movers),
    )  # fmt: skip


def scenario(occupied, start, goal, *, squares=(), movers=(), hidden=None, heading=None, time_limit=24.0, shape=SHAPE,
             reference_length=0.0):
    """A task on a drawn map; `hidden` [rows, columns] bool: occupied cells of which the robot's map shows nothing."""
    concealed = np.zeros((0, 0), bool) if hidden is None else np.zeros(shape or occupied.shape, bool)
    if hidden is not None:
        concealed[: hidden.shape[0], : hidden.shape[1]] = hidden
    return Scenario(
        grid=grid_of(occupied, shape),
        hidden=jnp.asarray(concealed),
        start=jnp.asarray([*start, 0.0 if heading is None else heading], jnp.float32),
        heading_given=jnp.bool_(heading is not None),
        goal=jnp.asarray(goal, jnp.float32),
        goal_tolerance=jnp.float32(0.4),
        time_limit=jnp.float32(time_limit),
        reference_length=jnp.float32(reference_length),
        squares=squares_of(squares),
        movers=movers_of(movers),
    )


def plan_by_hand(key_points, count, field):
    """A plan of key points [P, 2] [m], the first `count` of them, that nobody searched for."""
    none, nothing = jnp.int32(0), jnp.float32(0.0)
    search = SearchResult(jnp.int32(Status.FOUND), *[none] * (len(SearchResult._fields) - 1))
    measures = PlannedMeasures(*[none] * len(PlannedMeasures._fields))
    return Plan(search, nothing, key_points, count, nothing, measures, nothing, field)
