"""Resampled statistics the slow way: every scenario written out as often as it was drawn."""

import math

from adwa_jax.episode import Outcome


def resampled(statistic, columns, counted, drawn):
    """R lists of C values; None where no scenario drawn counts."""
    return [[_one(statistic, {name: values[row] for name, values in columns.items()}, counted[row], times)
             for row in range(len(counted))] for times in drawn]  # fmt: skip


def _one(statistic, figures, counted, times):
    written_out = []
    for scenario, repeated in enumerate(times):
        for _ in range(int(repeated)):
            reached = figures["outcome"][scenario] == Outcome.REACHED
            if statistic.measure == "success":
                value, counts = float(reached), True
            else:
                value, counts = float(figures[statistic.measure][scenario]), reached or statistic.measure == "spl"
            if counts and counted[scenario]:
                written_out.append(value)
    written_out.sort(reverse=statistic.direction == "min")
    worst = written_out[: math.ceil(statistic.worst_share * len(written_out) - 1e-9)]
    return sum(worst) / len(worst) if worst else None
