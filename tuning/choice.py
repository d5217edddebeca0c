"""Rules that pick one member of a front.

All rules are reported; the settings name the one that is recommended. Only members that hold the constraints are picked
from, or those that violate them least where none does. Ties go to the better in the other objectives, then to the
earlier candidate.

Dimension letters: N members; O objectives; R resamples.
"""

from typing import Annotated, Literal, NamedTuple, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from tuning.front import unit_range
from tuning.objectives import Goals

Rule = Literal["knee", "constraint", "one_standard_error", "weights"]
RULES: tuple[Rule, ...] = get_args(Rule)
Weight = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class ChoiceSettings(BaseModel):
    """Which member is recommended, and the numbers that the rules need.

    The default is the one-standard-error rule: success comes first, and what no suite of this size can tell apart in
    success is decided by the length of the way.
    """

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    rule: Rule = "one_standard_error"
    at_least: float = Field(0.95, ge=0.0, le=1.0)  # success that `constraint` asks for
    best: str | None = None  # label of the objective that decides next; None: length_ratio, else the first but success
    weights: dict[str, Weight] | None = None  # by label; those left out are 0; None: all alike

    @model_validator(mode="after")
    def _weights_fit_the_rule(self) -> "ChoiceSettings":
        if self.rule == "weights" and self.weights is None:
            raise ValueError('weights: missing; rule = "weights" needs them; write weights = {success = 1.0, ...}')
        if self.weights is not None and not any(self.weights.values()):
            raise ValueError("weights: all 0; at least one must be above 0; raise one")
        return self


class Standing(NamedTuple):
    """What the rules look at."""

    objectives: np.ndarray  # [N, O], minimised
    violation: np.ndarray  # [N] ≥ 0
    success: np.ndarray  # [N] rate
    scenarios: int  # on which it was counted

    def only(self, members: np.ndarray) -> "Standing":
        """Some members, by index or mask."""
        return Standing(self.objectives[members], self.violation[members], self.success[members], self.scenarios)


def mistakes(settings: ChoiceSettings, goals: Goals) -> list[str]:
    """Labels that name no objective, each as one line: place, value, rule, remedy."""
    labels = [statistic.label for statistic in goals.objectives]
    named = [(f"choice.weights.{label}", label) for label in settings.weights or ()]
    named += [("choice.best", settings.best)] if settings.best is not None else []
    return [f"{place}: {label!r} is no objective; must be one of {', '.join(labels)}; choose one of them"
            for place, label in named if label not in labels]  # fmt: skip


def pick(rule: Rule, standing: Standing, settings: ChoiceSettings, goals: Goals) -> int:
    """Index of the member that a rule picks; N ≥ 1."""
    lawful = np.flatnonzero(standing.violation == standing.violation.min())
    among = standing.only(lawful)
    if rule == "knee":
        index = knee(among.objectives)
    elif rule == "weights":
        index = weighted(among.objectives, weight_vector(settings, goals))
    elif rule == "constraint":
        index = constraint(among, settings.at_least, deciding(settings, goals))
    else:
        index = one_standard_error(among, deciding(settings, goals))
    return int(lawful[index])


def knee(objectives: np.ndarray) -> int:
    """The member nearest to the best of all, each objective in units of the front's range (Zeleny 1973)."""
    return _first(np.linalg.norm(unit_range(objectives), axis=1), objectives)


def weighted(objectives: np.ndarray, weights: np.ndarray) -> int:
    """The least weighted sum of the objectives, each in units of the front's range. weights: [O]."""
    return _first(unit_range(objectives) @ weights, objectives)


def constraint(standing: Standing, at_least: float, objective: int) -> int:
    """Best in one objective among those with enough success; without any, the most success."""
    enough = standing.success >= at_least
    return _best_among(enough if enough.any() else _most(standing.success), standing, objective)


def one_standard_error(standing: Standing, objective: int) -> int:
    """Best in one objective among those within a standard error of the most success (Breiman et al. 1984, §3.4.3)."""
    return _best_among(within_one_error(standing), standing, objective)


def within_one_error(standing: Standing) -> np.ndarray:
    """[N] bool: success no more than one standard error below the most."""
    most = float(standing.success.max())
    return standing.success >= most - standard_error(most, standing.scenarios)


def standard_error(rate: float, count: int) -> float:
    """Of a rate over `count` scenarios; drawn towards 1/2 by a success and a failure more, so that it is never 0."""
    drawn_in = (rate * count + 1.0) / (count + 2.0)
    return float(np.sqrt(drawn_in * (1.0 - drawn_in) / count))


def weight_vector(settings: ChoiceSettings, goals: Goals) -> np.ndarray:
    """[O] weights of the objectives."""
    given = settings.weights
    return np.array([1.0 if given is None else given.get(statistic.label, 0.0) for statistic in goals.objectives])


def deciding(settings: ChoiceSettings, goals: Goals) -> int:
    """Index of the objective that decides once success is dealt with."""
    labels = [statistic.label for statistic in goals.objectives]
    others = [label for label in labels if label != "success"]
    wanted = (settings.best, "length_ratio", *others, "success")
    return next(labels.index(label) for label in wanted if label in labels)


def reason(rule: Rule, standing: Standing, member: int, settings: ChoiceSettings, goals: Goals) -> str:
    """Why the rule picks the member, in one sentence."""
    lawful = standing.violation == standing.violation.min()
    among = standing.only(lawful)
    words = _words(rule, among, settings, goals, standing.objectives[member])
    if standing.violation[member] > 0:
        return f"No candidate holds all constraints; of the {lawful.sum()} that violate them least: {words}"
    return words[0].upper() + words[1:]


def _words(rule: Rule, among: Standing, settings: ChoiceSettings, goals: Goals, objectives: np.ndarray) -> str:
    if rule == "knee":
        return "nearest to the best of every objective at once, each in units of the front's range."
    if rule == "weights":
        weights = weight_vector(settings, goals)
        parts = [f"{weight:g} {statistic.label}" for weight, statistic in zip(weights, goals.objectives, strict=True)]
        return f"the best weighted sum of {', '.join(parts)}, each in units of the front's range."
    index = deciding(settings, goals)
    statistic = goals.objectives[index]
    best = f"the best {statistic.label}, {statistic.sign * objectives[index]:.4g}"
    if rule == "constraint":
        enough = int((among.success >= settings.at_least).sum())
        if not enough:
            return f"none has success {settings.at_least:.1%}, so the most success, {among.success.max():.1%}."
        return f"{best}, of the {enough} with success {settings.at_least:.1%} or more."
    most = float(among.success.max())
    return (f"{best}, of the {int(within_one_error(among).sum())} whose success is within one standard error "
            f"({100.0 * standard_error(most, among.scenarios):.1f} points) of the most, {most:.1%}.")  # fmt: skip


def _most(success: np.ndarray) -> np.ndarray:
    return success == success.max()


def _best_among(mask: np.ndarray, standing: Standing, objective: int) -> int:
    members = np.flatnonzero(mask)
    objectives = standing.objectives[members]
    return int(members[_first(objectives[:, objective], objectives)])


def _first(key: np.ndarray, objectives: np.ndarray) -> int:
    """Index of the least key [N]; of equals the one better in the first objective, then the second and so on."""
    return int(np.lexsort((*objectives.T[::-1], key))[0])
