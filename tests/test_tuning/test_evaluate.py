from dataclasses import replace

import jax
import numpy as np
import pytest

from adwa_jax.episode import Outcome
from adwa_jax.heuristic_weight import WeightRule
from adwa_jax.presets import paper
from adwa_jax.score import ScoreWeights
from scenarios.suite import make_suite
from tests.test_tuning.worlds import OPEN, brief, drawn, mixed_suite, part_of
from tuning.engine import _block, program_of
from tuning.evaluate import evaluate

SUITE = mixed_suite()
OTHER_WEIGHTS = ScoreWeights(local_heading=0.3, clearance=0.9, velocity=0.2, global_heading=0.4)


@pytest.fixture(scope="module")
def together():
    _block.clear_cache()  # of what other files compiled
    return evaluate(SUITE, paper())


def bits(results, index):
    """Everything found out about one scenario."""
    measures = {name: (values.dtype, values[index].tobytes()) for name, values in results.measures.items()}
    return {**measures, "outcome": int(results.outcome[index])}


@pytest.mark.parametrize("index", range(len(SUITE.names)), ids=SUITE.names)
def test_a_scenario_alone_gives_the_same_bits_as_among_others(together, index):
    alone = evaluate(part_of(SUITE, [index]), paper())
    assert bits(alone, 0) == bits(together, index)


def test_another_order_and_repetition_give_the_same_bits(together):
    order = [5, 2, 6, 2, 0, 3, 1, 4, 0]
    shuffled = evaluate(part_of(SUITE, order), paper())
    for place, index in enumerate(order):
        assert bits(shuffled, place) == bits(together, index), SUITE.names[index]


def test_more_scenarios_than_all_lanes_hold_give_the_same_bits(together):
    many = evaluate(part_of(SUITE, [4] * 70 + [5]), paper())
    assert all(bits(many, place) == bits(together, 4) for place in range(70))
    assert bits(many, 70) == bits(together, 5)


def test_results_are_in_the_suites_order_and_differ(together):
    assert (together.suite, together.names) == ("mixed", SUITE.names)
    outcomes = dict(zip(SUITE.names, map(Outcome, together.outcome), strict=True))
    assert outcomes["open"] == Outcome.REACHED
    assert outcomes["walled"] == Outcome.NO_PATH
    assert outcomes["brief"] == outcomes["large"] == Outcome.TIMEOUT
    assert len({bits(together, index)["length"] for index in range(len(SUITE.names))}) == len(SUITE.names)


def test_outcomes_are_exclusive_and_sum_to_the_count(together):
    assert sum(together.outcomes().values()) == together.count == len(SUITE.names)
    assert set(together.outcome.tolist()) <= {int(outcome) for outcome in Outcome}


def test_no_measure_is_ever_nan_or_infinite(together):
    for name, values in together.measures.items():
        assert np.isfinite(values).all(), name
    assert None not in together.means().values()


def test_a_scenario_without_a_path_is_reported_with_zero_lengths(together):
    row = together.scenario(SUITE.names.index("walled"))
    assert row["outcome"] == "NO_PATH"
    for name in ("optimal_length", "planned_length", "key_point_length", "key_point_count", "length", "time", "spl",
                 "length_ratio", "barn_score", "brakings"):  # fmt: skip
        assert row[name] == 0, name


def test_a_time_limit_ends_an_episode_on_its_step(together):
    assert together.measures["time"][SUITE.names.index("brief")] == pytest.approx(0.3)
    assert together.measures["time"][SUITE.names.index("large")] == pytest.approx(8.0)


def test_an_open_field_is_crossed_straight(together):
    row = together.scenario(SUITE.names.index("open"))
    assert row["planned_length"] == pytest.approx(3 + np.sqrt(2), abs=1e-6)
    assert row["optimal_length"] == row["planned_length"]
    tolerance = float(SUITE.scenarios[5].goal_tolerance)
    assert np.hypot(4, 1) - tolerance - 1e-3 <= row["length"] <= row["optimal_length"]
    assert (row["spl"], row["hit_while_stopped"]) == (1.0, 0)


def test_weights_argument_stands_in_for_the_configurations(together):
    config = paper()
    part = part_of(SUITE, [1, 2])
    named = evaluate(part, config, OTHER_WEIGHTS)
    built_in = evaluate(part, config._replace(constants=replace(config.constants, weights=OTHER_WEIGHTS)))
    assert [bits(named, index) for index in (0, 1)] == [bits(built_in, index) for index in (0, 1)]
    assert bits(named, 1) != bits(together, 2)


def test_no_change_of_constants_scenarios_seeds_or_counts_compiles_anew(together):
    compiled = _block._cache_size()
    config = paper()
    constants = config.constants
    others = [
        replace(constants, weights=OTHER_WEIGHTS),
        replace(constants, weight_rule=WeightRule(0.1, 0.2, 1.0, 0.3, 2.0, 0.4)),
        replace(constants, robot=replace(constants.robot, v_max=0.7, radius=0.2, acceleration=1)),
        replace(constants, behaviour=replace(constants.behaviour, sensor_range=2.0, clearance_cap=1)),
    ]
    for other in others:
        evaluate(part_of(SUITE, [3, 4]), config._replace(constants=other))
    drawn_anew = make_suite("paper-15", 8, 3)
    for scenarios in (drawn_anew.scenarios, drawn_anew.scenarios[:1]):
        short = tuple(brief(one, 1.0) for one in scenarios)
        evaluate(replace(drawn_anew, scenarios=short, names=drawn_anew.names[: len(short)]), config)
    assert _block._cache_size() == compiled


def test_every_program_is_compiled_once(together):
    """The counter above counts: the suite's two shapes are two programs, and the rest of this file adds none."""
    assert _block._cache_size() == len({program_of(scenario, paper().constants, paper().options).shape
                                         for scenario in SUITE.scenarios}) == 2  # fmt: skip


def test_a_suite_without_scenarios_is_refused():
    with pytest.raises(ValueError, match=r"^mixed: 0 scenarios; there must be at least one; "):
        evaluate(part_of(SUITE, []), paper())


def test_a_program_follows_from_its_scenario_alone():
    programs = {name: program_of(scenario, paper().constants, paper().options)
                for name, scenario in zip(SUITE.names, SUITE.scenarios, strict=True)}  # fmt: skip
    assert len(set(programs.values())) == 2
    assert programs["large"] != programs["small"] == programs["detour"] == programs["walled"]
    assert programs["large"].shape.rows == 24


def test_a_robot_wider_than_the_contact_window_widens_it():
    wide = replace(paper().constants, robot=replace(paper().constants.robot, radius=2.6))
    assert program_of(SUITE.scenarios[0], wide, paper().options).options.contact_reach >= 4


def test_progress_rises_to_the_count():
    calls = []
    evaluate(part_of(SUITE, [4, 3, 4]), paper(), progress=lambda done, total: calls.append((done, total)))
    assert calls[-1] == (3, 3)
    assert [done for done, _ in calls] == sorted({done for done, _ in calls})


def test_progress_counts_scenarios_of_several_programs():
    calls = []
    short = replace(SUITE, scenarios=(brief(SUITE.scenarios[0], 0.5), drawn(OPEN, 0.5)), names=("a", "b"))
    evaluate(short, paper(), progress=lambda done, total: calls.append((done, total)))
    assert calls == [(1, 2), (2, 2)]


def test_the_same_evaluation_twice_gives_the_same_bits(together):
    again = evaluate(SUITE, paper())
    assert jax.tree.all(jax.tree.map(np.array_equal, again.measures, together.measures))
    assert np.array_equal(again.outcome, together.outcome)
