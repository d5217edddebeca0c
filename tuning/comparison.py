"""A candidate against the default constants, scenario by scenario.

Dimension letters: C candidates; S scenarios; R resamples.
"""

from collections.abc import Sequence

import numpy as np

from tuning.bootstrap import RESAMPLES, SUCCESS, draws, percentile_interval, resampled
from tuning.evaluations import Evaluations
from tuning.findings import Comparison, Interval
from tuning.intervals import paired_difference
from tuning.objectives import RATES, Goals, Statistic, mean_of_worst, sample


def compare(held_out: Evaluations, recommended: int, default: int, front: Sequence[int | None], goals: Goals,
            seed: int) -> Comparison:
    """The recommended candidate against the default, and whether a front member beats it on every objective.

    recommended, default and the front's members: rows of `held_out`; None: not driven there.
    """
    drawn = draws(held_out.done.shape[1], RESAMPLES, seed)
    driven = [(index, row) for index, row in enumerate(front) if row is not None and row != default]
    wins = {index: _wins(held_out, row, default, goals) for index, row in driven}
    better = next((index for index, won in wins.items() if all(won)), None)
    return Comparison(
        success=difference_interval(held_out, recommended, default, SUCCESS, drawn),
        objectives=tuple(difference_interval(held_out, recommended, default, statistic, drawn)
                         for statistic in goals.objectives),
        better_on_all=better is not None,
        why_not="" if better is not None else _why_not(held_out, default, list(wins.values()), goals),
        better_member=better,
    )  # fmt: skip


def difference(evaluations: Evaluations, row: int, other: int, statistic: Statistic) -> float:
    """Statistic of one row minus that of another, on the scenarios that count for both; NaN where there are none."""
    values, both = _pair(evaluations, row, other, statistic)
    return mean_of_worst(values[0][both], statistic) - mean_of_worst(values[1][both], statistic)


def difference_interval(evaluations: Evaluations, row: int, other: int, statistic: Statistic,
                        drawn: np.ndarray) -> Interval:
    """`difference` with its interval: Newcombe's for rates, else by the bootstrap. drawn: [R, S]."""
    values, both = _pair(evaluations, row, other, statistic)
    if statistic.measure in RATES and statistic.worst_share == 1.0 and both.any():
        first, second = values[:, both].astype(np.bool_)
        table = (first & second, first & ~second, ~first & second, ~first & ~second)
        return Interval(*paired_difference(*(int(cell.sum()) for cell in table)))
    columns = {name: figures[[row, other]] for name, figures in evaluations.columns.items()}
    repeats = resampled(statistic, columns, np.stack([both, both]), drawn)
    return percentile_interval(difference(evaluations, row, other, statistic), repeats[:, 0] - repeats[:, 1])


def _pair(evaluations: Evaluations, row: int, other: int, statistic: Statistic) -> tuple[np.ndarray, np.ndarray]:
    """Values [2, S] of both, and [S] bool where both count."""
    two = evaluations.rows(np.array([row, other]))
    values, kept = sample(statistic, two.columns, two.done)
    return values, kept[0] & kept[1]


def _wins(held_out: Evaluations, row: int, default: int, goals: Goals) -> list[bool]:
    """On which objectives a row is better than the default."""
    return [statistic.sign * difference(held_out, row, default, statistic) < 0 for statistic in goals.objectives]


def _why_not(held_out: Evaluations, default: int, wins: list[list[bool]], goals: Goals) -> str:
    if not wins:
        return "No front member other than the default constants was driven on the held-out scenarios."
    perfect = [statistic.label for statistic in goals.objectives if _is_perfect(held_out, default, statistic)]
    if perfect:
        return f"None can: the default constants already have the best possible {' and '.join(perfect)}."
    most = max(wins, key=sum)
    lost = [statistic.label for statistic, won in zip(goals.objectives, most, strict=True) if not won]
    return (f"Of {len(wins)} front members the nearest to it is better on {sum(most)} of {len(most)} objectives, "
            f"but not on {' and '.join(lost)}.")  # fmt: skip


def _is_perfect(held_out: Evaluations, row: int, statistic: Statistic) -> bool:
    """Whether nothing can be better: a rate at its end, or a count of what is bad at 0."""
    one = held_out.rows(np.array([row]))
    values, kept = sample(statistic, one.columns, one.done)
    worst = mean_of_worst(values[kept], statistic)
    return worst == (0.0 if statistic.direction == "min" else 1.0 if statistic.measure in RATES else np.inf)
