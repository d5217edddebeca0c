"""How much of an objective's variation each parameter explains by itself.

Dimension letters: W candidates; D parameters; O objectives.
"""

import numpy as np
from scipy.stats import rankdata

from tuning.evaluations import Evaluations
from tuning.objectives import Goals
from tuning.space import Space

DEGREE = 3  # rises, falls, and one best value in between


def importance(training: Evaluations, goals: Goals, space: Space) -> np.ndarray:
    """[D, O] in [0, 1]: adjusted R² (Ezekiel 1930) of the objective's ranks on a cubic of the parameter.

    The parameter is taken on its own scale, as a point of the unit interval. All candidates count, on the scenarios
    that all of them have seen. Ranks, so that a few hopeless candidates do not decide; adjusted, so that chance alone
    gives 0 on average.

    What it is not: a cause. Parameters that a method moved together share what either explains; what shows only in
    their interplay is missed; a method that soon keeps to good values shows less of what bad ones would do.
    """
    common = np.broadcast_to(training.done.all(axis=0), training.done.shape)
    objectives = goals.scores(training.columns, common).objectives
    unit = space.unit(training.values)
    return np.array([[explained(parameter, objective) for objective in objectives.T] for parameter in unit.T])


def explained(parameter: np.ndarray, objective: np.ndarray) -> float:
    """Share of the variance of the objective's ranks that a cubic of the parameter explains. Both: [W]."""
    ranks = rankdata(objective)
    ranks -= ranks.mean()
    total = float(ranks @ ranks)
    degree = min(DEGREE, np.unique(parameter).size - 1)
    freedom = ranks.size - degree - 1
    if total == 0.0 or degree == 0 or freedom < 1:
        return 0.0
    powers = np.polynomial.legendre.legvander(2.0 * parameter - 1.0, degree)
    coefficients, _, _, _ = np.linalg.lstsq(powers, ranks)
    rest = float(np.sum((ranks - powers @ coefficients) ** 2))
    return float(np.clip(1.0 - rest / freedom / (total / (ranks.size - 1)), 0.0, 1.0))
