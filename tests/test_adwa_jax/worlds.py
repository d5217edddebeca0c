"""Small maps for the kernel tests: all padded to one shape, so that each kernel compiles once."""

from functools import wraps

import jax
import jax.numpy as jnp
import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

from adwa_jax.grid import Grid

SHAPE = (12, 12)
SIZES = ((9, 9), (12, 10), (5, 12))

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
