"""What matters: objectives and hard constraints, computed from the measures of every candidate on common scenarios.

Dimension letters: C candidates; S scenarios; O objectives.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from adwa_jax.episode import Outcome
from tuning.results import OVER_ALL

Direction = Literal["min", "max"]
RATES = ("success", "collision")
NOTHING = 1e3  # stands for a mean over no scenario, as something bad in either direction; such a candidate violates
COLLISIONS = tuple(outcome for outcome in Outcome if outcome.name.startswith("HIT"))


@dataclass(frozen=True)
class Statistic:
    """A mean of a measure over scenarios, or over the worst share of them.

    Rates and the measures of `results.OVER_ALL` count every scenario, the others those that the candidate solved.
    """

    measure: str  # of RATES or a column's name
    direction: Direction  # what is better
    worst_share: float = 1.0  # below 1: conditional value at risk, the mean of the worst share of the scenarios

    @property
    def label(self) -> str:
        """For tables and axes."""
        return self.measure if self.worst_share == 1.0 else f"{self.measure} (worst {self.worst_share:.0%})"

    @property
    def sign(self) -> float:
        """1 where less is better, −1 where more is."""
        return 1.0 if self.direction == "min" else -1.0


@dataclass(frozen=True)
class Constraint:
    """A statistic that must not be worse than a bound."""

    statistic: Statistic
    bound: float


@dataclass(frozen=True)
class Goals:
    """Objectives, and constraints that come before them."""

    objectives: tuple[Statistic, ...]  # O
    constraints: tuple[Constraint, ...] = ()

    def scores(self, columns: Mapping[str, np.ndarray], counted: np.ndarray) -> "Scores":
        """Scores of C candidates. columns: name -> [C, S]; counted: [C, S] bool, on which each was judged."""
        objectives = np.stack([_minimised(statistic, estimate(statistic, columns, counted))
                               for statistic in self.objectives], axis=1)  # fmt: skip
        none_solved = ~np.any(sample(Statistic("success", "max"), columns, counted)[0] > 0, axis=1, where=counted)
        violation = none_solved.astype(np.float64)
        for constraint in self.constraints:
            statistic, sign = constraint.statistic, constraint.statistic.sign
            value = _minimised(statistic, estimate(statistic, columns, counted))
            violation = violation + np.maximum(value - sign * constraint.bound, 0.0)
        return Scores(objectives, violation, columns, counted)


class Scores(NamedTuple):
    """Of C candidates."""

    objectives: np.ndarray  # [C, O] float64, all to be minimised, finite
    violation: np.ndarray  # [C] float64 ≥ 0; 0: all constraints hold and something was solved
    columns: Mapping[str, np.ndarray] | None = None  # [C, S] each, what they were computed from; None: not said
    counted: np.ndarray | None = None  # [C, S] bool


DEFAULT_OBJECTIVES = (Statistic("success", "max"), Statistic("length_ratio", "min"),
                      Statistic("breaking_points", "min"), Statistic("danger_points", "min"))  # fmt: skip
"""Those of §3.4."""


def sample(statistic: Statistic, columns: Mapping[str, np.ndarray],
           counted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values [C, S] float64 of the statistic's measure, and [C, S] bool which of them count."""
    reached = columns["outcome"] == Outcome.REACHED
    if statistic.measure == "success":
        return reached.astype(np.float64), counted
    if statistic.measure == "collision":
        return np.isin(columns["outcome"], COLLISIONS).astype(np.float64), counted
    values = columns[statistic.measure].astype(np.float64)
    return values, counted if statistic.measure in OVER_ALL else counted & reached


def estimate(statistic: Statistic, columns: Mapping[str, np.ndarray], counted: np.ndarray) -> np.ndarray:
    """[C] the statistic itself, in the measure's own units; NaN where no scenario counts."""
    values, kept = sample(statistic, columns, counted)
    return np.array([mean_of_worst(row[mask], statistic) for row, mask in zip(values, kept, strict=True)])


def mean_of_worst(values: np.ndarray, statistic: Statistic) -> float:
    """Mean of the worst ⌈share · n⌉ of n values; NaN of none."""
    if not values.size:
        return float("nan")
    count = int(np.ceil(statistic.worst_share * values.size - 1e-9))
    worst_first = np.sort(values * -statistic.sign, kind="stable")[:count] * -statistic.sign
    return float(np.mean(worst_first))


def measures_of(columns: Sequence[str]) -> tuple[str, ...]:
    """What a statistic may name, given the engine's columns."""
    return (*RATES, *(name for name in columns if name != "outcome"))


def _minimised(statistic: Statistic, value: np.ndarray) -> np.ndarray:
    return np.where(np.isnan(value), NOTHING, statistic.sign * value)
