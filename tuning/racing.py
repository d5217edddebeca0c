"""Racing: candidates judged on growing shares of the scenarios, those clearly beaten dropped on the way.

What is clear is decided on scenarios that both candidates saw, so that hard and easy ones cancel out.
Dimension letters: C candidates; B rivals, of which some may have been judged before; S scenarios.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from scipy import stats

from tuning.objectives import Constraint, Goals, Statistic, estimate, sample

ERROR = 0.01  # probability of calling a difference clear that is none, over all rivals of a candidate together
FEWEST = 8  # values of a measure, below which no difference in it is clear

Columns = dict[str, np.ndarray]
Judge = Callable[[np.ndarray, int, int], Mapping[str, np.ndarray]]
"""Candidates [c] int, first scenario, scenario after the last -> every figure by name, [c, scenarios]."""


class Raced(NamedTuple):
    """What came of C candidates."""

    columns: Columns  # by name, [C, S] each; 0 where not counted
    counted: np.ndarray  # [C, S] bool: what each was judged on, always the first scenarios


def raced(goals: Goals, candidates: int, scenarios: int, first: int, judge: Judge,
          rivals: Mapping[str, np.ndarray] | None = None) -> Raced:
    """Judge candidates on the first `first` scenarios, then on twice as many, and so on to all, without the dropped.

    rivals: columns [B, S] of candidates judged on everything before; they can beat those of this race.
    """
    counted = np.zeros((candidates, scenarios), np.bool_)
    columns: Columns = {}
    alive, start, stop = np.arange(candidates), 0, min(first, scenarios)
    while len(alive):
        _write(columns, counted, alive, slice(start, stop), judge(alive, start, stop))
        if stop == scenarios:
            break
        seen = _joined({name: values[alive, :stop] for name, values in columns.items()}, rivals, stop)
        alive = alive[~clearly_out(goals, seen, len(alive))]
        start, stop = stop, min(2 * stop, scenarios)
    return Raced(columns, counted)


def clearly_out(goals: Goals, columns: Mapping[str, np.ndarray], candidates: int) -> np.ndarray:
    """[C] bool of the first C of B candidates, columns [B, S]: cannot be on the front, as far as noise allows to say.

    Out is what clearly violates a constraint, and what another clearly beats in every objective, if that other keeps
    every constraint that the one could keep: it clearly does, or is clearly better in its statistic as well.
    """
    level = ERROR / max(len(columns["outcome"]) - 1, 1)
    beaten = np.logical_and.reduce([_worse(statistic, columns, level) for statistic in goals.objectives])
    violates = np.zeros(len(beaten), np.bool_)
    for constraint in goals.constraints:
        side = _side_of(constraint, columns, level)
        violates |= side > 0
        beaten &= (side < 0)[None, :] | _worse(constraint.statistic, columns, level)
    return (violates | beaten.any(axis=1))[:candidates]


def _worse(statistic: Statistic, columns: Mapping[str, np.ndarray], level: float) -> np.ndarray:
    """[B, B] bool: the first is clearly worse than the second. One-sided paired t test.

    What has no value at all, having solved nothing, is worse than whatever has `FEWEST`.
    """
    mean, residuals, counts = _linearised(statistic, columns)
    total = residuals.shape[1]
    covariance = np.einsum("as,bs->ab", residuals, residuals) / total  # no BLAS: the same bits on any count of threads
    spread = np.diag(covariance)[:, None] + np.diag(covariance)[None, :] - 2.0 * covariance
    margin = _quantile(level, total) * np.sqrt(np.maximum(spread, 0.0) / max(total - 1, 1))
    enough = counts >= FEWEST
    clear = (mean[:, None] - mean[None, :] > margin) & enough[:, None]
    return (clear | (counts == 0)[:, None]) & enough[None, :]


def _side_of(constraint: Constraint, columns: Mapping[str, np.ndarray], level: float) -> np.ndarray:
    """[B] 1 where the constraint is clearly violated, −1 where it clearly holds, else 0. One-sided t test."""
    mean, residuals, counts = _linearised(constraint.statistic, columns)
    total = residuals.shape[1]
    excess = mean - constraint.statistic.sign * constraint.bound
    margin = _quantile(level, total) * np.sqrt(np.mean(residuals**2, axis=1) / max(total - 1, 1))
    return np.where((np.abs(excess) > margin) & (counts >= FEWEST), np.sign(excess), 0.0)


def _linearised(statistic: Statistic,
                columns: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Estimates [B], minimised, 0 of no value; what every scenario adds to the error of each, [B, S], to first order
    (its influence; 0 where it does not count); and counts of values [B].
    """
    values, kept = sample(statistic, columns, np.ones_like(columns["outcome"], np.bool_))
    counts = kept.sum(axis=1)
    mean = np.nan_to_num(estimate(statistic, columns, np.ones_like(kept))) * statistic.sign
    rows = zip(values * statistic.sign, kept, mean, strict=True)
    return mean, np.stack([_influence(row, mask, centre, statistic.worst_share) for row, mask, centre in rows]), counts


def _influence(values: np.ndarray, kept: np.ndarray, mean: float, worst_share: float) -> np.ndarray:
    """[S] of a mean, or of a mean of the worst share (Rockafellar and Uryasev 2000), over the values [S] kept."""
    if not kept.any():
        return np.zeros(len(values))
    count = np.ceil(worst_share * kept.sum() - 1e-9)
    threshold = np.sort(values[kept])[-int(count)]
    if worst_share == 1.0:
        beyond = values - mean
    else:
        beyond = threshold + np.maximum(values - threshold, 0.0) * kept.sum() / count - mean
    return np.where(kept, beyond, 0.0) * (len(values) / kept.sum())


def _quantile(level: float, total: int) -> float:
    return float(stats.t.ppf(1.0 - level, max(total - 1, 1)))


def _write(columns: Columns, counted: np.ndarray, rows: np.ndarray, part: slice,
           judged: Mapping[str, np.ndarray]) -> None:
    for name, values in judged.items():
        columns.setdefault(name, np.zeros(counted.shape, values.dtype))[rows, part] = values
    counted[rows, part] = True


def _joined(columns: Columns, rivals: Mapping[str, np.ndarray] | None, stop: int) -> Columns:
    if rivals is None:
        return columns
    return {name: np.concatenate([values, rivals[name][:, :stop]]) for name, values in columns.items()}
