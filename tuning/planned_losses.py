"""What eq. 5's constants do, which is discrete: measures of planned paths, without driving.

Dimension letters: C candidates; D parameters; S scenarios.
"""

from collections.abc import Mapping, Sequence

import jax
import numpy as np

from adwa_jax.scenario import Scenario
from tuning.engine import Program, program_of
from tuning.plans_ahead import Pair, Planner
from tuning.space import Space

STANDS_FOR = {"length_ratio": "key_point_length", "length": "key_point_length", "time": "key_point_length",
              "breaking_points": "planned_key_point_breaking_points",
              "danger_points": "planned_key_point_danger_points"}  # fmt: skip
"""The planned path's measure that stands for one of the driven path; planned measures stand for themselves."""


def planned_measures(space: Space, unit: np.ndarray, scenarios: Sequence[Scenario]) -> dict[str, np.ndarray]:
    """Every figure of the planned paths by name, [C, S] each. unit: [C, D]."""
    candidates = [jax.tree.map(np.float32, space.preset(row).constants) for row in space.values(unit)]
    groups: dict[Program, list[Pair]] = {}
    for index, scenario in enumerate(scenarios):
        program = program_of(scenario, candidates[0], space.base.options)
        groups.setdefault(program, []).extend(Pair(candidate, index) for candidate in range(len(candidates)))
    found: dict[str, np.ndarray] = {}
    for program, pairs in groups.items():
        planner = Planner(scenarios, candidates, program.options, program.shape, pairs)
        for pair in pairs:
            for name, value in planner.planned(pair).figures.items():
                found.setdefault(name, np.zeros((len(unit), len(scenarios))))[pair] = value
    return found


def planned_losses(measures: Mapping[str, np.ndarray], weights: Mapping[str, float]) -> np.ndarray:
    """[C, S] weighted sum of the planned measures that stand for the objectives' measures, each over its mean.

    weights: measure -> weight, below 0 where more is better; what no plan tells is left out.
    """
    total = np.zeros(next(iter(measures.values())).shape)
    for name, weight in weights.items():
        planned = STANDS_FOR.get(name, name)
        if planned in measures:
            total = total + weight * measures[planned] / max(float(np.mean(measures[planned])), 1e-6)
    return total
