"""How much of the objectives' space the candidates so far dominate, against the episodes driven.

The reference point is the default constants' own figures, each made worse by a stated margin, and volumes are in units
of those margins: the default alone is worth 1, and methods are comparable wherever they were judged on the same suite.

Dimension letters: C candidates; O objectives; G generations.
"""

import moocore
import numpy as np

from tuning.evaluations import Evaluations
from tuning.findings import HypervolumeCurve
from tuning.front import front
from tuning.objectives import RATES, Goals, Scores

RATE_MARGIN = 0.1  # of success and collision rates
RELATIVE_MARGIN = 0.1  # of other figures, relative to the default's
LEAST_MARGIN = 0.05
EXACT = 4  # objectives up to which volumes are exact


def reference_point(goals: Goals, default: Scores) -> np.ndarray:
    """[O] minimised objectives from which volumes are measured; default: the default's scores, C = 1."""
    return default.objectives[0] + margins(goals, default)


def margins(goals: Goals, default: Scores) -> np.ndarray:
    """[O] > 0: 0.1 for a rate, else a tenth of the default's figure and 0.05 at least."""
    relative = np.maximum(RELATIVE_MARGIN * np.abs(default.objectives[0]), LEAST_MARGIN)
    is_rate = [statistic.measure in RATES for statistic in goals.objectives]
    return np.where(is_rate, RATE_MARGIN, relative)


def hypervolume(objectives: np.ndarray, reference: np.ndarray, unit: np.ndarray) -> float:
    """Volume between points [C, O] and the reference [O], in units [O] of each objective.

    Exact up to four objectives; beyond by moocore's deterministic quasi-random directions.
    """
    points = (reference - objectives) / unit
    points = points[np.all(points > 0, axis=1)]
    if not len(points):
        return 0.0
    if points.shape[1] <= EXACT:
        return float(moocore.hypervolume(-points, ref=np.zeros(points.shape[1])))
    return float(moocore.hv_approx(-points, ref=np.zeros(points.shape[1])))


def hypervolume_curve(training: Evaluations, goals: Goals) -> HypervolumeCurve:
    """Of the feasible candidates that have seen all scenarios, generation by generation.

    Row 0, the default, must have seen them all. Episodes of candidates dropped early are counted.
    """
    scores = goals.scores(training.columns, training.done)
    default = Scores(scores.objectives[:1], scores.violation[:1])
    reference, unit = reference_point(goals, default), margins(goals, default)
    counts = training.complete & (scores.violation == 0)
    generations = np.unique(training.generation)
    episodes = [int(training.done[training.generation <= generation].sum()) for generation in generations]
    best, values = np.zeros((0, reference.size)), []
    for generation in generations:
        added = scores.objectives[counts & (training.generation == generation)]
        best = _front_of(np.concatenate([best, added]))
        values.append(hypervolume(best, reference, unit))
    return HypervolumeCurve(np.array(episodes), np.array(values), reference)


def _front_of(objectives: np.ndarray) -> np.ndarray:
    return objectives[front(Scores(objectives, np.zeros(len(objectives))))]
