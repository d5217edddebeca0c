"""The robot's outline: a disc, or a rectangle covered by discs along its x axis."""

import math
from collections.abc import Callable
from functools import reduce

import jax
import jax.numpy as jnp

from adwa_jax.window import RobotLimits


def covering_discs(length: float, width: float, count: int) -> tuple[float, tuple[float, ...]]:
    """Radius and x offsets [m] of `count` equal discs that cover a rectangle length × width centred on the robot.

    Each disc covers a slice of length / count; its radius is half the slice's diagonal. What is free for the discs is
    free for the rectangle; the discs jut out beyond a side by radius − width / 2 at most, and beyond an end by
    radius − length / (2 · count).
    """
    slice_length = length / count
    radius = math.hypot(slice_length, width) / 2
    return radius, tuple(slice_length * (index - (count - 1) / 2) for index in range(count))


def over_discs(clearance: Callable[[jax.Array, jax.Array], jax.Array], robot: RobotLimits, x: jax.Array, y: jax.Array,
               cosine: jax.Array, sine: jax.Array) -> jax.Array:
    """The least `clearance` of points over the discs' centres, less their radius. Shapes of x, y, cosine, sine fit."""
    if len(robot.disc_offsets) == 1:  # a disc turns on the spot
        return clearance(x, y) - robot.radius
    over = [clearance(x + offset * cosine, y + offset * sine) for offset in robot.disc_offsets]
    return reduce(jnp.minimum, over) - robot.radius
