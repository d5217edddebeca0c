"""What a job's evaluations say: the front, how sure it is, which member to take, and whether held-out scenarios agree.

Intervals of rates are Wilson's, those of other figures percentiles of the bootstrap over scenarios (`bootstrap`).

Dimension letters: W candidates; N members; H rows driven on held-out scenarios; O objectives; R resamples.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tuning.bootstrap import (
    RESAMPLES,
    SUCCESS,
    ResampledScores,
    draws,
    percentile_interval,
    resampled,
    resampled_scores,
)
from tuning.choice import RULES, ChoiceSettings, Rule, Standing, pick, reason
from tuning.comparison import compare
from tuning.evaluations import Evaluations
from tuning.findings import BY_HAND, Choice, Comparison, Findings, Interval, Judgement, Member
from tuning.front import chances, front, thinned
from tuning.hypervolume import hypervolume_curve
from tuning.importance import importance
from tuning.intervals import wilson
from tuning.objectives import RATES, Goals, Scores, Statistic, estimate
from tuning.space import Space

SHOWN = 32  # members of a front, beside those that a rule picks


def analyse(training: Evaluations, held_out: Evaluations | None, held_out_rows: np.ndarray, goals: Goals, space: Space,
            choice: ChoiceSettings, seed: int) -> Findings:
    """All findings; the same for the same arguments.

    Row 0 of `training`, the default, must have seen all scenarios. held_out_rows: [H], the training row of each row of
    `held_out`. seed: of the resamples. The front is that of `front_rows` with what `chosen_rows` adds.
    """
    candidates = _candidates(training, goals)
    repeats, success = _resampled(candidates, goals, seed)
    shown = _shown(candidates, choice, goals)
    rows_there = [] if held_out is None else np.asarray(held_out_rows).tolist()
    held_out_of = {row: index for index, row in enumerate(rows_there)}
    default, *members = _members(candidates, [0, *shown], chances(repeats), held_out, held_out_of, goals, seed)
    choices = _choices(candidates, shown, repeats, success, choice, goals)
    recommended = RULES.index(choice.rule)
    return Findings(
        parameters=training.parameters,
        goals=goals,
        default=default,
        front=tuple(members),
        choices=choices,
        recommended=recommended,
        hypervolume=hypervolume_curve(training, goals),
        importance=importance(training, goals, space),
        compared=_compared(held_out, held_out_of, members, choices[recommended].member, goals, seed),
    )


def front_rows(training: Evaluations, goals: Goals, limit: int) -> np.ndarray:
    """[N ≤ limit] rows of the non-dominated candidates among those that hold the constraints and saw all scenarios.

    Thinned to the best in each objective and an even spread. Where nothing is feasible: those that violate least.
    """
    candidates = _candidates(training, goals)
    members = candidates.members
    return candidates.rows[members[thinned(candidates.scores.objectives[members], limit)]]


def chosen_rows(training: Evaluations, goals: Goals, choice: ChoiceSettings) -> np.ndarray:
    """Rows that the rules pick from the whole front, one for each of `RULES` in their order; may repeat."""
    candidates = _candidates(training, goals)
    return candidates.rows[[candidates.members[index] for index in _picked(candidates, choice, goals).values()]]


def optimism(member: Member, goals: Goals) -> tuple[float, ...] | None:
    """O: by how much training scenarios flatter a member against held-out ones, in each objective's own units.

    Positive: better in training than held out. None: not driven there.
    """
    if member.held_out is None:
        return None
    pairs = zip(goals.objectives, member.training.objectives, member.held_out.objectives, strict=True)
    return tuple(statistic.sign * (there.value - here.value) for statistic, here, there in pairs)


def chosen_by_hand(findings: Findings, member: int, held_out: Evaluations | None, held_out_rows: np.ndarray,
                   seed: int) -> Findings:
    """The findings with another member in the place of the recommended one, compared with the default as that was.

    member: index into the front. held_out, held_out_rows, seed: those of `analyse`.
    """
    by_hand = Choice(BY_HAND, member, np.full(len(findings.front), np.nan), "Picked by hand.")
    held_out_of = {row: index for index, row in enumerate(np.asarray(held_out_rows).tolist())}
    compared = _compared(held_out, held_out_of, list(findings.front), member, findings.goals, seed)
    return replace(findings, choices=(*findings.choices, by_hand), recommended=len(findings.choices),
                   compared=compared)  # fmt: skip


def judgements(evaluations: Evaluations, rows: Sequence[int], goals: Goals, seed: int) -> list[Judgement]:
    """Figures of some rows with their intervals, each over the scenarios that it has seen."""
    some = evaluations.rows(np.asarray(rows, np.intp))
    drawn = draws(some.done.shape[1], RESAMPLES, seed)
    success = _intervals(some, SUCCESS, drawn)
    objectives = [_intervals(some, statistic, drawn) for statistic in goals.objectives]
    feasible = goals.scores(some.columns, some.done).violation == 0
    return [
        Judgement(int(done.sum()), success[index], tuple(column[index] for column in objectives), bool(feasible[index]))
        for index, done in enumerate(some.done)
    ]


@dataclass(frozen=True)
class _Candidates:
    """Those that have seen all scenarios."""

    rows: np.ndarray  # [W'] of the training evaluations
    evaluations: Evaluations  # of those rows
    scores: Scores  # of those rows
    members: np.ndarray  # [N] the whole front, indices into those rows
    success: np.ndarray  # [W'] rate

    def standing(self) -> Standing:
        """The whole front, as the rules look at it."""
        objectives, violation = self.scores.objectives, self.scores.violation
        scenarios = self.evaluations.done.shape[1]
        return Standing(objectives[self.members], violation[self.members], self.success[self.members], scenarios)


def _candidates(training: Evaluations, goals: Goals) -> _Candidates:
    rows = np.flatnonzero(training.complete)
    evaluations = training.rows(rows)
    scores = goals.scores(evaluations.columns, evaluations.done)
    success = estimate(SUCCESS, evaluations.columns, evaluations.done)
    return _Candidates(rows, evaluations, scores, front(scores), success)


def _resampled(candidates: _Candidates, goals: Goals, seed: int) -> tuple[ResampledScores, np.ndarray]:
    """Scores of all candidates, and success [R, N] of the front's members, in each resample."""
    columns, done = candidates.evaluations.columns, candidates.evaluations.done
    drawn = draws(done.shape[1], RESAMPLES, seed)
    success = resampled(SUCCESS, columns, done, drawn)[:, candidates.members]
    return resampled_scores(goals, columns, done, drawn), success


def _picked(candidates: _Candidates, choice: ChoiceSettings, goals: Goals) -> dict[Rule, int]:
    """What each rule picks, as an index into the members."""
    standing = candidates.standing()
    return {rule: pick(rule, standing, choice, goals) for rule in RULES}


def _shown(candidates: _Candidates, choice: ChoiceSettings, goals: Goals) -> list[int]:
    """The members that are reported, as indices into the candidates; best first objective first."""
    objectives = candidates.scores.objectives[candidates.members]
    kept = set(thinned(objectives, SHOWN).tolist()) | set(_picked(candidates, choice, goals).values())
    order = np.lexsort(objectives.T[::-1])
    return [int(candidates.members[index]) for index in order if index in kept]


def _members(candidates: _Candidates, which: list[int], likely: np.ndarray, held_out: Evaluations | None,
             held_out_of: dict[int, int], goals: Goals, seed: int) -> list[Member]:
    """which: indices into the candidates; held_out_of: training row -> row of `held_out`."""
    rows = [int(candidates.rows[index]) for index in which]
    training = judgements(candidates.evaluations, which, goals, seed)
    driven = [row for row in rows if row in held_out_of]
    there = judgements(held_out, [held_out_of[row] for row in driven], goals, seed) if held_out is not None else []
    judged = dict(zip(driven, there, strict=True))
    return [Member(row, candidates.evaluations.values[index], here, judged.get(row), float(likely[index]))
            for row, index, here in zip(rows, which, training, strict=True)]  # fmt: skip


def _choices(candidates: _Candidates, shown: list[int], repeats: ResampledScores, success: np.ndarray,
             choice: ChoiceSettings, goals: Goals) -> tuple[Choice, ...]:
    standing, members = candidates.standing(), candidates.members
    again = [Standing(objectives, violation, rate, standing.scenarios) for objectives, violation, rate
             in zip(repeats.objectives[:, members], repeats.violation[:, members], success, strict=True)]  # fmt: skip
    return tuple(
        Choice(
            rule=rule,
            member=shown.index(int(members[index])),
            shares=_shares([pick(rule, one, choice, goals) for one in again], members, shown),
            reason=reason(rule, standing, index, choice, goals),
        )
        for rule, index in _picked(candidates, choice, goals).items()
    )


def _shares(picked: list[int], members: np.ndarray, shown: list[int]) -> np.ndarray:
    """[N] of each member shown. picked: of each resample, an index into `members`, the whole front."""
    counts = np.bincount(picked, minlength=len(members))
    return counts[np.searchsorted(members, shown)] / len(picked)


def _compared(held_out: Evaluations | None, held_out_of: dict[int, int], members: list[Member], recommended: int,
              goals: Goals, seed: int) -> Comparison | None:
    row, default = held_out_of.get(members[recommended].row), held_out_of.get(0)
    if held_out is None or row is None or default is None:
        return None
    return compare(held_out, row, default, [held_out_of.get(member.row) for member in members], goals, seed)


def _intervals(evaluations: Evaluations, statistic: Statistic, drawn: np.ndarray) -> list[Interval]:
    """Of each row."""
    values = estimate(statistic, evaluations.columns, evaluations.done).tolist()
    if statistic.measure in RATES and statistic.worst_share == 1.0:
        counts = evaluations.done.sum(axis=1).tolist()
        return [Interval(value, *wilson(round(value * count), count)) if count else Interval(value, value, value)
                for value, count in zip(values, counts, strict=True)]  # fmt: skip
    repeats = resampled(statistic, evaluations.columns, evaluations.done, drawn).T
    return [percentile_interval(value, one) for value, one in zip(values, repeats, strict=True)]
