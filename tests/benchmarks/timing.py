"""Timing of a JAX function: the first call apart, then the median of several."""

import statistics
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import jax

REPEATS = 5


class Timing(NamedTuple):
    """How long one piece of work took."""

    name: str
    unit: str  # what is counted
    items: int  # of them in one call
    first_s: float  # compiling included
    seconds: tuple[float, ...]  # one a call thereafter
    detail: dict[str, float]  # what makes the work comparable

    @property
    def rate(self) -> float:
        """Items a second, by the median call."""
        return self.items / statistics.median(self.seconds)


def timed(name: str, unit: str, items: int, call: Callable[[], Any], repeats: int = REPEATS,
          describe: Callable[[Any], dict[str, float]] = lambda _: {}) -> Timing:
    """Call once to compile and warm up, then `repeats` times; a call counts once its result is there.

    describe: figures of the result that say what work was done.
    """
    first, result = _seconds(call)
    seconds = tuple(_seconds(call)[0] for _ in range(repeats))
    return Timing(name, unit, items, first, seconds, describe(result))


def _seconds(call: Callable[[], Any]) -> tuple[float, Any]:
    begin = time.perf_counter()
    result = jax.block_until_ready(call())
    return time.perf_counter() - begin, result
