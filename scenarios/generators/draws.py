"""Random numbers for the generators, drawn on the host from one jax key.

A key becomes independent streams, one a purpose, so that changing the number of movers leaves the map as it
was. Every number is made from 53-bit uniforms by multiplication, comparison and sorting, which no version of
numpy or processor does differently.
"""

from typing import NamedTuple

import jax
import numpy as np


class Draws:
    """One stream of random numbers; each call moves it on."""

    def __init__(self, bits: np.random.Philox):
        self._random = np.random.Generator(bits).random

    def uniforms(self, *shape: int) -> np.ndarray:
        """[*shape] float64 in [0, 1)."""
        return self._random(shape)

    def uniform(self, low: float, high: float) -> float:
        """One number in [low, high)."""
        return low + (high - low) * self._random()

    def index(self, count: int) -> int:
        """One of 0 … count - 1."""
        return int(self._random() * count)

    def order(self, count: int) -> np.ndarray:
        """[count] int: 0 … count - 1 in random order."""
        return np.argsort(self._random(count), kind="stable")


class Streams(NamedTuple):
    """The purposes that a key serves."""

    map: Draws
    task: Draws
    squares: Draws
    movers: Draws


def streams_of(key: jax.Array) -> Streams:
    """The streams of a jax key (typed, or a raw uint32 pair); equal keys give equal streams.

    Consumes the key: the caller must not use it for anything else.
    """
    seed = int.from_bytes(np.asarray(jax.random.key_data(key), ">u4").tobytes(), "big")
    purposes = range(len(Streams._fields))
    return Streams(*(Draws(np.random.Philox(key=seed, counter=[0, 0, 0, purpose])) for purpose in purposes))
