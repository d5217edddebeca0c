"""Which candidates no other one beats: the Pareto front, constraints first.

Means over the successes depend on which scenarios a candidate solved: one that solves the easy ones alone looks short
and safe there, and may stand on the front at its low success. Constraints and the rules of choice keep it out.

Dimension letters: C candidates; N members of a front; O objectives; R resamples.
"""

import moocore
import numpy as np

from tuning.bootstrap import ResampledScores
from tuning.objectives import Scores


def non_dominated(scores: Scores) -> np.ndarray:
    """[C] bool: no other candidate is as good in every objective and better in one.

    Constraints come first (Deb 2000): candidates that violate them count only where all do, and then only those that
    violate them least. Equals do not dominate each other.
    """
    lawful = scores.violation == np.min(scores.violation, initial=np.inf)  # 0 where any is feasible
    found = np.zeros(lawful.shape, np.bool_)
    found[lawful] = moocore.is_nondominated(scores.objectives[lawful], keep_weakly=True)
    return found


def front(scores: Scores) -> np.ndarray:
    """[N] indices of the non-dominated candidates, rising; of equals the first."""
    members = np.flatnonzero(non_dominated(scores))
    _, first = np.unique(scores.objectives[members], axis=0, return_index=True)
    return members[np.sort(first)]


def chances(resampled: ResampledScores) -> np.ndarray:
    """[C] share of the resamples in which each candidate is non-dominated among all C, constraints first."""
    return np.mean([non_dominated(Scores(*one)) for one in zip(*resampled, strict=True)], axis=0)


def thinned(objectives: np.ndarray, limit: int) -> np.ndarray:
    """At most `limit` indices into a front [N, O] ≥ 1, rising: the best in each objective, then always the farthest
    from those taken, in units of the front's own ranges (Gonzalez 1985).
    """
    points = unit_range(objectives)
    taken = list(dict.fromkeys(np.argmin(points, axis=0).tolist()))[:limit]
    apart = np.min([_distance(points, points[index]) for index in taken], axis=0)
    while len(taken) < min(limit, len(points)):
        apart[taken] = -1.0  # equals of what was taken lie at 0
        taken.append(int(np.argmax(apart)))
        apart = np.minimum(apart, _distance(points, points[taken[-1]]))
    return np.sort(np.array(taken))


def unit_range(objectives: np.ndarray) -> np.ndarray:
    """[N, O] from 0 at a front's best to 1 at its worst; 0 where all are alike."""
    least = objectives.min(axis=0)
    span = objectives.max(axis=0) - least
    return (objectives - least) / np.where(span > 0, span, 1.0)


def _distance(points: np.ndarray, point: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points - point, axis=1)
