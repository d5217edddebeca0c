"""The integrated algorithm in closed loop (§4): sense, pick the local target, DWA, move, move the obstacles, judge."""

from enum import IntEnum
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from adwa_jax.astar import Status
from adwa_jax.constants import Constants, Options
from adwa_jax.dwa import Decision, RobotState, decide, wrap
from adwa_jax.grid import Scalar, clearance_at, distance_to_squares
from adwa_jax.metrics import Measures, Running, Step, finish_measures, measure_step, start_measures
from adwa_jax.obstacles import MoverStates, Sensed, clearance_to_movers, clearance_to_squares, movers_at, sense
from adwa_jax.plan import Plan
from adwa_jax.rollout import Pose, euler_step
from adwa_jax.scenario import Scenario
from adwa_jax.score import turn_towards


class Outcome(IntEnum):
    """How an episode ended; exclusive."""

    REACHED = 0
    HIT_KNOWN = 1
    HIT_UNKNOWN = 2
    HIT_MOVER = 3
    STUCK = 4
    TIMEOUT = 5
    NO_PATH = 6


RUNNING = np.int32(-1)
STANDING = 1e-3  # [m/s] slower than this the robot stands


class EpisodeState(NamedTuple):
    """An episode in progress."""

    robot: RobotState
    step: jax.Array  # [] int32, control steps driven
    target: jax.Array  # [] int32, index of the key point that is the local target
    known: jax.Array  # [S] bool, unknown squares sensed so far
    anchor: jax.Array  # [2] float32, centre of the circle the robot must leave so as not to be stuck [m]
    anchor_step: jax.Array  # [] int32, when it was set
    outcome: jax.Array  # [] int32, an `Outcome`; -1 while running
    hit_while_stopped: jax.Array  # [] bool
    brakings: jax.Array  # [] int32, steps without an admissible candidate
    measured: Running


class Episode(NamedTuple):
    """What came of a scenario."""

    outcome: jax.Array  # [] int32, an `Outcome`
    hit_while_stopped: jax.Array  # [] bool: a mover ran into the standing robot, which no command could have avoided
    brakings: jax.Array  # [] int32
    measures: Measures


class Trace(NamedTuple):
    """The driven path, for pictures; rows beyond `length` repeat the last state."""

    robot: RobotState  # [T] each
    movers: MoverStates  # [T, M, ...]
    known: jax.Array  # [T, S] bool
    target: jax.Array  # [T, 2] float32, the local target [m]
    clearance: jax.Array  # [T] float32 [m]
    length: jax.Array  # [] int32, rows in use; row k is after k + 1 steps


def drive(scenario: Scenario, plan: Plan, constants: Constants, options: Options) -> Episode:
    """One episode to its end (§4, Fig. 2). Unbatched; deterministic."""
    scenario, plan = jax.tree.map(jnp.asarray, (scenario, plan))  # suites hold numpy arrays

    def cond_fun(state: EpisodeState) -> jax.Array:
        return state.outcome == RUNNING

    def body_fun(state: EpisodeState) -> EpisodeState:
        return control_step(state, scenario, plan, constants, options)[0]

    state = lax.while_loop(cond_fun, body_fun, start_episode(scenario, plan))
    return finish_episode(state, scenario, plan, constants)


def trace(scenario: Scenario, plan: Plan, constants: Constants, options: Options, steps: int) -> tuple[Episode, Trace]:
    """The same episode, its path kept: at most `steps` control steps, which must cover the scenario's time limit."""
    scenario, plan = jax.tree.map(jnp.asarray, (scenario, plan))

    def body_fun(state: EpisodeState, _: None) -> tuple[EpisodeState, tuple]:
        running = state.outcome == RUNNING
        moved = control_step(state, scenario, plan, constants, options)[0]
        state = jax.tree.map(lambda new, old: jnp.where(running, new, old), moved, state)
        movers = movers_at(scenario.movers, state.step.astype(jnp.float32) * constants.behaviour.dt)
        row = (state.robot, movers, state.known, local_target(state.target, scenario, plan),
               state.measured.last.clearance)
        return state, row

    state, (robot, movers, known, target, clearance) = lax.scan(
        body_fun, start_episode(scenario, plan), None, length=steps
    )
    episode = finish_episode(state, scenario, plan, constants)
    return episode, Trace(robot, movers, known, target, clearance, state.step)


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
        known=jnp.zeros_like(scenario.squares.valid),
        anchor=start[:2],
        anchor_step=jnp.int32(0),
        outcome=jnp.where(plan.search.status == Status.FOUND, RUNNING, np.int32(Outcome.NO_PATH)),
        hit_while_stopped=jnp.bool_(False),
        brakings=jnp.int32(0),
        measured=start_measures(),
    )


def control_step(state: EpisodeState, scenario: Scenario, plan: Plan, constants: Constants,
                 options: Options) -> tuple[EpisodeState, Decision]:
    """Sense, pick the target, decide, move robot and movers, judge (§4 B–F); also the decision with its diagnostics."""
    behaviour = constants.behaviour
    time = state.step.astype(jnp.float32) * behaviour.dt
    position = jnp.stack([state.robot.x, state.robot.y])
    target = next_target(state.target, position, plan, behaviour.keypoint_tolerance)
    sensed = sense(scenario.squares, state.known, scenario.movers, movers_at(scenario.movers, time), position,
                   behaviour.sensor_range)
    decision = decide(
        state.robot, local_target(target, scenario, plan), scenario.goal, plan.field, sensed, constants.weights,
        constants.robot, behaviour.clearance_cap, behaviour.dt, options.dwa,
    )  # fmt: skip
    pose = Pose(state.robot.x, state.robot.y, state.robot.heading)
    moved = euler_step(pose, decision.v, decision.yaw_rate, behaviour.dt)
    robot = RobotState(moved.x, moved.y, wrap(moved.heading), decision.v, decision.yaw_rate)
    state = state._replace(
        robot=robot,
        step=state.step + 1,
        target=target,
        known=sensed.square_known,
        brakings=state.brakings + (decision.index < 0).astype(jnp.int32),
    )
    return judge(state, pose, scenario, plan, constants, options), decision


def next_target(target: jax.Array, position: jax.Array, plan: Plan, tolerance: Scalar) -> jax.Array:
    """[] int32: the next key point not yet within `tolerance`; the last stays (§4 B)."""

    def cond_fun(index: jax.Array) -> jax.Array:
        offset = plan.key_points[index] - position
        return (index < plan.key_point_count - 1) & (jnp.sum(offset * offset) <= tolerance * tolerance)

    return lax.while_loop(cond_fun, lambda index: index + 1, target)


def local_target(index: jax.Array, scenario: Scenario, plan: Plan) -> jax.Array:
    """[2] (x, y) [m]: the key point, or the goal itself in place of the last."""
    return jnp.where(index >= plan.key_point_count - 1, scenario.goal, plan.key_points[index])


def judge(state: EpisodeState, before: Pose, scenario: Scenario, plan: Plan, constants: Constants,
          options: Options) -> EpisodeState:
    """Contact, arrival, standstill and time after a step, in this order; and the measures."""
    behaviour, robot = constants.behaviour, state.robot
    known, unknown, moving = clearances(state, scenario, plan, constants, options)
    step = Step(robot.x - before.x, robot.y - before.y, robot.yaw_rate * behaviour.dt, robot.v, robot.yaw_rate,
                jnp.minimum(known, jnp.minimum(unknown, moving)))
    away = _squared(robot.x - state.anchor[0], robot.y - state.anchor[1]) > behaviour.stuck_radius**2
    anchor_step = jnp.where(away, state.step, state.anchor_step)
    still_for = (state.step - anchor_step).astype(jnp.float32) * behaviour.dt
    reached = _squared(robot.x - scenario.goal[0], robot.y - scenario.goal[1]) <= scenario.goal_tolerance**2
    last_step = jnp.round(scenario.time_limit / behaviour.dt).astype(jnp.int32)
    outcome = _first_true([
        (known < 0, Outcome.HIT_KNOWN),
        (unknown < 0, Outcome.HIT_UNKNOWN),
        (moving < 0, Outcome.HIT_MOVER),
        (reached, Outcome.REACHED),
        (still_for >= behaviour.stuck_time, Outcome.STUCK),
        (state.step >= last_step, Outcome.TIMEOUT),
    ])  # fmt: skip
    return state._replace(
        anchor=jnp.where(away, jnp.stack([robot.x, robot.y]), state.anchor),
        anchor_step=anchor_step,
        outcome=outcome,
        hit_while_stopped=(outcome == Outcome.HIT_MOVER) & (jnp.abs(robot.v) < STANDING),
        measured=measure_step(state.measured, step, behaviour.danger_clearance),
    )


def clearances(state: EpisodeState, scenario: Scenario, plan: Plan, constants: Constants,
               options: Options) -> tuple[jax.Array, jax.Array, jax.Array]:
    """True clearance [m] from the robot's outline to known squares, all unknown squares and all present movers.

    Known squares: exact within the contact window, beyond it the distance field's lower bound.
    """
    x, y = state.robot.x, state.robot.y
    exact = distance_to_squares(scenario.grid, jnp.stack([x, y]), options.contact_reach)
    known = jnp.where(jnp.isfinite(exact), exact, clearance_at(plan.field, x, y))
    now = movers_at(scenario.movers, state.step.astype(jnp.float32) * constants.behaviour.dt)
    everything = Sensed(scenario.squares.centre, scenario.squares.half_width, scenario.squares.valid,
                        now.position, now.velocity, scenario.movers.radius, now.present)
    unknown = clearance_to_squares(everything, x, y)
    moving = clearance_to_movers(everything, x, y, jnp.float32(0.0))
    radius = constants.robot.radius
    return known - radius, unknown - radius, moving - radius


def finish_episode(state: EpisodeState, scenario: Scenario, plan: Plan, constants: Constants) -> Episode:
    """Outcome and measures of an episode that has ended."""
    reference = jnp.where(scenario.reference_length > 0, scenario.reference_length, plan.optimal_length)
    success = state.outcome == Outcome.REACHED
    return Episode(
        outcome=state.outcome,
        hit_while_stopped=state.hit_while_stopped,
        brakings=state.brakings,
        measures=finish_measures(state.measured, success, constants.behaviour.dt, plan.optimal_length, reference),
    )


def _first_true(cases: list[tuple[jax.Array, Outcome]]) -> jax.Array:
    outcome = RUNNING
    for holds, value in reversed(cases):
        outcome = jnp.where(holds, np.int32(value), outcome)
    return jnp.asarray(outcome)


def _squared(dx: jax.Array, dy: jax.Array) -> jax.Array:
    return dx * dx + dy * dy
