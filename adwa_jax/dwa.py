"""One decision of the (improved) Dynamic Window Approach (§3), and of its extension by `Rules`.

Dimension letters: V speeds, N yaw rates, K predicted points.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from adwa_jax.admissible import halts_clear, is_admissible, room_to_stop
from adwa_jax.constants import Constants, Options
from adwa_jax.grid import DistanceField, Scalar
from adwa_jax.obstacles import Sensed
from adwa_jax.prediction import Prediction, candidate_clearance, clearance_now, predict
from adwa_jax.profiles import (
    Begins,
    Profiles,
    ramped_profiles,
    speed_targets,
    speeds_over_range,
    turn_targets,
    turns_begin,
    window_profiles,
    yaw_rates_over_range,
)
from adwa_jax.rollout import Arcs, Pose, RobotState, arcs
from adwa_jax.route import Ahead, foot_on
from adwa_jax.score import (
    Terms,
    clearance_term,
    forward_term,
    heading_term,
    mean_heading_term,
    mover_clearance_term,
    normalise,
    on_route_term,
    progress_term,
    turn_towards,
    velocity_term,
    weighted_sum,
)
from adwa_jax.window import RobotLimits, velocity_window


class Guidance(NamedTuple):
    """Where to."""

    local_target: jax.Array  # [2] float32 (x, y) [m]
    goal: jax.Array  # [2] float32 [m]
    ahead: Ahead | None = None  # the route, for `rules.progress`


class Candidates(NamedTuple):
    """Why a decision fell as it did: every candidate's data. Candidate (i, j) has index i·N + j."""

    v: jax.Array  # [V] float32 [m/s]
    yaw_rate: jax.Array  # [N] float32 [rad/s]
    clearance: jax.Array  # [V, N] float32 [m], least over the predicted points; to statics only under `mover_terms`
    admissible: jax.Array  # [V, N] bool
    terms: Terms  # raw terms, before normalisation
    score: jax.Array  # [V, N] float32; of no meaning where not admissible


class Decision(NamedTuple):
    """The command and where it came from."""

    v: jax.Array  # [] float32 [m/s]
    yaw_rate: jax.Array  # [] float32 [rad/s]
    index: jax.Array  # [] int32, the chosen candidate; -1: none was admissible, the robot brakes or does its least bad
    candidates: Candidates


class Judged(NamedTuple):
    """What is known of the candidates before they are scored."""

    v: jax.Array  # [V]
    yaw_rate: jax.Array  # [N]
    end: Pose  # [V, N]; heading [1, N]
    clearance: jax.Array  # [V, N]
    admissible: jax.Array  # [V, N] bool
    prediction: Prediction | None  # None: the paper's arcs
    badness: jax.Array  # [V, N], least for the least bad
    margin: jax.Array  # [V, N] [m], ≥ 0 where admissible, but for ties: how far from the edge of that


def decide(state: RobotState, guidance: Guidance, field: DistanceField, sensed: Sensed, constants: Constants,
           options: Options) -> Decision:
    """The admissible candidate of largest score (eq. 9); ties go to the lower index.

    Traditional DWA (eq. 8) is the goal as `local_target` and `global_heading` 0. Without an admissible candidate the
    robot brakes within its window and turns towards the local target, or does its least bad (`rules.least_bad`).

    Unbatched. No NaN for finite input.
    """
    return chosen(state, judged_candidates(state, field, sensed, constants, options), guidance, constants, options)


def as_printed(constants: Constants, options: Options) -> bool:
    """Whether the candidates are the paper's; static."""
    rules = options.rules
    return not any([rules.ramp, rules.second_phase, rules.reverse, rules.stopping, rules.long_watch, rules.mover_terms,
                    rules.mover_margin, len(constants.robot.disc_offsets) > 1])  # fmt: skip


def judged_candidates(state: RobotState, field: DistanceField, sensed: Sensed, constants: Constants,
                      options: Options) -> Judged:
    """The first half of `decide`: every candidate, where it leads and whether it is admissible. Unbatched."""
    judge = _judged_as_printed if as_printed(constants, options) else _judged_beyond
    return judge(state, field, sensed, constants, options)


def chosen(state: RobotState, judged: Judged, guidance: Guidance, constants: Constants, options: Options) -> Decision:
    """The second half of `decide`: scores the candidates and picks one. Unbatched."""
    terms = terms_of(state, judged, guidance, constants, options)
    score = weighted_sum(normalise(terms, judged.admissible, scales_of(constants, options), options.dwa.normalisation),
                         constants.weights)
    candidates = Candidates(judged.v, judged.yaw_rate, judged.clearance, judged.admissible, terms, score)
    best = _first_largest(jnp.where(judged.admissible, score, -jnp.inf))
    moves = jnp.any(judged.admissible)
    width = judged.yaw_rate.shape[0]
    otherwise = last_resort(state, judged, guidance, constants, options)
    return Decision(
        v=jnp.where(moves, judged.v[best // width], otherwise[0]),
        yaw_rate=jnp.where(moves, judged.yaw_rate[best % width], otherwise[1]),
        index=jnp.where(moves, best, -1),
        candidates=candidates,
    )


def _first_largest(values: jax.Array) -> jax.Array:
    """[] int32: the lowest index (v-major) of the largest value. values: [V, N].

    Index and value go together through the comparisons: to look for what equals the largest value would take a compiler
    that works out no value twice, with other last bits.
    """
    return jnp.argmax(values.reshape(-1)).astype(jnp.int32)


def _judged_as_printed(state: RobotState, field: DistanceField, sensed: Sensed, constants: Constants,
                       options: Options) -> Judged:
    """The paper's candidates: constant velocities of the window (eqs. 6 and 7), clear over the whole horizon."""
    robot, dt, dwa = constants.robot, constants.behaviour.dt, options.dwa
    v, yaw_rate = velocity_window(state.v, state.yaw_rate, robot, dt, dwa.v_samples, dwa.yaw_rate_samples)
    arc = arcs(state.heading, yaw_rate, dt, dwa.horizon_steps)
    clearance = candidate_clearance(state, v, arc, field, sensed, dt)
    return judged_by_clearance(state, v, yaw_rate, jax.tree.map(lambda rows: rows[-1], arc), clearance, robot)


def judged_by_clearance(state: RobotState, v: jax.Array, yaw_rate: jax.Array, last: Arcs, clearance: jax.Array,
                        robot: RobotLimits) -> Judged:
    """The paper's candidates. last: the last row of their arcs, [N] each; clearance: [V, N] from the robot's centre."""
    clearance = clearance - robot.radius
    end = Pose(
        x=state.x + v[:, None] * last.reach_x[None, :],
        y=state.y + v[:, None] * last.reach_y[None, :],
        heading=last.heading[None, :],
    )
    return Judged(v, yaw_rate, end, clearance, is_admissible(clearance, v, yaw_rate, robot), None, -clearance,
                  room_to_stop(clearance, v, yaw_rate, robot))


def _judged_beyond(state: RobotState, field: DistanceField, sensed: Sensed, constants: Constants,
                   options: Options) -> Judged:
    """Candidates as the rules make and judge them."""
    robot, behaviour, rules, dwa = constants.robot, constants.behaviour, options.rules, options.dwa
    profiles = candidate_profiles(state, constants, options)
    # A robot nearer than its margin may go on, but not much nearer. Predictions, whose points lie farther apart, keep
    # twice the margin, so that none promises a way on which the next steps are not admissible.
    half_of_now = 0.5 * clearance_now(state, field, sensed, robot)
    room = jnp.minimum(behaviour.static_margin, half_of_now)
    wider = jnp.minimum(2.0 * behaviour.static_margin, half_of_now)
    found = predict(state, profiles, dwa.horizon_steps, _stride(options), field, sensed, robot, behaviour,
                    rules.mover_margin, wider if rules.stopping else None)
    clearance = found.static if rules.mover_terms else jnp.minimum(found.static, found.moving)
    if rules.stopping:
        halt = halts_clear(state, profiles, field, sensed, robot, behaviour, dwa.halt_steps, rules.mover_margin, room,
                           begins_of(options))
        admissible = halt.clear_of_statics & (halt.moving > 0)
        margin = jnp.minimum(halt.static - room, halt.moving)
        badness = jnp.where(halt.clear_of_statics, -found.contact_time - 0.01 * jnp.clip(halt.moving, -1.0, 1.0),
                            1e3 - halt.static)
    else:
        least = jnp.minimum(found.static, found.moving)
        admissible = is_admissible(least, profiles.v, profiles.yaw_rate, robot)
        margin = room_to_stop(least, profiles.v, profiles.yaw_rate, robot)
        badness = jnp.where(found.static > 0, -found.contact_time, 1e3 - found.static)
    return Judged(profiles.v, profiles.yaw_rate, found.end, clearance, admissible, found, badness, margin)


def candidate_profiles(state: RobotState, constants: Constants, options: Options) -> Profiles:
    """What each candidate commands over the predicted time."""
    robot, dt, rules, dwa = constants.robot, constants.behaviour.dt, options.rules, options.dwa
    steps = _watched(options)
    if not rules.ramp:
        v, yaw_rate = velocity_window(state.v, state.yaw_rate, robot, dt, dwa.v_samples, dwa.yaw_rate_samples)
        return window_profiles(v, yaw_rate, steps, dwa.turn_step, rules.second_phase)
    held = speeds_over_range(robot, dwa.v_samples, rules.reverse)
    speeds = speed_targets(held, jnp.float32(0.0), jnp.float32(robot.v_max), rules.second_phase)
    turns = turn_targets(yaw_rates_over_range(robot, dwa.yaw_rate_samples), rules.second_phase)
    return ramped_profiles(state.v, state.yaw_rate, speeds, turns, robot, dt, steps, dwa.stride, dwa.turn_step)


def begins_of(options: Options) -> Begins:
    """Which of the candidates begin alike."""
    rules, dwa = options.rules, options.dwa
    held = dwa.v_samples + (rules.ramp and rules.reverse)
    if not rules.second_phase:
        return Begins(((0, held),), ((0, dwa.yaw_rate_samples),))
    # Over the whole range full speed and halt are among the speeds held.
    speeds = ((0, held), (dwa.v_samples - 1, dwa.v_samples), (0, 1)) if rules.ramp else ((0, held + 2),)
    return Begins(speeds, turns_begin(dwa.yaw_rate_samples))


def _watched(options: Options) -> int:
    """Predicted steps in all."""
    return options.dwa.horizon_steps + (options.dwa.watch_beyond if options.rules.long_watch else 0)


def _stride(options: Options) -> int:
    return options.dwa.stride if options.rules.ramp else 1


def brake_and_turn(state: RobotState, v: jax.Array, yaw_rate: jax.Array, local_target: jax.Array,
                   dt: Scalar) -> tuple[jax.Array, jax.Array]:
    """The speed nearest 0 and the yaw rate nearest to facing the target after one step, both within the window.

    v, yaw_rate: the window's samples, rising.
    """
    turn = turn_towards(state.x, state.y, state.heading, local_target) / dt
    return jnp.clip(0.0, v[0], v[-1]), jnp.clip(turn, yaw_rate[0], yaw_rate[-1])


def last_resort(state: RobotState, judged: Judged, guidance: Guidance, constants: Constants,
                options: Options) -> tuple[jax.Array, jax.Array]:
    """The command (v, yaw rate), [] each, where no candidate is admissible."""
    robot, dt = constants.robot, constants.behaviour.dt
    if options.rules.least_bad:
        index = _first_largest(-judged.badness)
        return judged.v[index // judged.yaw_rate.shape[0]], judged.yaw_rate[index % judged.yaw_rate.shape[0]]
    v, yaw_rate = velocity_window(state.v, state.yaw_rate, robot, dt, 2, 2)
    return brake_and_turn(state, v, yaw_rate, guidance.local_target, dt)


def terms_of(state: RobotState, judged: Judged, guidance: Guidance, constants: Constants, options: Options) -> Terms:
    """The terms in use, raw, [V, N] each. Unbatched."""
    rules, behaviour, end, shape = options.rules, constants.behaviour, judged.end, judged.clearance.shape
    # Beyond the paper a candidate may be admissible and yet end in an obstacle: no clearance, rather than less.
    clearance = judged.clearance if judged.prediction is None else jnp.maximum(judged.clearance, 0.0)
    on_a_route = rules.progress and guidance.ahead is not None
    targets = [guidance.local_target] if on_a_route else [guidance.local_target, guidance.goal]
    # Mapped: a loop writes its results down, where the compiler else works them out once for each use of them.
    headings = lax.map(lambda target: heading_term(end.x, end.y, end.heading, target), jnp.stack(targets))
    terms = Terms(local_heading=headings[0], clearance=clearance_term(clearance, behaviour.clearance_cap))
    if rules.carrot and judged.prediction is not None:
        headings_ahead = judged.prediction.headings
        terms = terms._replace(local_heading=mean_heading_term(state, headings_ahead, guidance.local_target, shape))
    if on_a_route and guidance.ahead is not None:
        now = foot_on(guidance.ahead, state.x, state.y)
        foot, farthest = foot_on(guidance.ahead, end.x, end.y), _farthest(constants, options)
        along = foot.along
        if judged.prediction is not None:  # to be halfway there sooner is better: or the robot puts off what it can
            along = 0.5 * (along + foot_on(guidance.ahead, *judged.prediction.middle).along)
        terms = terms._replace(progress=progress_term(along, now.along, farthest),
                               on_route=on_route_term(foot.apart, now.apart, farthest))
    else:
        terms = terms._replace(
            velocity=velocity_term(judged.v, shape),
            global_heading=headings[1],
        )
    if rules.mover_terms and judged.prediction is not None:
        terms = terms._replace(
            contact_time=judged.prediction.contact_time,
            mover_clearance=mover_clearance_term(judged.prediction.moving, behaviour.mover_cap),
        )
    if rules.reverse:
        terms = terms._replace(forward=forward_term(judged.v, shape))
    return terms


def scales_of(constants: Constants, options: Options) -> Terms:
    """What a term is divided by under fixed scales: the most it can be, or its half-range."""
    robot, behaviour = constants.robot, constants.behaviour
    steps = _watched(options)
    farthest = _farthest(constants, options)
    scales = {
        "local_heading": jnp.pi, "clearance": behaviour.clearance_cap, "velocity": robot.v_max,
        "global_heading": jnp.pi, "progress": farthest, "on_route": farthest,
        "contact_time": behaviour.dt * (steps * _stride(options)), "mover_clearance": behaviour.mover_cap,
        "forward": 1.0,
    }  # fmt: skip
    return Terms(**{name: jnp.float32(scale) for name, scale in scales.items()})


def _farthest(constants: Constants, options: Options) -> Scalar:
    """What the robot can cover in the horizon [m]."""
    return constants.robot.v_max * constants.behaviour.dt * (options.dwa.horizon_steps * _stride(options))
