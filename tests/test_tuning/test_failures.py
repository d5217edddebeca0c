import numpy as np
from PIL import Image

from adwa_jax.episode import Outcome
from adwa_jax.presets import paper
from scenarios.drawing import new_figure
from tests.test_tuning.worlds import mixed_suite, part_of
from tuning.evaluations import Evaluations
from tuning.failures import failure_pictures, results_of, worst, worst_figure
from tuning.results import Results

HIT, STUCK, DONE = Outcome.HIT_MOVER, Outcome.STUCK, Outcome.REACHED


def results(outcomes, ratios):
    names = tuple(f"s{index}" for index in range(len(outcomes)))
    measures = {"length_ratio": np.array(ratios), "hit_while_stopped": np.zeros(len(names))}
    return Results("drawn", names, np.array(outcomes, np.int32), measures)


def test_failures_come_first_each_outcome_once_before_any_twice_then_detours():
    found = results([HIT, DONE, HIT, STUCK, DONE, HIT], [9.0, 1.1, 9.0, 9.0, 1.4, 9.0])
    assert worst(found) == [0, 3, 2, 5, 4, 1]


def test_worst_are_drawn_with_the_reason(tmp_path):
    suite = part_of(mixed_suite(), [1, 3, 4])  # a detour that is driven, a goal without a path, too little time
    found = Results("mixed", suite.names, np.array([DONE, Outcome.NO_PATH, Outcome.TIMEOUT], np.int32),
                    {"length_ratio": np.array([1.25, 0.0, 0.0]), "hit_while_stopped": np.zeros(3)})  # fmt: skip
    pictures = failure_pictures(suite, paper(), found, tmp_path, limit=3)
    assert [picture.caption.split(".")[0] for picture in pictures] == [
        "walled: no path", "brief: out of time", "detour: a success, its way 1"]  # fmt: skip
    assert "1.25 times the shortest grid path" in pictures[2].caption
    for picture in pictures:
        assert picture.path.parent == tmp_path
        with Image.open(picture.path) as image:
            assert min(image.size) > 400


def test_worst_are_drawn_side_by_side_with_axes_in_metres():
    suite = part_of(mixed_suite(), [1, 3, 4])
    found = Results("mixed", suite.names, np.array([DONE, Outcome.NO_PATH, Outcome.TIMEOUT], np.int32),
                    {"length_ratio": np.array([1.25, 0.0, 0.0]), "hit_while_stopped": np.zeros(3)})  # fmt: skip
    figure = worst_figure(suite, paper(), found, limit=3)
    *panels, bar = figure.axes
    assert [panel.get_title().split(":")[0] for panel in panels] == ["walled", "brief", "detour"]
    assert {(panel.get_xlabel(), panel.get_ylabel()) for panel in panels} == {("x [m]", "y [m]")}
    assert bar.get_ylabel() == "time before the end [s]"
    axes = new_figure((9.0, 3.0)).subplots(1, 3)
    assert worst_figure(suite, paper(), found, limit=3, axes=axes).axes[:3] == axes.tolist()
    assert len(worst_figure(suite, paper(), found, limit=1).axes) == 1  # it never drove: no time to show


def test_a_candidates_row_is_read_as_an_evaluation():
    suite = part_of(mixed_suite(), [1, 3])
    columns = {"outcome": np.array([[DONE, DONE], [HIT, DONE]], np.int32), "length_ratio": np.array([[1, 2], [3, 4]])}
    found = results_of(Evaluations(("a",), np.zeros((2, 1)), np.zeros(2, np.int32), columns, np.ones((2, 2), bool)), 1,
                       suite)  # fmt: skip
    assert found.names == ("detour", "walled")
    assert found.outcome.tolist() == [HIT, DONE]
    assert found.measures["length_ratio"].tolist() == [3, 4]
    assert "outcome" in columns  # untouched
