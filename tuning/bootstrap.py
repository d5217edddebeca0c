"""Resampling of the scenarios: how far figures could have come out otherwise on as many other scenarios of the kind.

A resample draws S of the S scenarios with replacement, the same for all candidates, so that differences between them
stay paired. It is kept as how often each scenario was drawn: means are then products of matrices.

Dimension letters: C candidates; S scenarios; O objectives; R resamples.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tuning.findings import Interval
from tuning.objectives import NOTHING, Goals, Statistic, sample

RESAMPLES = 1000
DIGITS = 9  # after the point: sums in another order must not tell equal candidates apart
SUCCESS = Statistic("success", "max")


class ResampledScores(NamedTuple):
    """`objectives.Scores` of C candidates in each resample."""

    objectives: np.ndarray  # [R, C, O] float64, all to be minimised, finite
    violation: np.ndarray  # [R, C] float64 ≥ 0


def draws(scenarios: int, resamples: int, seed: int) -> np.ndarray:
    """[R, S] float64: how often each scenario is drawn; every row sums to S ≥ 1."""
    chances = np.full(scenarios, 1.0 / scenarios)
    return np.random.default_rng(seed).multinomial(scenarios, chances, size=resamples).astype(np.float64)


def resampled(statistic: Statistic, columns: Mapping[str, np.ndarray], counted: np.ndarray,
              drawn: np.ndarray) -> np.ndarray:
    """[R, C] the statistic in the measure's own units; NaN where no scenario drawn counts.

    columns: name -> [C, S]; counted: [C, S] bool; drawn: [R, S].
    """
    values, kept = sample(statistic, columns, counted)
    count = drawn @ kept.T.astype(np.float64)
    if statistic.worst_share < 1.0:
        times = np.ascontiguousarray(drawn.T)
        worst = [_mean_of_worst(*candidate, statistic, times) for candidate in zip(values, kept, count.T, strict=True)]
        return np.stack(worst, axis=1)
    return _over(drawn @ np.where(kept, values, 0.0).T, count)


def resampled_scores(goals: Goals, columns: Mapping[str, np.ndarray], counted: np.ndarray,
                     drawn: np.ndarray) -> ResampledScores:
    """What `Goals.scores` gives on each resample."""
    objectives = np.stack([_minimised(statistic, resampled(statistic, columns, counted, drawn))
                           for statistic in goals.objectives], axis=2)  # fmt: skip
    violation = (~(resampled(SUCCESS, columns, counted, drawn) > 0)).astype(np.float64)
    for constraint in goals.constraints:
        statistic, sign = constraint.statistic, constraint.statistic.sign
        value = _minimised(statistic, resampled(statistic, columns, counted, drawn))
        violation += np.maximum(value - sign * constraint.bound, 0.0)
    return ResampledScores(objectives.round(DIGITS), violation.round(DIGITS))


def percentile_interval(value: float, repeats: np.ndarray) -> Interval:
    """The value with the 2.5 % and 97.5 % points of its resamples [R] (Efron 1979: the percentile method).

    Resamples without a scenario that counts, NaN, are left out.
    """
    known = repeats[~np.isnan(repeats)]
    if np.isnan(value) or not known.size:
        return Interval(value, float("nan"), float("nan"))
    low, high = np.quantile(known, [0.025, 0.975])
    return Interval(value, float(low), float(high))


def _mean_of_worst(values: np.ndarray, kept: np.ndarray, count: np.ndarray, statistic: Statistic,
                   times: np.ndarray) -> np.ndarray:
    """[R] of one candidate. values, kept: [S]; count: [R] scenarios drawn that count; times: [S, R], `draws` turned."""
    order = np.argsort(-statistic.sign * values, kind="stable")
    order = order[kept[order]]
    wanted = np.ceil(statistic.worst_share * count - 1e-9)
    likely = order[: int(1.25 * statistic.worst_share * order.size) + 64]  # the rest is hardly ever needed
    so_far = np.cumsum(times[likely], axis=0)
    if likely.size < order.size and np.any(so_far[-1] < wanted):
        likely, so_far = order, np.cumsum(times[order], axis=0)
    taken = np.diff(np.minimum(so_far, wanted), axis=0, prepend=0.0)
    return _over(values[likely] @ taken, wanted)


def _over(total: np.ndarray, count: np.ndarray) -> np.ndarray:
    return np.where(count > 0, total / np.maximum(count, 1.0), np.nan)


def _minimised(statistic: Statistic, value: np.ndarray) -> np.ndarray:
    return np.where(np.isnan(value), NOTHING, statistic.sign * value)
