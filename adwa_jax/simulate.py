"""The integrated algorithm in closed loop (§4): sense, pick the local target, DWA, move, move the obstacles, judge."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from adwa_jax.astar import Status
from adwa_jax.constants import Constants, Options
from adwa_jax.dwa import Decision, Guidance, decide
from adwa_jax.episode import RUNNING, Episode, EpisodeState, Outcome, position_of, sensed_now
from adwa_jax.guide import guide, is_lost, local_target, notices
from adwa_jax.judge import finish_episode, judge
from adwa_jax.learn import Memory, field_of, first_memory, learn, learns
from adwa_jax.metrics import start_measures
from adwa_jax.obstacles import Sensed, sensed_first
from adwa_jax.plan import Plan
from adwa_jax.rollout import Pose, RobotState, euler_step, wrap
from adwa_jax.scenario import Scenario
from adwa_jax.score import turn_towards


class Outlook(NamedTuple):
    """What the robot knows when it decides, and where to."""

    known: jax.Array  # [S] bool, squares sensed so far
    sensed: Sensed
    target: jax.Array  # [] int32, index of the route's point that is headed for
    guidance: Guidance
    in_sight: jax.Array  # [] bool: a place of the route


def drive(scenario: Scenario, plan: Plan, constants: Constants, options: Options) -> Episode:
    """One episode to its end (§4, Fig. 2). Unbatched; deterministic. `lanes` drive many at once."""
    scenario, plan = jax.tree.map(jnp.asarray, (scenario, plan))  # suites hold numpy arrays

    def cond_fun(carry: tuple[EpisodeState, Memory]) -> jax.Array:
        return carry[0].outcome == RUNNING

    def body_fun(carry: tuple[EpisodeState, Memory]) -> tuple[EpisodeState, Memory]:
        state, memory = carry
        if learns(scenario, options):
            state, memory = lax.cond(state.noticed, lambda: take_in(state, memory, scenario, constants, options),
                                     lambda: (state, memory))  # fmt: skip
        return control_step(state, memory, scenario, plan, constants, options)[0], memory

    begin = start_episode(scenario, plan), first_memory(scenario, plan)
    state, memory = lax.while_loop(cond_fun, body_fun, begin)
    return finish_episode(state, memory, scenario, plan, constants)


def most_sensed(sensed: Sensed) -> tuple[jax.Array, jax.Array]:
    """[] int32 each: the most squares and movers that any lane senses, one or many. The same for all lanes: a loop over
    what is sensed then ends, under `vmap` too, where there is nothing more.
    """
    return (jnp.max(jnp.sum(sensed.square_known, axis=-1, dtype=jnp.int32)),
            jnp.max(jnp.sum(sensed.seen, axis=-1, dtype=jnp.int32)))  # fmt: skip


def take_in(state: EpisodeState, memory: Memory, scenario: Scenario, constants: Constants,
            options: Options) -> tuple[EpisodeState, Memory]:
    """Learn what was noticed."""
    lost = is_lost(state, constants)
    known = sensed_now(state, scenario, constants, options).square_known
    memory = learn(memory, position_of(state), state.target, known, lost, scenario, constants, options)
    state = state._replace(target=memory.target, known=known, noticed=jnp.bool_(False),
                           lost=jnp.where(lost, 0, state.lost))  # fmt: skip
    return state, memory


def start_episode(scenario: Scenario, plan: Plan) -> EpisodeState:
    """Standing at the start, facing the first key point unless a heading is given; over at once without a path."""
    start = scenario.start
    first = local_target(jnp.minimum(1, plan.key_point_count - 1), scenario, plan)
    towards = turn_towards(start[0], start[1], jnp.float32(0.0), first)
    heading = jnp.where(scenario.heading_given, start[2], towards)
    still = jnp.float32(0.0)
    return EpisodeState(
        robot=RobotState(start[0], start[1], heading, still, still),
        step=jnp.int32(0),
        target=jnp.minimum(1, plan.key_point_count - 1),
        target_point=first,
        known=jnp.zeros_like(scenario.squares.valid),
        anchor=start[:2],
        anchor_step=jnp.int32(0),
        outcome=jnp.where(plan.search.status == Status.FOUND, RUNNING, np.int32(Outcome.NO_PATH)),
        hit_while_stopped=jnp.bool_(False),
        brakings=jnp.int32(0),
        lost=jnp.int32(0),
        noticed=jnp.bool_(True),
        measured=start_measures(),
    )


def control_step(state: EpisodeState, memory: Memory, scenario: Scenario, plan: Plan, constants: Constants,
                 options: Options, most: tuple[jax.Array, jax.Array] | None = None) -> tuple[EpisodeState, Decision]:
    """Sense, pick the target, decide, move robot and movers, judge (§4 B–F); also the decision with its diagnostics.

    most: no fewer squares and movers, [] int32 each, than are sensed of either; None: as many as are.
    """
    outlook = look(state, memory, scenario, plan, constants, options, most)
    decision = decide(state.robot, outlook.guidance, field_of(memory, plan), outlook.sensed, constants, options)
    return act(state, decision, outlook, memory, scenario, plan, constants, options), decision


def look(state: EpisodeState, memory: Memory, scenario: Scenario, plan: Plan, constants: Constants, options: Options,
         most: tuple[jax.Array, jax.Array] | None = None) -> Outlook:
    """Sense and pick the target; most: as for `control_step`."""
    as_listed = sensed_now(state, scenario, constants, options)
    squares, movers = most_sensed(as_listed) if most is None else most
    sensed = sensed_first(as_listed)._replace(square_count=squares, mover_count=movers)
    guided = guide(state, memory, scenario, plan, field_of(memory, plan), sensed, constants, options)
    return Outlook(as_listed.square_known, sensed, *guided)


def act(state: EpisodeState, decision: Decision, outlook: Outlook, memory: Memory, scenario: Scenario, plan: Plan,
        constants: Constants, options: Options) -> EpisodeState:
    """Move robot and movers, and judge."""
    behaviour = constants.behaviour
    pose = Pose(state.robot.x, state.robot.y, state.robot.heading)
    moved = euler_step(pose, decision.v, decision.yaw_rate, behaviour.dt)
    robot = RobotState(moved.x, moved.y, wrap(moved.heading), decision.v, decision.yaw_rate)
    state = state._replace(
        robot=robot,
        step=state.step + 1,
        target=outlook.target,
        target_point=outlook.guidance.local_target,
        known=outlook.known,
        brakings=state.brakings + (decision.index < 0).astype(jnp.int32),
        lost=jnp.where(outlook.in_sight, 0, state.lost + 1),
    )
    state = judge(state, pose, scenario, field_of(memory, plan), constants, options)
    return state._replace(noticed=notices(state, memory, scenario, constants, options))
