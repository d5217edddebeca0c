"""What came of a control step: contact, arrival, standstill, time (§4 F); and of the whole episode."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.constants import Constants, Options
from adwa_jax.episode import RUNNING, Episode, EpisodeState, Outcome
from adwa_jax.footprint import over_discs
from adwa_jax.grid import DistanceField, clearance_at, distance_to_squares
from adwa_jax.learn import Memory
from adwa_jax.metrics import Step, finish_measures, measure_step
from adwa_jax.obstacles import Sensed, clearance_to_movers, clearance_to_squares, movers_at
from adwa_jax.plan import Plan
from adwa_jax.rollout import Pose
from adwa_jax.scenario import Scenario

STANDING = 1e-3  # [m/s] slower than this the robot stands


def judge(state: EpisodeState, before: Pose, scenario: Scenario, field: DistanceField, constants: Constants,
          options: Options) -> EpisodeState:
    """Contact, arrival, standstill and time after a step, in this order; and the measures."""
    behaviour, robot = constants.behaviour, state.robot
    known, unknown, moving = clearances(state, scenario, field, constants, options)
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


def clearances(state: EpisodeState, scenario: Scenario, field: DistanceField, constants: Constants,
               options: Options) -> tuple[jax.Array, jax.Array, jax.Array]:
    """True clearance [m] from the robot's outline to known squares, to all that is unknown and static, and to movers.

    Squares of the map, hidden ones too: exact within the contact window, beyond it a lower bound.
    """
    robot = state.robot
    now = movers_at(scenario.movers, state.step.astype(jnp.float32) * constants.behaviour.dt)
    everything = Sensed(scenario.squares.centre, scenario.squares.half_width, scenario.squares.valid,
                        now.position, now.velocity, scenario.movers.radius, now.present, scenario.squares.rounding)

    def known(x: jax.Array, y: jax.Array) -> jax.Array:
        exact = distance_to_squares(scenario.grid, jnp.stack([x, y]), options.contact_reach)
        farther = jnp.maximum(clearance_at(field, x, y), options.contact_reach * scenario.grid.resolution)
        return jnp.where(jnp.isfinite(exact), exact, farther)

    def unknown(x: jax.Array, y: jax.Array) -> jax.Array:
        to_squares = clearance_to_squares(everything, x, y)
        if not scenario.hidden.size:
            return to_squares
        hidden = replace(scenario.grid, occupied=scenario.hidden)
        return jnp.minimum(to_squares, distance_to_squares(hidden, jnp.stack([x, y]), options.contact_reach))

    def moving(x: jax.Array, y: jax.Array) -> jax.Array:
        return clearance_to_movers(everything, x, y, jnp.float32(0.0))

    pose = robot.x, robot.y, jnp.cos(robot.heading), jnp.sin(robot.heading)
    outline = constants.robot
    return over_discs(known, outline, *pose), over_discs(unknown, outline, *pose), over_discs(moving, outline, *pose)


def finish_episode(state: EpisodeState, memory: Memory, scenario: Scenario, plan: Plan,
                   constants: Constants) -> Episode:
    """Outcome and measures of an episode that has ended."""
    reference = jnp.where(scenario.reference_length > 0, scenario.reference_length, plan.optimal_length)
    success = state.outcome == Outcome.REACHED
    return Episode(
        outcome=state.outcome,
        hit_while_stopped=state.hit_while_stopped,
        brakings=state.brakings,
        replans=memory.replans,
        measures=finish_measures(state.measured, success, constants.behaviour.dt, plan.optimal_length, reference),
    )


def _first_true(cases: list[tuple[jax.Array, Outcome]]) -> jax.Array:
    outcome = RUNNING
    for holds, value in reversed(cases):
        outcome = jnp.where(holds, np.int32(value), outcome)
    return jnp.asarray(outcome)


def _squared(dx: jax.Array, dy: jax.Array) -> jax.Array:
    return dx * dx + dy * dy
