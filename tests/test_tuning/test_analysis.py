from dataclasses import asdict

import numpy as np
import pytest

from tests.test_tuning.handmade import SPACE, TWO_GOALS, evaluations, solved
from tuning.analysis import analyse, chosen_by_hand, chosen_rows, front_rows, judgements, optimism
from tuning.bootstrap import RESAMPLES
from tuning.choice import RULES, ChoiceSettings
from tuning.intervals import wilson
from tuning.objectives import Constraint, Goals, Statistic

NOTHING_FITS = Goals(TWO_GOALS.objectives, (Constraint(Statistic("length_ratio", "min"), 0.5),))


def training():
    """The default; a dominated one; one of more success, one shorter; and one that was dropped after half."""
    done = np.ones((5, 40), np.bool_)
    done[4, 20:] = False
    return evaluations(solved([30, 20, 38, 32, 40], 40), [1.5, 1.6, 1.45, 1.1, 1.0], done=done)


def found(held_out=None, rows=(), goals=TWO_GOALS, choice=None, seed=0):
    return analyse(training(), held_out, np.array(rows, np.int64), goals, SPACE, choice or ChoiceSettings(), seed)


def on_held_out():
    """Rows 3, 0 and 2 of the training, in this order."""
    return evaluations(solved([30, 29, 36], 40), [1.2, 1.5, 1.55])


def test_the_front_is_of_candidates_that_saw_every_scenario():
    assert front_rows(training(), TWO_GOALS, 32).tolist() == [2, 3]
    assert [member.row for member in found().front] == [2, 3]  # the most success first


def test_the_front_keeps_to_its_limit():
    counts = np.arange(20, 40)
    judged = evaluations(solved(counts, 40), 1.0 + counts / 10.0)
    rows = front_rows(judged, TWO_GOALS, 7)
    assert len(rows) == 7
    assert {0, 19} <= set(rows.tolist())


def test_where_nothing_is_feasible_the_front_is_what_violates_least_and_it_is_said():
    assert front_rows(training(), NOTHING_FITS, 32).tolist() == [3]
    findings = found(goals=NOTHING_FITS)
    assert not findings.front[0].training.feasible
    assert all(choice.reason.startswith("No candidate holds all constraints") for choice in findings.choices)


def test_every_rule_is_reported_and_the_settings_name_the_recommended():
    findings = found(choice=ChoiceSettings(rule="constraint", at_least=0.7))
    assert tuple(choice.rule for choice in findings.choices) == RULES
    assert findings.choices[findings.recommended].rule == "constraint"
    assert findings.front[findings.choices[findings.recommended].member].row == 3


def test_chosen_rows_are_those_of_the_findings():
    choice = ChoiceSettings(at_least=0.7)
    findings = found(choice=choice)
    assert chosen_rows(training(), TWO_GOALS, choice).tolist() == [findings.front[one.member].row
                                                                   for one in findings.choices]  # fmt: skip


def test_a_chosen_member_is_shown_even_where_the_front_is_thinned():
    """200 members on a line; the constraint picks one that an even spread of 32 leaves out."""
    counts = np.arange(200, 400)
    judged = evaluations(solved(counts, 400), 1.0 + counts / 100.0)
    assert 101 not in front_rows(judged, TWO_GOALS, 32)
    choice = ChoiceSettings(rule="constraint", at_least=301 / 400)
    findings = analyse(judged, None, np.array([], np.int64), TWO_GOALS, SPACE, choice, 0)
    assert findings.front[findings.choices[findings.recommended].member].row == 101
    assert len(findings.front) <= 36


def test_judgements_by_hand():
    judged = evaluations(solved([8, 0], 10), np.tile(np.arange(10) / 10.0, (2, 1)))
    first, second = judgements(judged, [0, 1], TWO_GOALS, seed=0)
    assert first.scenarios == 10
    assert first.success == first.objectives[0] == (0.8, *wilson(8, 10))
    value, low, high = first.objectives[1]
    assert value == pytest.approx(0.35)  # 0.0 to 0.7; standard error 0.081
    assert 0.35 - 2.5 * 0.081 < low < 0.35 - 1.5 * 0.081 < 0.35 + 1.5 * 0.081 < high < 0.35 + 2.5 * 0.081
    assert first.feasible
    assert second.success == (0.0, *wilson(0, 10))
    assert np.isnan(second.objectives[1]).all()
    assert not second.feasible


def test_chances_of_being_non_dominated():
    """Row 3 is shorter than all others in any resample; row 1 is beaten by row 0 in every one."""
    findings = found()
    assert findings.front[1].non_dominated == 1.0
    assert findings.front[0].non_dominated == pytest.approx(1.0, abs=0.01)
    assert findings.default.non_dominated == 0.0


def test_stability_is_the_share_of_resamples_with_the_same_pick():
    """Success is equal but for one scenario of 40: it is drawn in 1 − (1 − 1/40)⁴⁰ = 63.7 % of the resamples."""
    judged = evaluations(solved([39, 40], 40), [1.1, 1.2])
    choice = ChoiceSettings(at_least=1.0, weights={"length_ratio": 1.0})
    findings = analyse(judged, None, np.array([], np.int64), TWO_GOALS, SPACE, choice, 0)
    by_rule = dict(zip(RULES, findings.choices, strict=True))
    error = np.sqrt(0.637 * 0.363 / RESAMPLES)
    assert by_rule["constraint"].stability == pytest.approx(1.0 - (39 / 40) ** 40, abs=4 * error)
    assert by_rule["weights"].stability == 1.0  # the shorter one is shorter in all of them


def test_each_member_has_its_share_of_the_picks():
    """The whole of them where all members are shown; the constraint picks one or the other of two."""
    judged = evaluations(solved([39, 40], 40), [1.1, 1.2])
    findings = analyse(judged, None, np.array([], np.int64), TWO_GOALS, SPACE, ChoiceSettings(at_least=1.0), 0)
    for choice in findings.choices:
        assert choice.shares.shape == (2,)
        assert choice.shares.sum() == pytest.approx(1.0)
        assert choice.stability == choice.shares[choice.member]
    constraint = findings.choices[RULES.index("constraint")]
    most = next(index for index, member in enumerate(findings.front) if member.row == 1)
    assert constraint.member == most
    assert constraint.shares[1 - most] == pytest.approx((39 / 40) ** 40, abs=0.07)


def test_a_member_chosen_by_hand_is_compared_in_the_place_of_the_recommended():
    rows = (3, 0, 2)
    before = found(on_held_out(), rows=rows)
    for member, gained in ((0, 7 / 40), (1, 1 / 40)):  # training rows 2 and 3, held out 36 and 30 against 29 of 40
        after = chosen_by_hand(before, member, on_held_out(), np.array(rows), 0)
        assert after.picked == "chosen"
        assert after.choices[after.recommended].member == member
        assert np.isnan(after.choices[after.recommended].stability)
        assert after.compared.success.value == pytest.approx(gained)
        assert after.choices[:-1] == before.choices
    assert before.picked == "recommended"
    assert chosen_by_hand(before, 0, None, np.array([]), 0).compared is None


def test_held_out_figures_belong_to_their_training_rows():
    findings = found(on_held_out(), rows=(3, 0, 2))
    assert findings.default.held_out.success.value == 29 / 40
    assert [member.held_out.success.value for member in findings.front] == [36 / 40, 30 / 40]
    assert findings.compared.success.value == pytest.approx(
        {2: 7, 3: 1}[findings.front[findings.choices[findings.recommended].member].row] / 40)  # fmt: skip
    assert findings.compared.better_member == 1


def test_rows_that_were_not_driven_held_out_have_no_figures_there():
    findings = found(on_held_out().rows(np.array([0])), rows=(3,))
    assert findings.default.held_out is None
    assert findings.front[0].held_out is None
    assert findings.front[1].held_out.success.value == 30 / 40
    assert findings.compared is None


def test_optimism_is_by_how_much_training_flatters():
    member = found(on_held_out(), rows=(3, 0, 2)).front[0]
    assert optimism(member, TWO_GOALS) == pytest.approx((38 / 40 - 36 / 40, 1.55 - 1.45))
    assert optimism(found().front[0], TWO_GOALS) is None


def test_findings_repeat_with_the_seed():
    first, second = (found(on_held_out(), rows=(3, 0, 2)) for _ in range(2))
    np.testing.assert_equal(asdict(first), asdict(second))


def test_findings_carry_the_curve_and_the_importance():
    findings = found()
    assert findings.hypervolume.episodes.tolist() == [40, 80, 120, 160, 180]
    assert findings.importance.shape == (2, 2)
    assert findings.parameters == SPACE.names
