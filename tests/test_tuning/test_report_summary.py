from dataclasses import replace

import numpy as np
import pytest

from tests.test_tuning.findings_by_hand import evaluations, findings, job
from tuning.analysis import chosen_by_hand
from tuning.conclude_job import success_lines
from tuning.findings import BY_HAND, Choice, Comparison, Interval
from tuning.objectives import Goals, Statistic
from tuning.report_summary import (
    SUCCESS,
    choices_table,
    constants_table,
    honest_reading,
    objectives_table,
    outcomes_table,
    reading,
    shown,
    shown_difference,
    success_table,
    verdict,
    what_was_tuned,
)

SAME, LESS, MORE = Interval(0.0, -1.0, 1.0), Interval(-2.0, -3.0, -1.0), Interval(2.0, 1.0, 3.0)
TIME = Statistic("time", "min")


def compared(*differences):
    return replace(findings(), compared=Comparison(differences[0], differences, False, ""))


@pytest.mark.parametrize(("difference", "read"), [
    (LESS, "better"), (MORE, "worse"), (SAME, "not told apart"), (Interval(-1.0, -2.0, 0.0), "not told apart"),
    (Interval(np.nan, np.nan, np.nan), "not told apart"),
])  # fmt: skip
def test_a_difference_counts_where_its_interval_leaves_out_zero(difference, read):
    assert reading(TIME, difference) == read
    other_way = {"better": "worse", "worse": "better"}.get(read, read)
    assert reading(Statistic("clearance", "max"), difference) == other_way


def test_the_verdict_says_yes_in_part_no_or_not_shown():
    assert verdict(compared(SAME, LESS, SAME, SAME)).startswith(
        "Yes: on 40 scenarios that the search never saw, the recommended constants are better in length ratio;"
    )
    assert verdict(compared(LESS, LESS, SAME, SAME)).startswith("In part:")
    assert "worse in success rate" in verdict(compared(LESS, LESS, SAME, SAME))
    assert verdict(compared(SAME, MORE, SAME, SAME)).startswith("No:")
    assert verdict(compared(SAME, SAME, SAME, SAME)).startswith("Not shown:")
    assert verdict(findings(held_out=False)).startswith("Not known:")


def test_the_verdict_tells_a_loss_of_success_that_may_be_chance():
    found = compared(Interval(-0.025, -0.135, 0.073), LESS, SAME, SAME)
    before, after = (100 * member.held_out.success.value for member in (found.default, found.front[0]))
    assert verdict(found).endswith(
        f" Success is {after:.1f} % in the place of {before:.1f} %: that may be chance, but these scenarios do not "
        "rule out a loss of 13.5 points.")
    assert "Success is" not in verdict(compared(Interval(0.0, -0.1, 0.1), LESS, SAME, SAME))


def test_the_verdict_on_a_choice_by_hand_does_not_call_it_recommended():
    found = compared(SAME, LESS, SAME, SAME)
    by_hand = replace(found, choices=(Choice(BY_HAND, 1, np.full(3, np.nan), "yours"),), recommended=0)
    assert "the chosen constants are better in length ratio; in nothing" in verdict(by_hand)
    assert "recommended" not in verdict(by_hand)
    assert "Who chose them by these values has seen them" in verdict(by_hand)
    assert "has seen them" not in verdict(found)


def test_success_is_that_of_plans_where_nothing_was_driven():
    found = findings()
    planned = replace(found, goals=Goals((Statistic("expansions", "min"),)))
    assert success_lines(found)[0].startswith("default: success training")
    assert success_lines(planned)[0].startswith("default: path found, nothing driven training")
    assert "Paths found; nothing was driven" in success_table(planned)


def test_what_violates_a_constraint_is_recommended_with_a_word_about_it():
    found = findings()
    violating = tuple(replace(member, training=replace(member.training, feasible=False)) for member in found.front)
    assert "no candidate holds all constraints" in success_lines(replace(found, front=violating))[-1]
    assert not any("no candidate" in line for line in success_lines(found))


def test_a_race_that_dropped_none_is_not_said_to_have():
    fields = {"method": {"name": "sobol", "racing": True}}
    assert "dropped early" not in what_was_tuned(fields, findings(), evaluations(last_half_done=False))
    cut = evaluations()
    cut.done[2, -1] = False  # beside the last, which was dropped half way
    assert "of which 2 were clearly worse and dropped early" in what_was_tuned(fields, findings(), cut)


def test_the_verdict_looks_at_success_even_where_it_is_no_objective():
    found = findings()
    goals = replace(found.goals, objectives=found.goals.objectives[1:])
    found = replace(found, goals=goals, compared=Comparison(LESS, (SAME, SAME, SAME), False, ""))
    assert verdict(found).startswith("No:")
    assert "worse in success rate" in verdict(found)


def test_tables_call_a_member_chosen_by_hand_chosen():
    found = chosen_by_hand(findings(), 1, None, np.array([]), 0)
    for table in (success_table(found), constants_table(found), objectives_table(found)):
        assert "chosen" in table
        assert "recommended" not in table
    assert "0.4" in constants_table(found)  # clearance of row 5
    assert "by hand (chosen)" in choices_table(found)
    assert "nan" not in choices_table(found) + honest_reading(found)


def test_where_the_default_is_recommended_it_is_said():
    found = findings()
    front = (replace(found.front[0], values=found.default.values), *found.front[1:])
    assert verdict(replace(found, front=front)).startswith("The default constants are recommended")


def test_the_honest_reading_tells_gap_stability_and_why_none_beats_the_default():
    found = findings()
    training, held_out = (replace(found.front[0].training, success=Interval(0.95, 0.9, 1.0)),
                          replace(found.front[0].held_out, success=Interval(0.925, 0.9, 1.0)))  # fmt: skip
    found = replace(found, front=(replace(found.front[0], training=training, held_out=held_out), *found.front[1:]))
    text = honest_reading(found)
    assert "2.5 points higher than on the 40 held-out ones" in text
    assert "picked the same in 70% of cases" in text
    assert "No member of the front beats the default constants" in text
    assert found.compared.why_not in text
    assert "Some member of the front beats" in honest_reading(replace(found, compared=Comparison(SAME, (), True, "")))
    assert "held-out" not in honest_reading(findings(held_out=False))


def test_what_was_tuned_names_planner_constants_method_episodes_and_suites():
    text = what_was_tuned(job().model_dump(), findings(), evaluations())
    assert text.startswith("3 constants of the extended planner on the robot disc were tuned: clearance, "
                           "local_heading, progress. The method nsga3 tried 7 sets of constants in 300 episodes")
    assert "Training: paper-20 (40 scenarios, seed 1); held out: paper-20 (40 scenarios, seed 2)." in text


def test_values_carry_their_unit_and_interval():
    space = "\N{NO-BREAK SPACE}"
    assert shown(SUCCESS, Interval(0.95, 0.9, 0.975)) == f"95.0 % [90.0,{space}97.5]"
    assert shown(TIME, Interval(30.25, 29.0, 31.5)) == f"30.2 s [29.0,{space}31.5]"
    assert shown(TIME, Interval(np.nan, np.nan, np.nan)) == "–"
    assert shown_difference(SUCCESS, Interval(-0.01, -0.05, 0.0)) == f"-1.0 [-5.0,{space}+0.0]"
    assert shown_difference(TIME, Interval(0.5, 0.25, 0.75)) == f"+0.500 s [+0.250,{space}+0.750]"


def test_tables_hold_both_suites_and_both_sets_of_constants():
    found = findings()
    assert shown(SUCCESS, found.default.held_out.success) in success_table(found)
    assert "<td>0.3125</td>" in constants_table(found)
    assert ">better</td>" in objectives_table(found)  # danger points
    assert "held out</th>" not in success_table(findings(held_out=False))


def test_outcomes_are_counted_for_the_default_and_the_recommended():
    unseen, rows = evaluations(seed=1).rows(np.array([0, 4])), np.array([0, 4])
    reached = [int((unseen.columns["outcome"][row] == 0).sum()) for row in (0, 1)]
    text = outcomes_table(findings(), unseen, rows)
    assert f"reached the goal</th><td>{reached[0]}</td><td>{reached[1]}</td>" in text
    assert f"hit a mover</th><td>{40 - reached[0]}</td><td>{40 - reached[1]}</td>" in text
    assert outcomes_table(findings(), unseen.rows(np.array([0])), rows[:1]) == ""
