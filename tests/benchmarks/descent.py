"""The method `gradient` beside CMA-ES: how far the hard objective falls on scenarios neither saw, and at what cost.

    python -m tests.benchmarks.descent [suite] [preset] [seed ...]

Both begin at the same eight starts with the same scalarisations. CMA-ES, one search a start, all judged together, has
the wall time that the gradients took; a seed is run twice, so that nothing is compiled in the run that counts.
"""

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from cma import CMAEvolutionStrategy

from adwa_jax.presets import PRESETS
from scenarios.suite import Suite, make_suite
from tuning.engine import judge_pairs
from tuning.gradients import Scaling, scaling_of
from tuning.methods.gradient import LENGTHS, Settings, gradient, starts_of
from tuning.methods.method import Problem
from tuning.objectives import DEFAULT_OBJECTIVES, Goals, Scores
from tuning.space import Parameter, Space

TRAINING, HELD_OUT, ROUNDS = 32, 256, 2
WEIGHTS = {"paper": ("local_heading", "clearance", "velocity", "global_heading"),
           "extended": ("local_heading", "clearance", "progress", "on_route", "contact_time")}  # fmt: skip
TRUST = ("surrogate", "hard", "blend")
GOALS = Goals(DEFAULT_OBJECTIVES)


@dataclass
class Descent:
    """What came of a search from every start."""

    name: str
    seconds: float
    candidates: int
    ends: np.ndarray  # [B, D]


def main(suite: str = "paper-15", preset: str = "paper", *seeds: int) -> None:
    """Print a line a search."""
    names = WEIGHTS[preset]
    space = Space((*(Parameter(name, 0.0, 1.0) for name in names), Parameter("clearance_cap", 0.2, 1.0)),
                  PRESETS[preset]())  # fmt: skip
    print(f"{suite}, {preset}, {TRAINING} training and {HELD_OUT} held-out scenarios")
    for seed in seeds or (0,):
        found = [descents(space, make_suite(suite, 1000 + seed, TRAINING), seed) for _ in range(2)][-1]
        show(space, make_suite(suite, 2000 + seed, HELD_OUT), seed, *found)


def descents(space: Space, training: Suite, seed: int) -> tuple[np.ndarray, np.ndarray, Scaling, list[Descent]]:
    """Starts [B, D], weights [B, O], the scaling of the objectives, and each search's end."""
    free = np.ones(len(space.names), bool)
    problem = Problem(space, GOALS, seed, 0, training)
    starts, weights = starts_of(problem, Settings(), free)
    scaling = scaling_of(judge(space, starts, training))
    found = [by_gradient(space, training, seed, trust, starts, weights, scaling) for trust in TRUST]
    found += [by_cmaes(space, training, seed, one, starts, weights, scaling) for one in (found[0], found[-1])]
    return starts, weights, scaling, found


def judge(space: Space, points: np.ndarray, suite: Suite) -> Scores:
    """The hard planner's scores of points [C, D] of the unit cube."""
    candidates = [space.preset(row).constants for row in space.values(points)]
    judged = judge_pairs(suite.scenarios, candidates, space.base.options)
    return GOALS.scores(judged.columns, judged.done)


def by_gradient(space: Space, training: Suite, seed: int, trust: str, starts: np.ndarray, weights: np.ndarray,
                scaling: Scaling) -> Descent:
    """`ROUNDS` rounds of the method."""
    settings = Settings(trust=trust)
    proposals = {"surrogate": settings.steps, "hard": len(LENGTHS), "blend": settings.steps + len(LENGTHS)}[trust]
    probes = 2 * settings.es_pairs * (1 if trust == "surrogate" else ROUNDS)  # the first round's tell the agreement
    candidates = len(starts) * (1 + probes + proposals * ROUNDS)
    search = gradient(Problem(space, GOALS, seed, candidates, training, settings.model_dump()))
    return followed(f"gradient, {trust}", space, training, search, len(starts), weights, scaling)


def followed(name: str, space: Space, training: Suite, search: Iterator, count: int, weights: np.ndarray,
             scaling: Scaling) -> Descent:
    """Of every start the best point that was judged."""
    begin, ends, best, candidates = time.perf_counter(), np.zeros(()), np.full(count, np.inf), 0
    points = next(search)
    while points is not None:
        scores = judge(space, points, training)
        each = points.reshape(count, -1, points.shape[1])
        values = np.stack([scaling.scalarised(scores, row) for row in weights])
        values = np.stack([row.reshape(count, -1)[place] for place, row in enumerate(values)])
        chosen = np.argmin(values, axis=1)
        better = values[np.arange(count), chosen] < best
        ends = np.where(better[:, None], each[np.arange(count), chosen], ends)
        best, candidates = np.minimum(best, values.min(axis=1)), candidates + len(points)
        points = _sent(search, scores)
    return Descent(name, time.perf_counter() - begin, candidates, ends)


def _sent(search: Iterator, scores: Scores) -> np.ndarray | None:
    try:
        return search.send(scores)  # type: ignore[attr-defined]
    except StopIteration:
        return None


def by_cmaes(space: Space, training: Suite, seed: int, beside: Descent, starts: np.ndarray, weights: np.ndarray,
             scaling: Scaling) -> Descent:
    """As long as another descent took."""
    until = time.perf_counter() + beside.seconds

    def search() -> Iterator:
        scores = yield starts
        options = {"bounds": [0.0, 1.0], "popsize": 8, "verbose": -9, "seed": seed + 1}
        each = [CMAEvolutionStrategy(start, 0.2, options) for start in starts]
        while time.perf_counter() < until:
            asked = [strategy.ask() for strategy in each]
            scores = yield np.concatenate(asked)
            for place, strategy in enumerate(each):
                values = scaling.scalarised(scores, weights[place])[8 * place : 8 * place + 8]
                strategy.tell(asked[place], values.tolist())

    return followed(f"cmaes, beside {beside.name}", space, training, search(), len(starts), weights, scaling)


def show(space: Space, held_out: Suite, seed: int, starts: np.ndarray, weights: np.ndarray, scaling: Scaling,
         found: list[Descent]) -> None:
    """Gains on the held-out scenarios: of the scalarised objective, 0 the best start's and 1 the worst one's."""
    before = own(scaling, judge(space, starts, held_out), weights)
    for one in found:
        gain = before - own(scaling, judge(space, one.ends, held_out), weights)
        cost = one.seconds / gain.sum() if gain.sum() > 0 else np.inf
        print(f"seed {seed}, {one.name}: {(gain > 0).sum()} of {len(gain)} better, mean gain {gain.mean():.3f}, "
              f"{one.candidates} candidates, {one.seconds:.1f} s, {cost:.1f} s a unit of gain", flush=True)  # fmt: skip


def own(scaling: Scaling, scores: Scores, weights: np.ndarray) -> np.ndarray:
    """[B] each start's own objective."""
    return np.array([scaling.scalarised(scores, row)[place] for place, row in enumerate(weights)])


if __name__ == "__main__":
    main(*sys.argv[1:3], *map(int, sys.argv[3:]))
