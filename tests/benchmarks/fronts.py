"""How much of the objectives' space each method dominates with as many candidates, in units of the default's margins.

    python -m tests.benchmarks.fronts [suite] [candidates] [scenarios] [seed ...]
"""

import sys

import numpy as np

from adwa_jax.presets import extended
from scenarios.suite import Suite, make_suite
from tuning.engine import judge_pairs
from tuning.hypervolume import hypervolume, margins, reference_point
from tuning.methods import method_named, settings_of
from tuning.methods.method import Problem
from tuning.objectives import DEFAULT_OBJECTIVES, Constraint, Goals, Scores, Statistic
from tuning.space import Parameter, Space

METHODS = ("sobol", "nsga3", "sweep")
GOALS = Goals(DEFAULT_OBJECTIVES, (Constraint(Statistic("success", "max"), 0.9),))
SPACE = Space((
    Parameter("local_heading", 0.05, 2.0, "log"), Parameter("clearance", 0.02, 1.0, "log"),
    Parameter("progress", 0.1, 2.0, "log"), Parameter("on_route", 0.05, 2.0, "log"),
    Parameter("contact_time", 0.3, 5.0, "log"), Parameter("mover_clearance", 0.05, 2.0, "log"),
    Parameter("clearance_cap", 0.15, 0.8), Parameter("mover_margin", 0.02, 0.25),
), extended())  # fmt: skip
SUITE_SEED = 100  # the same scenarios for all methods and seeds


def main(suite: str = "paper-20", candidates: int = 256, scenarios: int = 24, *seeds: int) -> None:
    """Print a line a method and seed."""
    training = make_suite(suite, SUITE_SEED, scenarios)
    default = judged(SPACE.unit(SPACE.default[None]), training)
    reference, unit = reference_point(GOALS, default), margins(GOALS, default)
    for seed in seeds or (1,):
        for name in METHODS:
            objectives = np.concatenate([default.objectives, found_by(name, seed, candidates, training)])
            print(f"{suite}, {name}, seed {seed}: {hypervolume(objectives, reference, unit):.2f}", flush=True)


def found_by(name: str, seed: int, candidates: int, training: Suite) -> np.ndarray:
    """[C, O] objectives of a method's candidates that violate nothing."""
    search = method_named(name)(Problem(SPACE, GOALS, seed, candidates, training, settings_of(name)().model_dump()))
    found, left, points = [np.zeros((0, len(GOALS.objectives)))], candidates, next(search, None)
    while points is not None and len(points) <= left:
        scores, left = judged(points, training), left - len(points)
        found.append(scores.objectives[scores.violation == 0])
        try:
            points = search.send(scores)
        except StopIteration:
            break
    return np.concatenate(found)


def judged(points: np.ndarray, training: Suite) -> Scores:
    """Of points [C, D] of the unit cube."""
    constants = [SPACE.preset(row).constants for row in SPACE.values(points)]
    answers = judge_pairs(training.scenarios, constants, SPACE.base.options)
    return GOALS.scores(answers.columns, answers.done)


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(int, sys.argv[2:]))
