import numpy as np
import pytest
from pydantic import ValidationError

from tuning.choice import (
    RULES,
    ChoiceSettings,
    Standing,
    constraint,
    deciding,
    knee,
    mistakes,
    one_standard_error,
    pick,
    reason,
    standard_error,
    weighted,
)
from tuning.objectives import Goals, Statistic

GOALS = Goals((Statistic("success", "max"), Statistic("length_ratio", "min")))
# success, length: a front on which more success costs more length, with a knee at the third.
FRONT = np.array([(0.99, 1.50), (0.98, 1.40), (0.96, 1.10), (0.80, 1.05), (0.60, 1.04)])


def standing(front=FRONT, violation=None, scenarios=100):
    return Standing(
        objectives=front * [-1.0, 1.0],
        violation=np.zeros(len(front)) if violation is None else np.asarray(violation, np.float64),
        success=front[:, 0],
        scenarios=scenarios,
    )


def picked(rule, settings=None, **changes):
    return pick(rule, standing(**changes), settings or ChoiceSettings(), GOALS)


def test_knee_is_nearest_to_the_best_of_both():
    """In units of the ranges 0.39 and 0.46: (0, 1), (0.03, 0.78), (0.08, 0.13), (0.49, 0.02), (1, 0)."""
    assert knee(standing().objectives) == 2


def test_knee_does_not_depend_on_units():
    assert knee(standing().objectives * [1.0, 1000.0] + [0.0, 5.0]) == 2


def test_constraint_takes_the_best_length_with_enough_success():
    assert constraint(standing(), 0.95, 1) == 2
    assert constraint(standing(), 0.96, 1) == 2  # as much as asked for is enough
    assert constraint(standing(), 0.97, 1) == 1
    assert constraint(standing(), 0.0, 1) == 4


def test_constraint_that_none_holds_takes_the_most_success():
    assert constraint(standing(), 0.999, 1) == 0


def test_one_standard_error_by_hand():
    """Of 0.99 in 100: p = 100 / 102, error √(p(1 − p) / 100) = 0.01386: 0.98 is within it, 0.96 is not."""
    assert standard_error(0.99, 100) == pytest.approx(0.013865, abs=1e-6)
    assert one_standard_error(standing(), 1) == 1
    assert one_standard_error(standing(scenarios=50), 1) == 1  # p = 50.5 / 52, error 0.0237: 0.96 lies just beyond
    assert one_standard_error(standing(scenarios=10), 1) == 2  # p = 10.9 / 12, error 0.0914
    assert one_standard_error(standing(scenarios=10_000), 1) == 0


def test_full_success_still_has_an_error():
    assert standard_error(1.0, 100) == pytest.approx(np.sqrt(101 / 102 / 102 / 100))


def test_weights_by_hand():
    """Sums of the scaled objectives: (0.2, 0.8) prefers short ways, (0.8, 0.2) success."""
    assert weighted(standing().objectives, np.array([0.0, 1.0])) == 4
    assert weighted(standing().objectives, np.array([1.0, 0.0])) == 0
    assert weighted(standing().objectives, np.array([1.0, 1.0])) == 2


def test_weights_are_by_label_and_those_left_out_are_none():
    assert picked("weights", ChoiceSettings(weights={"length_ratio": 2.0})) == 4
    assert picked("weights", ChoiceSettings(weights={"success": 2.0})) == 0


@pytest.mark.parametrize("rule", RULES)
def test_rules_pick_among_those_that_hold_the_constraints(rule):
    assert picked(rule, violation=[1, 1, 1, 0, 1]) == 3


@pytest.mark.parametrize("rule", RULES)
def test_rules_pick_among_those_that_violate_least_where_all_do(rule):
    assert picked(rule, violation=[2, 2, 2, 1, 2]) == 3


@pytest.mark.parametrize("rule", RULES)
def test_equal_members_go_to_the_earlier(rule):
    assert picked(rule, front=np.array([(0.9, 1.2), (0.9, 1.2)])) == 0


def test_ties_go_to_the_better_in_the_other_objectives():
    assert constraint(standing(np.array([(0.96, 1.1), (0.99, 1.1)])), 0.95, 1) == 1


@pytest.mark.parametrize("rule", RULES)
def test_order_changes_no_pick(rule):
    order = np.array([3, 0, 4, 2, 1])
    assert order[picked(rule, front=FRONT[order])] == picked(rule)


def test_what_decides_next_to_success():
    worst = Statistic("length_ratio", "min", 0.1)
    goals = Goals((Statistic("success", "max"), worst, Statistic("danger_points", "min")))
    assert deciding(ChoiceSettings(), goals) == 1
    assert deciding(ChoiceSettings(best="danger_points"), goals) == 2
    assert deciding(ChoiceSettings(), Goals((*goals.objectives, Statistic("length_ratio", "min")))) == 3
    assert deciding(ChoiceSettings(), Goals(goals.objectives[:1])) == 0


@pytest.mark.parametrize(("rule", "expected"), [
    ("knee", "Nearest to the best of every objective at once, each in units of the front's range."),
    ("constraint", "The best length_ratio, 1.1, of the 3 with success 95.0% or more."),
    ("one_standard_error", "The best length_ratio, 1.4, of the 2 whose success is within one standard error (1.4 "
                           "points) of the most, 99.0%."),
    ("weights", "The best weighted sum of 1 success, 1 length_ratio, each in units of the front's range."),
])  # fmt: skip
def test_reasons_say_what_was_compared(rule, expected):
    assert reason(rule, standing(), picked(rule), ChoiceSettings(), GOALS) == expected


def test_a_reason_says_that_nothing_was_enough():
    assert reason("constraint", standing(), 0, ChoiceSettings(at_least=1.0), GOALS) == (
        "None has success 100.0%, so the most success, 99.0%.")  # fmt: skip


def test_a_reason_says_that_no_candidate_is_feasible():
    violated = standing(violation=[2, 2, 1, 1, 2])
    assert reason("constraint", violated, 2, ChoiceSettings(), GOALS) == (
        "No candidate holds all constraints; of the 2 that violate them least: the best length_ratio, 1.1, of the 1 "
        "with success 95.0% or more.")  # fmt: skip


@pytest.mark.parametrize(("given", "place", "words"), [
    ({"rule": "best"}, "rule", "knee"),
    ({"at_least": 1.2}, "at_least", "less than or equal to 1"),
    ({"at_least": float("nan")}, "at_least", "less than or equal to 1"),
    ({"at_least": "0.9"}, "at_least", "number"),
    ({"weights": {"success": -1.0}}, "weights", "greater than or equal to 0"),
    ({"weights": {"success": float("inf")}}, "weights", "finite"),
    ({"weights": {"success": 0}}, "", "all 0"),
    ({"weights": {}}, "", "all 0"),
    ({"rule": "weights"}, "", "missing"),
    ({"weigths": {"success": 1.0}}, "weigths", "Extra inputs"),
])  # fmt: skip
def test_settings_refuse_nonsense(given, place, words):
    with pytest.raises(ValidationError) as caught:
        ChoiceSettings.model_validate(given)
    (error,) = caught.value.errors()
    assert ".".join(map(str, error["loc"])).startswith(place)
    assert words in error["msg"]


def test_labels_must_be_those_of_objectives():
    settings = ChoiceSettings(weights={"success": 1.0, "lenght": 1.0}, best="time")
    assert mistakes(settings, GOALS) == [
        "choice.weights.lenght: 'lenght' is no objective; must be one of success, length_ratio; choose one of them",
        "choice.best: 'time' is no objective; must be one of success, length_ratio; choose one of them",
    ]
    assert mistakes(ChoiceSettings(best="length_ratio"), GOALS) == []
