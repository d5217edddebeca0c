"""What a search method is: a generator that yields candidates and is sent their scores.

It must be a pure function of its problem and of what it is sent: a job that was killed is brought back by sending it
the same scores again.
"""

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from scenarios.suite import Suite
from tuning.objectives import Goals, Scores
from tuning.space import Space

Search = Generator[np.ndarray, Scores, None]
"""Yields [C, D] points of the unit cube, one generation, which is judged in one engine call; is sent their scores."""

Remember = Callable[[str, Callable[[], dict[str, np.ndarray]]], dict[str, np.ndarray]]
"""Arrays by name: those kept under a key, else what the function gives, which is then kept."""


def computed_anew(_: str, compute: Callable[[], dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """A `Remember` that keeps nothing."""
    return compute()


@dataclass(frozen=True)
class Problem:
    """What a method is to solve."""

    space: Space
    goals: Goals
    seed: int
    candidates: int  # that the budget pays for, each on all training scenarios
    suite: Suite  # of training
    settings: Mapping[str, Any] = field(default_factory=dict)  # of the method, as the job file gives them, checked
    remember: Remember = computed_anew  # for what costs much and is not an evaluation


Method = Callable[[Problem], Search]
