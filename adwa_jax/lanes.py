"""Many episodes side by side, a lane each: the answers of `simulate.drive`, but for rounding, at the machine's speed.

Batched by hand: under `vmap` a robot that learns, hence searches for a route, would make every lane do so in every
step, and all would go on until the slowest ends. Here those learn that have to, and a lane whose episode has ended is
given the next.

Dimension letters: B lanes; T steps; the rest as in `scenario`.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from adwa_jax.constants import Constants, Options
from adwa_jax.dwa import Judged, as_printed, chosen
from adwa_jax.episode import RUNNING, Episode, EpisodeState, sensed_now
from adwa_jax.judge import finish_episode
from adwa_jax.learn import Memory, field_of, first_memory, learns
from adwa_jax.native import whole
from adwa_jax.obstacles import MoverStates, movers_at
from adwa_jax.plan import Plan
from adwa_jax.prediction import VECTOR
from adwa_jax.printed_lanes import judged_lanes
from adwa_jax.rollout import RobotState
from adwa_jax.route import Route
from adwa_jax.rules import Rules
from adwa_jax.scenario import Scenario
from adwa_jax.simulate import Outlook, act, control_step, look, most_sensed, start_episode, take_in

PRINTED = Rules(), Rules(fine_field=True)  # rules whose control step is compiled in whole stages
LARGEST_SIDE = 256  # [cells] of a map on which it is


class Task(NamedTuple):
    """What an episode is driven by."""

    scenario: Scenario
    plan: Plan
    constants: Constants


class Lanes(NamedTuple):
    """Episodes in progress; a leading axis B on everything, constants included."""

    state: EpisodeState
    memory: Memory
    task: Task


class Trace(NamedTuple):
    """The driven path, for pictures; rows beyond `length` repeat the last state."""

    robot: RobotState  # [T] each
    movers: MoverStates  # [T, M, ...]
    known: jax.Array  # [T, S] bool
    target: jax.Array  # [T, 2] float32, the local target [m]
    clearance: jax.Array  # [T] float32 [m]
    length: jax.Array  # [] int32, rows in use; row k is after k + 1 steps
    route: Route  # the last one followed
    seen: jax.Array  # [H, W] bool, hidden cells seen at the end; [0, 0] without any


def drive_lanes(scenarios: Scenario, plans: Plan, constants: Constants, options: Options) -> Episode:
    """`drive` of B scenarios with the same constants, to the end of the last; a leading axis B on the rest."""
    scenarios, plans = jax.tree.map(jnp.asarray, (scenarios, plans))
    count = scenarios.start.shape[0]
    constants = jax.tree.map(lambda value: jnp.full(count, value, jnp.float32), constants)
    lanes = _in_whole_vectors(jax.vmap(_begun)(Task(scenarios, plans, constants)), options)
    driven = results(lax.while_loop(any_running, partial(step_lanes, options=options), lanes))
    return jax.tree.map(lambda leaf: leaf[:count], driven)


def filled(lanes: Lanes, task: Task, place: jax.Array) -> Lanes:
    """The lanes with a new episode at `place`, [] int32. task: unbatched."""
    return _written(lanes, _begun(task), place)


def idle_lanes(task: Task, options: Options, count: int) -> Lanes:
    """At least `count` lanes, none of which runs, of the shapes of an unbatched task."""
    count, shapes = lanes_in_step(task, options, count), jax.eval_shape(_begun, task)
    lanes = jax.tree.map(lambda leaf: jnp.zeros((count, *leaf.shape), leaf.dtype), shapes)
    return lanes._replace(state=lanes.state._replace(outcome=jnp.zeros(count, jnp.int32)))


def advanced(lanes: Lanes, options: Options, steps: int) -> Lanes:
    """The lanes after so many control steps at most: it ends before if none runs."""

    def cond_fun(carry: tuple[jax.Array, Lanes]) -> jax.Array:
        return (carry[0] < steps) & any_running(carry[1])

    def body_fun(carry: tuple[jax.Array, Lanes]) -> tuple[jax.Array, Lanes]:
        return carry[0] + 1, step_lanes(carry[1], options)

    return lax.while_loop(cond_fun, body_fun, (jnp.int32(0), lanes))[1]


def any_running(lanes: Lanes) -> jax.Array:
    """[] bool."""
    return jnp.any(lanes.state.outcome == RUNNING)


def results(lanes: Lanes) -> Episode:
    """What came of each lane's episode; of no meaning while it runs."""
    task = lanes.task
    return jax.vmap(finish_episode)(lanes.state, lanes.memory, task.scenario, task.plan, task.constants)


def trace(scenario: Scenario, plan: Plan, constants: Constants, options: Options, steps: int) -> tuple[Episode, Trace]:
    """The same episode, its path kept: at most `steps` control steps, which must cover the scenario's time limit.

    Unbatched; driven in a lane whose neighbours are idle.
    """
    task = jax.tree.map(jnp.asarray, Task(scenario, plan, constants))
    lanes = filled(idle_lanes(task, options, 1), task, jnp.int32(0))

    def body_fun(lanes: Lanes, _: None) -> tuple[Lanes, tuple]:
        lanes = step_lanes(lanes, options)
        state = _lane(lanes.state, 0)
        movers = movers_at(scenario.movers, state.step.astype(jnp.float32) * constants.behaviour.dt)
        return lanes, (state.robot, movers, state.known, state.target_point, state.measured.last.clearance)

    lanes, rows = lax.scan(body_fun, lanes, None, length=steps)
    robot, movers, known, target, clearance = rows
    memory, length = _lane(lanes.memory, 0), lanes.state.step[0]
    return _lane(results(lanes), 0), Trace(robot, movers, known, target, clearance, length, memory.route, memory.seen)


def step_lanes(lanes: Lanes, options: Options) -> Lanes:
    """One control step of every lane that runs; before it, those learn that noticed something."""
    if learns(lanes.task.scenario, options):
        lanes = _learnt(lanes, options)
    step = _step_as_printed if _has_stages(lanes.task, options) else _step
    return lanes._replace(state=step(lanes, options))


def lanes_in_step(task: Task, options: Options, count: int) -> int:
    """How many lanes are stepped where `count` are asked for; static.

    In stages, up to whole vectors: for fewer numbers a compiler makes other instructions, whose last bits differ, and
    an episode would depend on its company.
    """
    return count + -count % VECTOR if _has_stages(task, options) else count


def _in_whole_vectors(lanes: Lanes, options: Options) -> Lanes:
    """The lanes, the last of them repeated up to `lanes_in_step`."""
    count = lanes.state.step.size
    places = np.minimum(np.arange(lanes_in_step(lanes.task, options, count)), count - 1)
    return lanes if len(places) == count else jax.tree.map(lambda leaf: leaf[places], lanes)


def _has_stages(task: Task, options: Options) -> bool:
    """Whether `_step_as_printed` drives such tasks, one or many; static, and the same however many there are.

    Only on a CPU, which runs a stage as one function, and where it is known to compile: a compiler fails on a stage's
    operand that nothing reads, as happens where there is nothing unknown, or where loops are of one turn. Nor on large
    maps, whose lanes take too much memory for whole vectors of them.
    """
    scenario, rows, columns = task.scenario, *task.scenario.grid.occupied.shape[-2:]
    squares, movers = (obstacles.valid.shape[-1] for obstacles in (scenario.squares, scenario.movers))
    return (jax.default_backend() == "cpu" and as_printed(task.constants, options) and options.rules in PRINTED
            and options.dwa.horizon_steps > 1 and max(rows, columns) <= LARGEST_SIDE
            and squares + movers > 0 and squares % VECTOR == 0 and movers % VECTOR == 0)  # fmt: skip


def _step_as_printed(lanes: Lanes, options: Options) -> EpisodeState:
    """`control_step` of every lane in stages, most of them native functions."""
    state, memory, task = lanes

    def look_one(state: EpisodeState, memory: Memory, task: Task) -> Outlook:
        return look(state, memory, task.scenario, task.plan, task.constants, options)

    # Without movers there is no use for the time, and a compiler fails on operands that nothing reads.
    stage = whole if task.scenario.movers.valid.size else _apart
    outlook = stage(jax.vmap(look_one), state, memory, task)
    fields = jax.vmap(field_of)(memory, task.plan)
    judged = judged_lanes(state.robot, fields, outlook.sensed, task.constants, options)

    def act_one(state: EpisodeState, judged: Judged, outlook: Outlook, memory: Memory, task: Task) -> EpisodeState:
        decision = chosen(state.robot, judged, outlook.guidance, task.constants, options)
        return _if_running(act(state, decision, outlook, memory, *task, options), state)

    return whole(jax.vmap(act_one), state, judged, outlook, memory, task)


def _step(lanes: Lanes, options: Options) -> EpisodeState:
    """`control_step` of every lane."""
    state, (scenario, _, constants) = lanes.state, lanes.task
    most = most_sensed(jax.vmap(partial(sensed_now, options=options))(state, scenario, constants))

    def step_one(state: EpisodeState, memory: Memory, task: Task) -> EpisodeState:
        return _if_running(control_step(state, memory, *task, options, most)[0], state)

    return jax.vmap(step_one)(state, lanes.memory, lanes.task)


def _apart(function: Callable, *operands: Any) -> Any:
    """As `whole`, but a kernel for each operation."""
    return function(*operands)


def _if_running(moved: EpisodeState, state: EpisodeState) -> EpisodeState:
    return jax.tree.map(lambda new, old: jnp.where(state.outcome == RUNNING, new, old), moved, state)


def _learnt(lanes: Lanes, options: Options) -> Lanes:
    """One lane after another takes in what it noticed."""

    def cond_fun(lanes: Lanes) -> jax.Array:
        return jnp.any(_due(lanes))

    def body_fun(lanes: Lanes) -> Lanes:
        place = jnp.argmax(_due(lanes)).astype(jnp.int32)
        state, memory, (scenario, _, constants) = _lane(lanes, place)
        state, memory = take_in(state, memory, scenario, constants, options)
        return lanes._replace(state=_written(lanes.state, state, place), memory=_written(lanes.memory, memory, place))

    return lax.while_loop(cond_fun, body_fun, lanes)


def _due(lanes: Lanes) -> jax.Array:
    return lanes.state.noticed & (lanes.state.outcome == RUNNING)


def _begun(task: Task) -> Lanes:
    """An episode before its first step, unbatched."""
    return Lanes(start_episode(task.scenario, task.plan), first_memory(task.scenario, task.plan), task)


def _lane(lanes: Any, place: jax.Array | int) -> Any:
    """One row of every leaf."""
    return jax.tree.map(lambda leaf: leaf[place], lanes)


def _written(lanes: Any, row: Any, place: jax.Array) -> Any:
    """Every leaf with one row anew."""
    return jax.tree.map(lambda leaf, value: lax.dynamic_update_index_in_dim(leaf, value, place, 0), lanes, row)
