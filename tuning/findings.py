"""What the analysis of a job finds, as data: what reports draw and commands print.

Dimension letters: D parameters; O objectives; N members of the front; G generations; R resamples of the scenarios.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tuning.objectives import Goals

BY_HAND = "by hand"  # the rule of a choice that a person made


class Interval(NamedTuple):
    """An estimate with its 95 % interval, in the measure's own units; NaN where no scenario counts."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Judgement:
    """Of one candidate on one suite."""

    scenarios: int
    success: Interval  # Wilson
    objectives: tuple[Interval, ...]  # O, in the order of the goals; a rate's by Wilson, others by bootstrap
    feasible: bool  # all constraints hold


@dataclass(frozen=True)
class Member:
    """A candidate of the front, or the default constants."""

    row: int  # of the training evaluations
    values: np.ndarray  # [D]
    training: Judgement
    held_out: Judgement | None  # None: not driven there
    non_dominated: float  # share of the resamples in which it is feasible and no other candidate dominates it


@dataclass(frozen=True)
class Choice:
    """One member, picked by a rule."""

    rule: str  # of choice.RULES, or BY_HAND
    member: int  # index into the front
    shares: np.ndarray  # [N] of the resamples in which each member of the front is picked; the rest goes to others
    reason: str  # one sentence for people

    @property
    def stability(self) -> float:
        """Share of the resamples in which the same member is picked; low among near-equals. NaN: picked by hand."""
        return float(self.shares[self.member])


@dataclass(frozen=True)
class HypervolumeCurve:
    """How much of the objectives' space the candidates so far dominate."""

    episodes: np.ndarray  # [G] driven up to and with each generation
    value: np.ndarray  # [G]
    reference: np.ndarray  # [O] the point it is measured from, minimised objectives


@dataclass(frozen=True)
class Findings:
    """All of it."""

    parameters: tuple[str, ...]  # D
    goals: Goals
    default: Member
    front: tuple[Member, ...]  # N, best first objective first
    choices: tuple[Choice, ...]
    recommended: int  # index into `choices`
    hypervolume: HypervolumeCurve
    importance: np.ndarray  # [D, O] in [0, 1]: share of an objective's variation that a parameter explains by itself
    compared: "Comparison | None"  # the recommended member against the default, held out; None: not driven there

    @property
    def picked(self) -> str:
        """What the recommended member is called: "chosen" where it was picked by hand."""
        return "chosen" if self.choices[self.recommended].rule == BY_HAND else "recommended"


@dataclass(frozen=True)
class Comparison:
    """Paired differences, recommended − default, on common scenarios, with 95 % intervals.

    What counts the successes alone is compared on the scenarios that both solve: else who solves more, and so the hard
    ones as well, would look worse.
    """

    success: Interval  # Newcombe's for paired proportions
    objectives: tuple[Interval, ...]  # O; rates by Newcombe's, others by bootstrap over scenarios; own units
    better_on_all: bool  # whether some front member beats the default on every objective, point estimates
    why_not: str  # the sentence for it, if none does; else empty
    better_member: int | None = None  # index into the front of the one that does
