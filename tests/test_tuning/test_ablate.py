"""Ablations. Planners stand for those of the rules by weights alone, so that all share one compiled program."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from adwa_jax.episode import Outcome
from adwa_jax.presets import extended, paper, preset
from adwa_jax.rules import EVERY_RULE, RULE_NAMES, Rules
from adwa_jax.score import ScoreWeights
from scenarios.drawing import new_figure
from tests.test_tuning.worlds import mixed_suite, part_of
from tuning import ablate as module
from tuning.ablate import Configuration, Row, ablate, configurations
from tuning.ablation_report import (
    HEADINGS,
    ablation_figure,
    ablation_table,
    draw_ablation,
    row_sentence,
    write_ablation,
)
from tuning.evaluate import evaluate
from tuning.intervals import paired_difference
from tuning.results import Results

SUITE = part_of(mixed_suite(), [1, 2, 3, 4, 5])  # those of one padded shape
RULES = ("carrot", "replan")
STANDSTILL = ScoreWeights(local_heading=0.0, clearance=1.0, velocity=0.0, global_heading=0.0)


def stand_in(rules):
    """A planner that likes to stand where `carrot` is on, and the paper's otherwise."""
    config = paper()
    weights = STANDSTILL if rules.carrot else config.constants.weights
    return config._replace(constants=replace(config.constants, weights=weights))


@pytest.fixture(scope="module")
def rows():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "preset", stand_in)
        return list(ablate(SUITE, RULES))


def results_of(reached, **measures):
    outcome = np.where(reached, Outcome.REACHED, Outcome.STUCK).astype(np.int32)
    zeros = np.zeros(len(reached), np.float32)
    measures = {"time": zeros, "length_ratio": zeros, "hit_while_stopped": zeros, **measures}
    return Results("drawn", tuple(map(str, range(len(reached)))), outcome, measures)


def row_of(here, base=None, rule=None, seconds=2.0, steps=1000, name="some"):
    return Row(Configuration(name, Rules(), None if base is None else "paper", rule), here, base, seconds, steps)


def test_cost_is_not_measured_where_nobody_asks_for_it(monkeypatch):
    monkeypatch.setattr(module, "preset", stand_in)
    (row, _) = ablate(part_of(SUITE, [0]), (), repeats=0)
    assert (row.results.count, row.microseconds_a_step()) == (1, None)


def test_each_rule_is_taken_from_the_extended_planner_and_added_to_the_papers():
    both = configurations(RULES)
    assert [(each.name, each.base) for each in both] == [
        ("paper", None), ("extended", "paper"),
        ("extended without carrot", "extended"), ("paper with carrot", "paper"),
        ("extended without replan", "extended"), ("paper with replan", "paper"),
    ]  # fmt: skip
    assert [each.rules for each in both[:2]] == [Rules(), EVERY_RULE]
    assert [each.rules for each in both[2:4]] == [EVERY_RULE.without("carrot"), Rules().only("carrot")]
    assert len(configurations()) == 2 + 2 * len(RULE_NAMES)
    assert (preset(Rules()), preset(EVERY_RULE)) == (paper(), extended())


def test_rows_are_evaluations_beside_their_bases(rows):
    by_name = {row.configuration.name: row for row in rows}
    assert list(by_name) == [each.name for each in configurations(RULES)]
    plain, still = (evaluate(SUITE, stand_in(rules)) for rules in (Rules(), Rules().only("carrot")))
    assert (plain.outcome != still.outcome).any()
    for name, here, base in (
        ("paper", plain, None), ("paper with carrot", still, plain), ("extended", still, plain),
        ("extended without carrot", plain, still), ("paper with replan", plain, plain),
    ):  # fmt: skip
        row = by_name[name]
        np.testing.assert_array_equal(row.results.measures["length"], here.measures["length"])
        assert (row.base is None) == (base is None)
        if base is not None:
            np.testing.assert_array_equal(row.base.measures["length"], base.measures["length"])
        assert row.control_steps == round(float(here.measures["time"].sum()) / 0.1)
        assert row.seconds > 0


def test_a_rule_without_effect_makes_no_difference_at_all(rows):
    (row,) = (row for row in rows if row.configuration.name == "paper with replan")
    assert row.difference()[0] == 0.0
    assert row.record()["other_outcome"] == 0
    assert row.mean_difference("time") == (0.0, 0.0, 0.0)


def test_differences_are_paired():
    here, base = (np.array(values, bool) for values in ([1, 1, 1, 0, 0], [1, 1, 0, 1, 0]))
    row = row_of(results_of(here, time=np.float32([4, 9, 1, 1, 1])), results_of(base, time=np.float32([1, 2, 7, 7, 7])))
    assert row.difference() == paired_difference(2, 1, 1, 1)
    mean, low, high = row.mean_difference("time")  # 3 and 7 s, t of one degree of freedom
    assert (mean, low, high) == (5.0, pytest.approx(5 - 12.706 * 2, rel=1e-3), pytest.approx(5 + 12.706 * 2, rel=1e-3))
    record = row.record()
    assert (record["success_rate"], record["difference"], record["both_reached"]) == (0.6, 0.0, 2)
    assert (record["other_outcome"], record["microseconds_a_step"]) == (2, 2000.0)
    assert record["outcome"] == [0, 0, 0, 4, 4]


def test_rows_without_base_common_success_or_a_step_say_nothing():
    alone = row_of(results_of(np.array([True, False])))
    apart = row_of(results_of(np.array([True, False])), results_of(np.array([False, True])), steps=0)
    assert alone.difference() is alone.mean_difference("time") is apart.mean_difference("time") is None
    assert apart.record()["microseconds_a_step"] is None
    json.dumps([alone.record(), apart.record()], allow_nan=False)


def test_progress_runs_over_all_configurations(monkeypatch):
    monkeypatch.setattr(module, "preset", stand_in)
    calls = []
    list(ablate(part_of(SUITE, [3]), RULES, progress=lambda *counts: calls.append(counts)))
    assert calls == sorted(calls)  # it is told from time to time, of a slow one also before it ends
    assert set(calls) - {(0, 6)} == {(count, 6) for count in range(1, 7)}


def test_planners_are_put_on_the_robot_that_is_meant(monkeypatch):
    monkeypatch.setattr(module, "preset", stand_in)
    seen = []
    list(ablate(part_of(SUITE, [3]), RULES[:1], driving=lambda config: seen.append(config) or config))
    assert seen == [stand_in(each.rules) for each in configurations(RULES[:1])]


def test_files_hold_the_rows_so_far(rows, tmp_path):
    for count in (1, len(rows)):
        paths = write_ablation(tmp_path / "new", SUITE, rows[:count])
        assert sorted(path.name for path in (tmp_path / "new").iterdir()) == sorted(path.name for path in paths)
        found = json.loads((tmp_path / "new" / "ablation.json").read_text())
        assert [row["configuration"] for row in found["rows"]] == [row.configuration.name for row in rows[:count]]
        with (tmp_path / "new" / "ablation.csv").open(newline="", encoding="utf-8") as file:
            table = list(csv.DictReader(file))
        assert [row["configuration"] for row in table] == [row.configuration.name for row in rows[:count]]
    assert found["scenarios"] == list(SUITE.names)
    assert found["rows"][1] == json.loads(json.dumps(rows[1].record()))
    assert float(table[1]["difference_ci_low"]) == rows[1].difference()[1]
    lines = (tmp_path / "new" / "ablation.md").read_text().splitlines()
    assert sum(line.startswith("| paper") or line.startswith("| extended") for line in lines) == len(rows)


def test_the_table_has_a_row_for_each_configuration(rows):
    table = ablation_table(SUITE, rows)
    assert [column.header for column in table.columns] == list(HEADINGS)
    assert list(table.columns[0].cells) == [row.configuration.name for row in rows]
    assert next(iter(table.columns[3].cells)) == "–"
    assert row_sentence(rows[-1]).startswith("paper with replan: 20.0 % [")
    assert "+0.0 [" in row_sentence(rows[-1])


def test_the_picture_shows_each_rules_difference_both_ways(rows, tmp_path):
    figure = ablation_figure(SUITE, rows)
    added, taken = figure.axes
    assert [label.get_text() for label in added.get_yticklabels()] == list(RULES)
    for ax, name in ((added, "paper with carrot"), (taken, "extended without carrot")):
        (row,) = (row for row in rows if row.configuration.name == name)
        mean, low, high = (100 * value for value in row.difference())
        marks = [line for line in ax.lines if line.get_marker() in ("s", "o")]
        assert float(marks[0].get_xdata()[0]) == pytest.approx(mean)
        assert ax.collections[0].get_segments()[0][:, 0] == pytest.approx([low, high])
    assert "(20.0 % success)" in added.get_title()
    panels = new_figure((8.0, 4.0)).subplots(1, 2)
    ablation_figure(SUITE, rows, panels)
    assert [[label.get_text() for label in ax.get_yticklabels()] for ax in panels] == [list(RULES)] * 2
    with Image.open(draw_ablation(tmp_path / "new", SUITE, rows)) as drawn:
        assert min(drawn.size) > 100
