"""Moments of a drive for the kernel tests: a robot, the field it drives by, and what it senses."""

import math
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.grid import BILINEAR_EXCESS, distance_field
from adwa_jax.obstacles import Sensed
from adwa_jax.rollout import RobotState
from tests.reference import distance as distance_reference
from tests.test_adwa_jax.worlds import grid_of, random_map

SUBDIVISION = 2
CAPACITY = 3  # squares and movers

field_of = jax.jit(distance_field, static_argnames="subdivision")
EMPTY = field_of(grid_of(np.zeros((12, 12), bool)), subdivision=SUBDIVISION)


def state(x, y, heading, v=0.0, yaw_rate=0.0):
    return RobotState(*map(jnp.float32, (x, y, heading, v, yaw_rate)))


def sensed(squares=(), movers=(), capacity=CAPACITY):
    """Known squares (centre, half width) and seen movers (position, velocity, radius) among unknown, unseen ones."""
    pad_squares = [*squares, *[((6.0, 6.0), 50.0)] * (capacity - len(squares))]
    pad_movers = [*movers, *[((6.0, 6.0), (0.0, 0.0), 50.0)] * (capacity - len(movers))]
    return Sensed(
        square_centre=jnp.asarray([square[0] for square in pad_squares], jnp.float32),
        square_half_width=jnp.asarray([square[1] for square in pad_squares], jnp.float32),
        square_known=jnp.arange(capacity) < len(squares),
        position=jnp.asarray([mover[0] for mover in pad_movers], jnp.float32),
        velocity=jnp.asarray([mover[1] for mover in pad_movers], jnp.float32),
        radius=jnp.asarray([mover[2] for mover in pad_movers], jnp.float32),
        seen=jnp.arange(capacity) < len(movers),
        square_rounding=jnp.zeros(capacity, jnp.float32),
    )


def random_scene(seed):
    """A robot somewhere free in a random map, with squares and movers about it."""
    random = np.random.default_rng(seed)
    occupied = random_map(seed, (12, 12), 0.12)
    row, column = np.argwhere(~occupied)[random.integers((~occupied).sum())]
    here = np.array([column, row]) + random.uniform(0.4, 0.6, 2)
    known = [(tuple(here + random.uniform(-4, 4, 2)), random.uniform(0.1, 0.4)) for _ in range(seed % 3)]
    seen = [(tuple(here + random.uniform(-4, 4, 2)), tuple(random.uniform(-0.8, 0.8, 2)), random.uniform(0.1, 0.4))
            for _ in range(seed // 3 % 3)]
    motion = (random.uniform(-math.pi, math.pi), random.uniform(0, 1), random.uniform(-1.5, 1.5))
    return occupied, (*here, *motion), known, seen, tuple(random.uniform(0, 12, 2)), tuple(random.uniform(0, 12, 2))


def scene_field(seed):
    return field_of(grid_of(random_scene(seed)[0]), subdivision=SUBDIVISION)


@cache
def scene_lattice(seed):
    return distance_reference.lattice_distance(random_scene(seed)[0], SUBDIVISION)


def looked_up(lattice, x, y):
    """The documented lower bound of the distance, in double precision, from an exact lattice."""
    rows, columns = lattice.shape
    u, v = (min(max(SUBDIVISION * c, 0.0), n - 1.0) for c, n in ((x, columns), (y, rows)))
    i, j = min(int(v), rows - 2), min(int(u), columns - 2)
    p, q = u - j, v - i
    below = lattice[i, j] * (1 - p) + lattice[i, j + 1] * p
    above = lattice[i + 1, j] * (1 - p) + lattice[i + 1, j + 1] * p
    return below * (1 - q) + above * q - BILINEAR_EXCESS / SUBDIVISION
