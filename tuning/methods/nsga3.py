"""NSGA-III (Deb and Jain 2014), an evolutionary search for a whole front, by pymoo."""

import warnings
from math import comb

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.core.algorithm import Algorithm
from pymoo.core.evaluator import Evaluator
from pymoo.core.population import Population
from pymoo.core.problem import Problem as Bounds
from pymoo.core.termination import NoTermination
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM
from pymoo.operators.selection.tournament import TournamentSelection
from pymoo.problems.static import StaticProblem
from pymoo.util.ref_dirs import get_reference_directions

from tuning.hypervolume import margins, reference_point
from tuning.methods.method import Problem, Search
from tuning.methods.sobol import sobol_points
from tuning.objectives import Goals, Scores

VIOLATED = 1e6  # more than a candidate of any use is beyond the margins


class Settings(BaseModel):
    """Of this method."""

    model_config = ConfigDict(extra="forbid", strict=True)

    population: int | None = Field(None, ge=4, le=1024)
    """Candidates a generation, no fewer than objectives; by default a 64th of the budget, from 16 to 128."""

    crossover_eta: int = Field(15, ge=1, le=100)
    """Index of the simulated binary crossover; the larger, the nearer children are to their parents."""

    mutation_eta: int = Field(10, ge=1, le=100)
    """Index of the polynomial mutation, alike."""

    within_margins: bool = True
    """Whether to search first where the hypervolume is measured: among candidates no worse than the default constants,
    by more than its margins, in any objective. False, and where these violate a constraint: along the whole front."""


def nsga3(problem: Problem) -> Search:
    """A first generation of the default constants and Sobol points, then each the offspring of all before it.

    What violates a constraint loses to what violates it less, and that to what violates none; of those, what is beyond
    the margins loses to what is less beyond them, and that to what is within.
    """
    settings = Settings.model_validate(problem.settings)
    population = settings.population or min(max(problem.candidates // 64, 16), 128)
    algorithm = _algorithm(problem, max(population, len(problem.goals.objectives)), settings)
    left, first = problem.candidates, None
    while left > 0 and (asked := algorithm.ask()) is not None:
        scores = yield np.array(asked.get("X"))[:left]
        left -= len(asked)
        first = first or Scores(scores.objectives[:1], scores.violation[:1])  # of the default constants
        if left > 0:
            within = settings.within_margins and not first.violation.any()
            beyond = _beyond_margins(scores, first, problem.goals) if within else np.zeros(len(scores.violation))
            loss = np.where(scores.violation > 0.0, VIOLATED + scores.violation, beyond)
            _tell(algorithm, asked, scores.objectives, loss)


def _algorithm(problem: Problem, population: int, settings: Settings) -> Algorithm:
    dimensions, objectives = len(problem.space.parameters), len(problem.goals.objectives)
    algorithm = NSGA3(
        _directions(objectives, population),
        pop_size=population,
        sampling=_first(problem, population),  # pyright: ignore[reportArgumentType]
        crossover=SBX(eta=settings.crossover_eta, prob=1.0),
        mutation=PM(eta=settings.mutation_eta),
        selection=TournamentSelection(func_comp=_less_loss),
    )
    bounds = Bounds(n_var=dimensions, n_obj=objectives, n_ieq_constr=1, xl=0.0, xu=1.0)
    return algorithm.setup(bounds, termination=NoTermination(), seed=problem.seed)


def _less_loss(population: Population, pairs: np.ndarray, random_state: np.random.Generator, **_: object) -> np.ndarray:
    """[P, 1] the better of each pair, by lot among equals. pymoo's own draws some of these lots without the seed."""
    loss = np.ravel(population.get("CV"))
    winners = [random_state.choice([a, b]) if loss[a] == loss[b] else (a if loss[a] < loss[b] else b) for a, b in pairs]
    return np.array(winners, np.int64)[:, None]


def _first(problem: Problem, population: int) -> np.ndarray:
    default = problem.space.unit(problem.space.default[None])
    return np.concatenate([default, sobol_points(default.shape[1], population - 1, problem.seed)])


def _directions(objectives: int, most: int) -> np.ndarray:
    """[at most `most`, objectives] evenly spread weights (Das and Dennis 1998), at least one an objective."""
    finest = max(parts for parts in range(1, most + 1) if comb(parts + objectives - 1, parts) <= most)
    return get_reference_directions("das-dennis", objectives, n_partitions=finest)


def _beyond_margins(scores: Scores, default: Scores, goals: Goals) -> np.ndarray:
    """[C] by how many margins, over all objectives, candidates are beyond the hypervolume's reference point."""
    reference, unit = reference_point(goals, default), margins(goals, default)
    return np.maximum((scores.objectives - reference) / unit, 0.0).sum(axis=1)


def _tell(algorithm: Algorithm, asked: Population, objectives: np.ndarray, loss: np.ndarray) -> None:
    judged = StaticProblem(algorithm.problem, F=objectives, G=loss[:, None])
    Evaluator().eval(judged, asked)
    with warnings.catch_warnings():  # pymoo silences all of them, for good
        algorithm.tell(infills=asked)
