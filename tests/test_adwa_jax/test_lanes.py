"""The control step of many lanes in stages: where it is taken, and that it is the control step."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.extend.core import jaxprs_in_params

from adwa_jax import lanes as lanes_module
from adwa_jax import printed_lanes
from adwa_jax.constants import DwaOptions, Options
from adwa_jax.episode import RUNNING
from adwa_jax.lanes import Lanes, Task, _begun, _has_stages, _step, _step_as_printed, lanes_in_step
from adwa_jax.plan import plan
from adwa_jax.presets import extended, paper
from adwa_jax.rules import Rules
from scenarios.padding import pad, padded_shape, stack
from scenarios.suite import make_suite

CONSTANTS = jax.tree.map(np.float32, paper().constants)
OPTIONS = paper().options
WORLDS = [pad(world, padded_shape(world)) for world in make_suite("paper-15", 0, 8).scenarios]
STEPS = 24


def first(items, count):
    return jax.tree.map(lambda leaf: leaf[:count], items)


def with_hidden_cells(world):
    shown = np.random.default_rng(0).random(world.grid.occupied.shape) < 0.7
    return replace(world, grid=replace(world.grid, occupied=world.grid.occupied & shown),
                   hidden=world.grid.occupied & ~shown)  # fmt: skip


def with_tracks(world):
    """Every mover to and fro between where it is and where it would be in 5 s."""
    movers = world.movers
    ends = np.stack([movers.position, movers.position + 5 * movers.velocity, movers.position], axis=1)
    times = np.broadcast_to(np.float32([0, 5, 10])[None, :, None], (*ends.shape[:2], 1))
    count = len(movers.radius)
    return replace(world, movers=replace(movers, track=np.concatenate([times, ends], axis=2),
                                         track_length=np.full(count, 3, np.int32),
                                         period=np.full(count, 10, np.float32)))  # fmt: skip


def of_dwa(*samples, **changes):
    return replace(OPTIONS, dwa=DwaOptions(*samples, **changes))


CASES = {
    "no squares, tracks, ranges": (
        [with_tracks(replace(world, squares=first(world.squares, 0))) for world in WORLDS],
        of_dwa(5, 16, 7, normalisation="minmax"),
    ),
    "no movers, hidden cells, fixed scales": (
        [with_hidden_cells(replace(world, movers=first(world.movers, 0))) for world in WORLDS],
        of_dwa(normalisation="none"),
    ),
    "least window and horizon, fine field": (
        WORLDS, replace(of_dwa(2, 2, 2), rules=Rules(fine_field=True), contact_reach=1),
    ),
}


def begun(worlds, options: Options) -> Lanes:
    worlds = jax.tree.map(jnp.asarray, stack(worlds))
    plans = jax.lax.map(lambda one: plan(one.grid, one.start[:2], one.goal, CONSTANTS, options.plan), worlds)
    constants = jax.tree.map(lambda value: jnp.full(len(WORLDS), value), CONSTANTS)
    return jax.vmap(_begun)(Task(worlds, plans, constants))


@pytest.mark.parametrize("case", CASES)
def test_the_step_in_stages_is_the_control_step(case):
    """Whatever the options: a stage that a compiler cannot take would end the process."""
    worlds, options = CASES[case]
    lanes = jax.jit(lambda: begun(worlds, options))()
    assert _has_stages(lanes.task, options)

    def driven(step):
        return jax.jit(lambda lanes: jax.lax.fori_loop(
            0, STEPS, lambda _, lanes: lanes._replace(state=step(lanes, options)), lanes))(lanes).state  # fmt: skip

    staged, plain = driven(_step_as_printed), driven(_step)
    assert np.count_nonzero(staged.outcome == RUNNING) > len(WORLDS) // 2
    for leaf, expected in zip(jax.tree.leaves(staged), jax.tree.leaves(plain), strict=True):
        np.testing.assert_allclose(leaf, expected, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("case", CASES)
def test_no_stage_calls_a_library(monkeypatch, case):
    """Of a reduction of floats a compiler makes such a call, for which it has no place inside a native function."""
    worlds, options = CASES[case]
    stages = []

    def kept(function, *operands):
        stages.append(jax.make_jaxpr(function)(*operands).jaxpr)
        return function(*operands)

    monkeypatch.setattr(lanes_module, "whole", kept)
    monkeypatch.setattr(printed_lanes, "whole", kept)
    lanes = jax.eval_shape(lambda: begun(worlds, options))
    jax.eval_shape(lambda lanes: _step_as_printed(lanes, options), lanes)
    used = [(equation.primitive.name, equation.invars[0].aval.dtype)
            for stage in stages for equation in equations_of(stage)]  # fmt: skip
    assert ("reduce_or", np.dtype(bool)) in used
    library = "reduce_sum", "reduce_min", "reduce_max", "dot_general"
    assert not [name for name, dtype in used if name in library and dtype == np.float32]


def equations_of(jaxpr):
    """Those of inner programs too."""
    for equation in jaxpr.eqns:
        if equation.invars:
            yield equation
        for inner in jaxprs_in_params(equation.params):
            yield from equations_of(inner)


def test_the_choice_of_the_step_follows_from_a_scenario_and_the_options():
    world = WORLDS[0]
    task = Task(world, None, CONSTANTS)
    assert _has_stages(task, OPTIONS)
    assert not _has_stages(task, extended().options)
    assert not _has_stages(task._replace(constants=replace(CONSTANTS, robot=replace(
        CONSTANTS.robot, disc_offsets=(-0.1, 0.1)))), OPTIONS)  # fmt: skip
    empty = replace(world, squares=first(world.squares, 0), movers=first(world.movers, 0))
    assert not _has_stages(task._replace(scenario=empty), OPTIONS)
    one = replace(world, squares=first(world.squares, 1))
    assert not _has_stages(task._replace(scenario=one), OPTIONS)
    assert not _has_stages(task, of_dwa(horizon_steps=1))
    large = replace(world, grid=replace(world.grid, occupied=np.ones((16, 257), bool)))
    assert not _has_stages(task._replace(scenario=large), OPTIONS)


def test_lanes_in_stages_are_whole_vectors():
    task = Task(WORLDS[0], None, CONSTANTS)
    assert [lanes_in_step(task, OPTIONS, count) for count in (1, 7, 8, 9, 64)] == [8, 8, 8, 16, 64]
    assert lanes_in_step(task, extended().options, 7) == 7
