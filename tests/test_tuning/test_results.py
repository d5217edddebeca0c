import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from adwa_jax.episode import Outcome
from scenarios.feasibility import Feasibility
from tuning.console import results_table
from tuning.dataset import results_dataset
from tuning.intervals import wilson
from tuning.results import OVER_ALL, Results


def results_of(outcomes, **measures):
    names = tuple(f"s-{index}" for index in range(len(outcomes)))
    columns = {name: np.array(values, np.float32) for name, values in measures.items()}
    return Results("some suite", names, np.array(outcomes, np.int32), columns)


def rows_of(table):
    """The first cell of each row, with the other two."""
    cells = [list(column.cells) for column in table.columns]
    return {name: (value, over) for name, value, over in zip(*cells, strict=True)}


MIXED = results_of(
    [Outcome.REACHED, Outcome.HIT_MOVER, Outcome.REACHED, Outcome.NO_PATH],
    time=[10.0, 99.0, 30.0, 0.0], spl=[1.0, 0.0, 0.5, 0.0], hit_while_stopped=[0, 1, 0, 0],
    barn_score=[0.5, 0.0, 0.25, 0.0], least_clearance=[0.2, -0.1, 0.4, 0.0],
)  # fmt: skip


def test_outcomes_name_every_outcome_and_sum_to_the_count():
    assert MIXED.outcomes() == {
        "REACHED": 2, "HIT_KNOWN": 0, "HIT_UNKNOWN": 0, "HIT_MOVER": 1, "STUCK": 0, "TIMEOUT": 0, "NO_PATH": 1,
    }  # fmt: skip


def test_means_are_over_successes_and_those_with_success_in_them_over_all():
    assert MIXED.means() == {"time": 20.0, "spl": 0.375, "hit_while_stopped": 0.25, "barn_score": 0.1875,
                             "least_clearance": pytest.approx(0.3)}  # fmt: skip
    assert {"spl", "barn_score", "replans", "hit_while_stopped"} == set(OVER_ALL)


def test_an_evaluation_opens_as_a_dataset_with_units_and_a_table():
    dataset = results_dataset(replace(MIXED, feasibility=np.array([0, 2, 0, 1], np.int32)))
    assert dict(dataset.sizes) == {"scenario": 4}
    assert dataset.attrs == {"title": "some suite"}
    assert (dataset["time"].units, dataset["spl"].units) == ("s", "1")
    assert all(variable.long_name for variable in dataset.data_vars.values())
    assert dataset["outcome"].flag_meanings.split()[Outcome.HIT_MOVER] == "HIT_MOVER"
    assert dataset["feasibility"].flag_meanings.split() == [kind.name for kind in Feasibility]
    assert dataset["success"].values.tolist() == [True, False, True, False]
    frame = dataset.to_dataframe()
    assert frame.index.tolist() == ["s-0", "s-1", "s-2", "s-3"]
    assert frame.loc["s-1", "time"] == 99.0


def test_without_a_success_a_mean_over_successes_is_null():
    lost = results_of([Outcome.STUCK, Outcome.TIMEOUT], time=[5.0, 6.0], spl=[0.0, 0.0], least_clearance=[0.5, 0.5])
    assert lost.means() == {"time": None, "spl": 0.0, "least_clearance": None}
    assert lost.summary()["success_rate"] == 0.0
    assert lost.summary()["success_ci"] == list(wilson(0, 2))


def test_summary_has_the_contracts_fields():
    summary = MIXED.summary()
    assert {"count", "outcomes", "success_rate", "success_ci", "means", "scenarios"} <= set(summary)
    assert (summary["count"], summary["success_rate"]) == (4, 0.5)
    assert summary["success_ci"] == list(wilson(2, 4))
    assert summary["scenarios"][1] == {
        "name": "s-1", "outcome": "HIT_MOVER", "time": 99.0, "spl": 0.0, "hit_while_stopped": 1.0, "barn_score": 0.0,
        "least_clearance": pytest.approx(-0.1),
    }  # fmt: skip


def test_the_closest_approach_is_over_all_that_drove():
    approach = MIXED.closest_approach()  # −0.1, 0.2, 0.4: the one without a path never drove
    assert approach == {"least": pytest.approx(-0.1), "5 %": pytest.approx(-0.07), "median": pytest.approx(0.2)}
    nowhere = results_of([Outcome.NO_PATH], least_clearance=[0.0])
    assert nowhere.closest_approach() == dict.fromkeys(approach)


def test_success_among_the_scenarios_that_are_not_proven_impossible():
    labels = np.array([Feasibility.POSSIBLE, Feasibility.UNKNOWN, Feasibility.POSSIBLE, Feasibility.IMPOSSIBLE])
    labelled = replace(MIXED, feasibility=labels)
    assert MIXED.summary()["feasible"] is None
    assert labelled.summary()["feasible"] == {
        "IMPOSSIBLE": 1, "UNKNOWN": 1, "POSSIBLE": 2,
        "not_impossible": {"count": 3, "success_rate": 2 / 3, "success_ci": list(wilson(2, 3))},
        "possible": {"count": 2, "success_rate": 1.0, "success_ci": list(wilson(2, 2))},
    }  # fmt: skip
    assert labelled.scenario(3)["feasibility"] == "IMPOSSIBLE"
    none = replace(MIXED, feasibility=np.full(4, Feasibility.IMPOSSIBLE))
    assert none.feasible()["possible"] == {"count": 0, "success_rate": None, "success_ci": [0.0, 1.0]}
    json.dumps(none.summary(), allow_nan=False)
    assert "success of the 0 possible" in rows_of(results_table(none))


def test_means_of_many_values_are_summed_in_double_precision():
    many = results_of([Outcome.REACHED] * 100_000, time=[0.1] * 100_000)
    assert many.means()["time"] == pytest.approx(float(np.float32(0.1)), rel=1e-9)


def test_written_files_hold_the_same_rows(tmp_path):
    json_file, csv_file = MIXED.write(tmp_path / "new" / "folder")
    assert json.loads(json_file.read_text()) == MIXED.summary()
    with csv_file.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == ["s-0", "s-1", "s-2", "s-3"]
    assert [float(row["time"]) for row in rows] == [10.0, 99.0, 30.0, 0.0]


def test_table_shows_success_beside_every_mean_and_over_how_many_it_is():
    rows = rows_of(results_table(MIXED))
    assert rows["success rate"] == ("50.0%", "95 %: 15.0% … 85.0% (Wilson)")
    assert rows["time"] == ("20.000 s", "mean of 2 reached")
    assert rows["spl"] == ("0.375", "mean of all 4")
    assert rows["HIT_MOVER"] == ("1", "25.0% (1 while the robot stood)")
    assert rows["closest approach, least"] == ("-0.100 m", "of all driven")
