"""Pairs of candidates and scenarios on lanes: the same bits however they are run, and nothing done twice."""

import os
import subprocess
import sys
import threading
from dataclasses import replace

import jax
import numpy as np
import pytest

from adwa_jax.episode import Outcome
from adwa_jax.heuristic_weight import WeightRule
from adwa_jax.plan import plan
from adwa_jax.presets import paper
from adwa_jax.score import ScoreWeights
from adwa_jax.simulate import drive
from scenarios.padding import pad
from tests.test_tuning.worlds import brief, mixed_suite, part_of
from tuning import engine, plans_ahead
from tuning.engine import _block, driven_columns, judge_pairs, program_of
from tuning.evaluate import Interrupted, evaluate, evaluate_all
from tuning.plans_ahead import Pair, Planner, planned_columns

CONFIG = paper()
SUITE = mixed_suite()
SMALL = [index for index, scenario in enumerate(SUITE.scenarios)
         if program_of(scenario, CONFIG.constants, CONFIG.options).shape.rows == 16]  # fmt: skip
# Every one ends soon, each after another time.
WORLDS = tuple(brief(SUITE.scenarios[index], 1.0 + 0.7 * place) for place, index in enumerate(SMALL * 2))


def candidate(heading: float = 0.8, **changes):
    constants = replace(CONFIG.constants, weights=ScoreWeights(heading, 0.3, 0.8, 0.1))
    return replace(constants, **changes)


OTHER_RULE = WeightRule(0.25, 0.5, 1.5, 0.5)
CANDIDATES = [candidate(), candidate(0.2), candidate(weight_rule=OTHER_RULE),
              candidate(0.4, robot=replace(CONFIG.constants.robot, radius=0.2))]  # fmt: skip


def judged(scenarios=WORLDS, candidates=CANDIDATES, **how):
    return judge_pairs(scenarios, candidates, CONFIG.options, **how)


def same_bits(one, other) -> bool:
    return one.columns.keys() == other.columns.keys() and all(
        one.columns[name].dtype == other.columns[name].dtype
        and one.columns[name].tobytes() == other.columns[name].tobytes() for name in one.columns)  # fmt: skip


@pytest.fixture(scope="module")
def usual():
    return judged()


def test_every_pair_is_done_and_pairs_differ(usual):
    assert usual.done.all()
    assert usual.done.shape == (len(CANDIDATES), len(WORLDS))
    assert len({tuple(values[row].tobytes() for values in usual.columns.values())
                for row in range(len(CANDIDATES))}) == len(CANDIDATES)  # fmt: skip


@pytest.mark.parametrize("lanes", [1, 7, 64, 256])
def test_any_number_of_lanes_gives_the_same_bits(usual, lanes):
    assert same_bits(judged(lanes=lanes, workers=1), usual)


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_any_number_of_workers_gives_the_same_bits(usual, workers):
    assert same_bits(judged(workers=workers), usual)


def test_another_order_of_scenarios_and_candidates_gives_the_same_bits(usual):
    rows, columns = np.random.default_rng(3).permutation(len(CANDIDATES)), np.random.default_rng(4).permutation(
        len(WORLDS))  # fmt: skip
    shuffled = judged([WORLDS[index] for index in columns], [CANDIDATES[index] for index in rows])
    for name, values in usual.columns.items():
        assert shuffled.columns[name].tobytes() == values[np.ix_(rows, columns)].tobytes(), name


def test_pairs_run_in_parts_give_the_same_bits(usual):
    for row, constants in enumerate(CANDIDATES):
        for chunk in (slice(0, 3), slice(3, None)):
            part = judged(WORLDS[chunk], [constants])
            for name, values in usual.columns.items():
                assert part.columns[name].tobytes() == values[row : row + 1, chunk].tobytes(), name


def test_lanes_equal_the_unbatched_kernels(usual):
    """Counts exactly; another program may round last bits otherwise, which add up over an episode."""
    program = program_of(WORLDS[0], CONFIG.constants, CONFIG.options)

    @jax.jit
    def by_itself(world, constants):
        planned = plan(world.grid, world.start[:2], world.goal, constants, program.options.plan)
        return planned_columns(planned) | driven_columns(drive(world, planned, constants, program.options))

    for row, column in ((0, 0), (1, 1), (2, 3), (0, 5)):
        constants = jax.tree.map(np.float32, CANDIDATES[row])
        alone = by_itself(pad(WORLDS[column], program.shape), constants)
        for name, value in alone.items():
            np.testing.assert_allclose(usual.columns[name][row, column], np.asarray(value), rtol=1e-5, err_msg=name)


def test_several_host_devices_give_the_same_bits():
    """In a process of its own, whose device count is set before JAX starts."""
    code = ("import jax; from tests.test_tuning import test_engine as t; assert len(jax.devices()) == 2; "
            "import numpy as np; r = t.judged(t.WORLDS[:4], t.CANDIDATES[:2]); "
            "print(*(v.tobytes().hex() for _, v in sorted(r.columns.items())))")  # fmt: skip
    environment = {**os.environ, "XLA_FLAGS": "--xla_force_host_platform_device_count=2"}
    found = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    here = judged(WORLDS[:4], CANDIDATES[:2])
    assert found.stdout.split() == [values.tobytes().hex() for _, values in sorted(here.columns.items())]


def test_plans_are_made_once_for_a_map_and_its_constants(monkeypatch):
    calls = []
    made = plans_ahead._plans
    monkeypatch.setattr(plans_ahead, "_plans", lambda *arguments: calls.append(0) or made(*arguments))
    weights = [candidate(0.1 * step) for step in range(1, 9)]
    assert judged(WORLDS[:5], weights).plans == 5
    assert judged(WORLDS[:5], [*weights, candidate(weight_rule=OTHER_RULE)]).plans == 10
    assert judged(WORLDS[:5], [candidate(), candidate(robot=replace(CONFIG.constants.robot, v_max=0.5))]).plans == 5
    assert len(calls) == 3  # a batch each


def test_plans_ahead_equal_the_unbatched_kernel():
    program = program_of(WORLDS[0], CONFIG.constants, CONFIG.options)
    pairs = [Pair(candidate, index) for index in range(len(WORLDS)) for candidate in (0, 2)]
    constants = [jax.tree.map(np.float32, one) for one in CANDIDATES]
    planner = Planner(WORLDS, constants, program.options, program.shape, pairs)

    @jax.jit
    def by_itself(world, constants):
        return planned_columns(plan(world.grid, world.start[:2], world.goal, constants, program.options.plan))

    for pair in pairs:
        alone = by_itself(pad(WORLDS[pair.scenario], program.shape), constants[pair.candidate])
        for name, value in planner.planned(pair).figures.items():
            assert value.tobytes() == np.asarray(alone[name]).tobytes(), (pair, name)
    assert planner.plans_made == len(pairs)


def test_no_change_of_candidates_scenarios_or_counts_compiles_anew(usual):
    compiled = _block._cache_size()
    judged(WORLDS[2:5], [candidate(0.7, behaviour=replace(CONFIG.constants.behaviour, sensor_range=1.0))])
    judged(WORLDS[:1], [candidate(0.1 * step) for step in range(1, 12)])
    assert _block._cache_size() == compiled


def test_progress_rises_to_the_number_of_pairs(usual):
    calls = []
    judged(progress=lambda done, total: calls.append((done, total)))
    total = len(CANDIDATES) * len(WORLDS)
    assert calls[-1] == (total, total)
    assert [done for done, _ in calls] == sorted({done for done, _ in calls})


class TestInterruption:
    def test_what_is_done_is_kept(self, usual):
        """Ctrl-C is pressed after the first results."""
        pressed = threading.Event()

        def press(done, total):
            if done and not pressed.is_set():
                pressed.set()
                raise KeyboardInterrupt

        part = judged(WORLDS * 40, CANDIDATES, lanes=7, workers=1, progress=press)
        assert 0 < part.done.sum() < part.done.size
        for name, values in usual.columns.items():
            expected = np.tile(values, 40)[part.done]
            assert part.columns[name][part.done].tobytes() == expected.tobytes(), name

    def test_an_evaluation_tells_what_is_done(self):
        def press(done, total):
            if done:
                raise KeyboardInterrupt

        suite, count = part_of(SUITE, SMALL), len(WORLDS)
        many = replace(suite, scenarios=WORLDS * 400, names=tuple(f"w{index}" for index in range(count * 400)))
        with pytest.raises(Interrupted) as stopped:
            evaluate(many, CONFIG, progress=press)
        results = stopped.value.results
        assert stopped.value.total == len(many.names)
        assert 0 < results.count < stopped.value.total
        whole = evaluate(replace(many, scenarios=WORLDS, names=many.names[:count]), CONFIG)
        places = [int(name[1:]) % count for name in results.names]
        assert np.array_equal(results.outcome, whole.outcome[places])


def test_results_of_several_candidates_are_those_of_each():
    suite = part_of(SUITE, SMALL[:3])
    together = evaluate_all(suite, CONFIG, CANDIDATES[:2])
    for results, constants in zip(together, CANDIDATES, strict=False):
        alone = evaluate(suite, CONFIG._replace(constants=constants))
        assert results.names == alone.names
        assert np.array_equal(results.outcome, alone.outcome)
        assert all(np.array_equal(results.measures[name], alone.measures[name]) for name in alone.measures)


def test_a_failing_worker_ends_the_run_with_its_error(monkeypatch):
    def fail(*_):
        raise RuntimeError("out of memory")

    monkeypatch.setattr(engine, "_block", fail)
    with pytest.raises(RuntimeError, match="out of memory"):
        judged(WORLDS[:2])


def test_outcomes_are_ended_ones(usual):
    assert set(usual.columns["outcome"].ravel().tolist()) <= set(Outcome)
