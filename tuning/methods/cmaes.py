"""CMA-ES (Hansen 2016), several at once: each follows its own scalarisation of the objectives towards its part of the
front.
"""

from dataclasses import dataclass

import numpy as np
from cma import CMAEvolutionStrategy
from moocore import is_nondominated
from pydantic import BaseModel, ConfigDict, Field

from tuning.methods.method import Problem, Search
from tuning.methods.sobol import sobol_points
from tuning.objectives import Scores

AUGMENTED = 0.05  # share of the sum beside the maximum: breaks ties towards proper Pareto optima
LEAST_WEIGHT = 0.1  # of any objective, over their number
CONVERGED = ("tolx", "tolconditioncov", "noeffectaxis", "noeffectcoord")
INSIDE = 0.02  # start points are so far from the cube's faces


class Settings(BaseModel):
    """Of this method."""

    model_config = ConfigDict(extra="forbid", strict=True)

    scalarisations: int = Field(4, ge=1, le=64)
    """Searches side by side, their weights spread over the objectives; one suffices for a single objective."""

    population: int = Field(8, ge=4, le=512)
    """Candidates of each search a generation."""

    step: float = Field(0.2, gt=0.0, le=1.0)
    """First standard deviation, as a share of every parameter's range."""


def cmaes(problem: Problem) -> Search:
    """All searches start at the default constants; a generation is the populations of all of them together.

    A scalarisation is the augmented Tchebycheff distance from the ideal point, the objectives scaled by the range that
    the front so far covers. What violates a constraint ranks behind all that violates none. A search that has
    converged starts again elsewhere.
    """
    settings = Settings.model_validate(problem.settings)
    searches = _searches(problem, settings)
    seen = Seen(np.empty((0, len(problem.goals.objectives))))
    left = problem.candidates
    while left > 0:
        asked = [search.ask() for search in searches]
        points = np.concatenate(asked)
        scores = yield points[:left]
        left -= len(points)
        if left > 0:
            seen = seen.joined(scores)
            scaled = Scores(seen.scaled(scores.objectives), scores.violation)
            for search, part in zip(searches, np.split(np.arange(len(points)), len(searches)), strict=True):
                search.tell(Scores(scaled.objectives[part], scaled.violation[part]))


def ranks(scores: Scores, weights: np.ndarray) -> np.ndarray:
    """[C] int: by violation, then by the augmented Tchebycheff scalarisation of scaled objectives; weights [O]."""
    weighted = scores.objectives * weights
    value = weighted.max(axis=1) + AUGMENTED * weighted.sum(axis=1)
    order = np.lexsort((value, scores.violation))
    return np.argsort(order, kind="stable")


@dataclass(frozen=True)
class Seen:
    """The front of what was judged so far."""

    front: np.ndarray  # [F, O] objectives, of candidates that violate nothing

    def joined(self, scores: Scores) -> "Seen":
        """With more candidates."""
        points = np.concatenate([self.front, scores.objectives[scores.violation == 0.0]])
        return Seen(points[is_nondominated(points)] if len(points) else points)

    def scaled(self, objectives: np.ndarray) -> np.ndarray:
        """[C, O] such that the front's best is 0 in each, and its worst 1."""
        over = self.front if len(self.front) else objectives
        low, width = over.min(axis=0), np.ptp(over, axis=0)
        return (objectives - low) / np.where(width > 0.0, width, 1.0)


class _Search:
    """One CMA-ES in the unit cube."""

    def __init__(self, weights: np.ndarray, start: np.ndarray, settings: Settings, random: np.random.Generator):
        self._weights, self._settings, self._random = weights, settings, random
        self._dimensions = start.size
        self._strategy = self._begun(start)
        self._asked: list[np.ndarray] = []

    def ask(self) -> np.ndarray:
        """[C, D]"""
        self._asked = list(self._strategy.ask() or ())
        return np.array(self._asked)[:, : self._dimensions]

    def tell(self, scores: Scores) -> None:
        """Of what was asked last."""
        self._strategy.tell(self._asked, ranks(scores, self._weights).tolist())
        if any(reason in CONVERGED for reason in self._strategy.stop() or ()):
            self._strategy = self._begun(self._random.uniform(size=self._dimensions))

    def _begun(self, start: np.ndarray) -> CMAEvolutionStrategy:
        options = {"bounds": [0.0, 1.0], "popsize": self._settings.population, "verbose": -9,
                   "seed": np.nan, "randn": self._normals}  # its own stream, not numpy's global one  # fmt: skip
        start = np.append(start, 0.5) if start.size == 1 else start  # two at least; the second is then without effect
        return CMAEvolutionStrategy(np.clip(start, INSIDE, 1.0 - INSIDE), self._settings.step, options)

    def _normals(self, *shape: int) -> np.ndarray:
        return self._random.standard_normal(shape)


def _searches(problem: Problem, settings: Settings) -> list[_Search]:
    objectives = len(problem.goals.objectives)
    start = problem.space.unit(problem.space.default[None])[0]
    streams = np.random.default_rng(problem.seed).spawn(settings.scalarisations)
    weights = _weights(objectives, settings.scalarisations)
    return [_Search(row, start, settings, stream) for row, stream in zip(weights, streams, strict=True)]


def _weights(objectives: int, count: int) -> np.ndarray:
    """[count, objectives] that each sum to 1, none of them 0: quasi-random and uniform over all such weights, as the
    gaps between 0, the sorted coordinates of a Sobol point, and 1.
    """
    if objectives == 1:
        return np.ones((count, 1))
    cuts = np.sort(sobol_points(objectives - 1, count, seed=0), axis=1)
    return (1.0 - LEAST_WEIGHT) * np.diff(cuts, axis=1, prepend=0.0, append=1.0) + LEAST_WEIGHT / objectives
