"""The integrated algorithm in closed loop (§4): sense, pick the local target, DWA, move, move the obstacles, judge."""

from dataclasses import replace
from enum import IntEnum
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from adwa_jax.astar import Status
from adwa_jax.constants import Constants, Options
from adwa_jax.dwa import Decision, Guidance, decide
from adwa_jax.footprint import over_discs
from adwa_jax.grid import DistanceField, Scalar, clearance_at, distance_to_squares
from adwa_jax.learn import Memory, field_of, first_memory, in_range, learn, learns
from adwa_jax.metrics import Measures, Running, Step, finish_measures, measure_step, start_measures
from adwa_jax.obstacles import MoverStates, Sensed, clearance_to_movers, clearance_to_squares, movers_at, sense
from adwa_jax.plan import Plan
from adwa_jax.prediction import static_clearance
from adwa_jax.rollout import Pose, RobotState, euler_step, wrap
from adwa_jax.route import Route, ahead_of, carrot, foot_on
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
    target: jax.Array  # [] int32, index of the route's point that is headed for: a key point
    target_point: jax.Array  # [2] float32, the local target [m]
    known: jax.Array  # [S] bool, unknown squares sensed so far
    anchor: jax.Array  # [2] float32, centre of the circle the robot must leave so as not to be stuck [m]
    anchor_step: jax.Array  # [] int32, when it was set
    outcome: jax.Array  # [] int32, an `Outcome`; -1 while running
    hit_while_stopped: jax.Array  # [] bool
    brakings: jax.Array  # [] int32, steps without an admissible candidate
    lost: jax.Array  # [] int32, steps for which no place of the route was in sight
    noticed: jax.Array  # [] bool: there is something to learn
    measured: Running


class Episode(NamedTuple):
    """What came of a scenario."""

    outcome: jax.Array  # [] int32, an `Outcome`
    hit_while_stopped: jax.Array  # [] bool: a mover ran into the standing robot, which no command could have avoided
    brakings: jax.Array  # [] int32
    replans: jax.Array  # [] int32, routes planned anew under way
    measures: Measures


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


def drive(scenario: Scenario, plan: Plan, constants: Constants, options: Options) -> Episode:
    """One episode to its end (§4, Fig. 2). Unbatched; deterministic. `drive_lanes` drives many at once."""
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


def drive_lanes(scenarios: Scenario, plans: Plan, constants: Constants, options: Options) -> Episode:
    """`drive` of B scenarios side by side, equal to it in every bit; a leading axis B on everything.

    Batched by hand: under `vmap` a robot that learns, hence searches for a route, would make every lane do so in every
    step.
    """
    scenarios, plans = jax.tree.map(jnp.asarray, (scenarios, plans))

    def cond_fun(carry: tuple[EpisodeState, Memory]) -> jax.Array:
        return jnp.any(carry[0].outcome == RUNNING)

    def body_fun(carry: tuple[EpisodeState, Memory]) -> tuple[EpisodeState, Memory]:
        return lanes_step(*carry, scenarios, plans, constants, options)

    begin = jax.vmap(start_episode)(scenarios, plans), jax.vmap(first_memory)(scenarios, plans)
    state, memory = lax.while_loop(cond_fun, body_fun, begin)
    return jax.vmap(partial(finish_episode, constants=constants))(state, memory, scenarios, plans)


def trace(scenario: Scenario, plan: Plan, constants: Constants, options: Options, steps: int) -> tuple[Episode, Trace]:
    """The same episode, its path kept: at most `steps` control steps, which must cover the scenario's time limit.

    Unbatched; driven as a lone lane of `drive_lanes`.
    """
    scenarios, plans = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], (scenario, plan))
    dt = constants.behaviour.dt

    def body_fun(carry: tuple[EpisodeState, Memory], _: None) -> tuple[tuple[EpisodeState, Memory], tuple]:
        state, memory = lanes_step(*carry, scenarios, plans, constants, options)
        lane = jax.tree.map(lambda leaf: leaf[0], state)
        movers = movers_at(scenario.movers, lane.step.astype(jnp.float32) * dt)
        row = (lane.robot, movers, lane.known, lane.target_point, lane.measured.last.clearance)
        return (state, memory), row

    begin = jax.vmap(start_episode)(scenarios, plans), jax.vmap(first_memory)(scenarios, plans)
    (state, memory), rows = lax.scan(body_fun, begin, None, length=steps)
    episode = jax.vmap(partial(finish_episode, constants=constants))(state, memory, scenarios, plans)
    episode, memory, length = jax.tree.map(lambda leaf: leaf[0], (episode, memory, state.step))
    robot, movers, known, target, clearance = rows
    return episode, Trace(robot, movers, known, target, clearance, length, memory.route, memory.seen)


def lanes_step(state: EpisodeState, memory: Memory, scenarios: Scenario, plans: Plan, constants: Constants,
               options: Options) -> tuple[EpisodeState, Memory]:
    """One control step of every lane that runs; before it, those learn that noticed something."""
    running = state.outcome == RUNNING

    def take_in_one(lane: tuple) -> tuple[EpisodeState, Memory]:
        due, state, memory, scenario = lane
        return lax.cond(due, lambda: take_in(state, memory, scenario, constants, options), lambda: (state, memory))

    def step_one(state: EpisodeState, memory: Memory, scenario: Scenario, plan: Plan) -> EpisodeState:
        moved = control_step(state, memory, scenario, plan, constants, options)[0]
        return jax.tree.map(lambda new, old: jnp.where(state.outcome == RUNNING, new, old), moved, state)

    if learns(scenarios, options):
        due = state.noticed & running
        state, memory = lax.cond(
            jnp.any(due), lambda: lax.map(take_in_one, (due, state, memory, scenarios)), lambda: (state, memory)
        )
    return jax.vmap(step_one)(state, memory, scenarios, plans), memory


def take_in(state: EpisodeState, memory: Memory, scenario: Scenario, constants: Constants,
            options: Options) -> tuple[EpisodeState, Memory]:
    """Learn what was noticed."""
    lost = is_lost(state, constants)
    known = _sensed(state, scenario, constants, options).square_known
    memory = learn(memory, _position(state), state.target, known, lost, scenario, constants, options)
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
                 options: Options) -> tuple[EpisodeState, Decision]:
    """Sense, pick the target, decide, move robot and movers, judge (§4 B–F); also the decision with its diagnostics."""
    behaviour = constants.behaviour
    sensed = _sensed(state, scenario, constants, options)
    field = field_of(memory, plan)
    target, guidance, in_sight = guide(state, memory, scenario, plan, field, sensed, constants, options)
    decision = decide(state.robot, guidance, field, sensed, constants, options)
    pose = Pose(state.robot.x, state.robot.y, state.robot.heading)
    moved = euler_step(pose, decision.v, decision.yaw_rate, behaviour.dt)
    robot = RobotState(moved.x, moved.y, wrap(moved.heading), decision.v, decision.yaw_rate)
    state = state._replace(
        robot=robot,
        step=state.step + 1,
        target=target,
        target_point=guidance.local_target,
        known=sensed.square_known,
        brakings=state.brakings + (decision.index < 0).astype(jnp.int32),
        lost=jnp.where(in_sight, 0, state.lost + 1),
    )
    state = judge(state, pose, scenario, field, constants, options)
    return state._replace(noticed=notices(state, memory, scenario, constants, options)), decision


def guide(state: EpisodeState, memory: Memory, scenario: Scenario, plan: Plan, field: DistanceField, sensed: Sensed,
          constants: Constants, options: Options) -> tuple[jax.Array, Guidance, jax.Array]:
    """The route point headed for, the local target with what is ahead, and whether any of the route is in sight."""
    behaviour, rules, robot = constants.behaviour, options.rules, state.robot
    position = _position(state)
    if not (rules.carrot or rules.progress or rules.replan):
        target = next_target(state.target, position, plan.key_points, plan.key_point_count,
                             behaviour.keypoint_tolerance)
        return target, Guidance(local_target(target, scenario, plan), scenario.goal), jnp.bool_(True)
    route = memory.route
    foot = foot_on(ahead_of(route, state.target), robot.x, robot.y)
    target = jnp.minimum(jnp.maximum(state.target, 1) + foot.segment, route.count - 1)
    ahead = ahead_of(route, target)

    cosine, sine = jnp.cos(robot.heading).reshape(1, 1), jnp.sin(robot.heading).reshape(1, 1)

    def clear(x: jax.Array, y: jax.Array) -> jax.Array:
        return static_clearance(field, sensed, constants.robot, x, y, cosine, sine) > 0

    place, in_sight = carrot(ahead, position, behaviour.lookahead, clear)
    if not rules.carrot:
        place = route.points[next_target(target, position, route.points, route.count, behaviour.keypoint_tolerance)]
    return target, Guidance(place, scenario.goal, ahead), in_sight


def notices(state: EpisodeState, memory: Memory, scenario: Scenario, constants: Constants,
            options: Options) -> jax.Array:
    """[] bool: whether there is something to learn (`learn`) before the next step."""
    behaviour = constants.behaviour
    news = jnp.bool_(False)
    if scenario.hidden.size:
        news |= jnp.any(in_range(scenario, _position(state), behaviour.sensor_range) & ~memory.seen)
    if options.rules.replan:
        news |= jnp.any(_sensed(state, scenario, constants, options).square_known & ~state.known)
        news |= is_lost(state, constants)
    return news


def is_lost(state: EpisodeState, constants: Constants) -> jax.Array:
    """[] bool: nothing of the route was in sight for `lost_time`, or the robot stays on the spot: every third of
    `stuck_time`.
    """
    behaviour = constants.behaviour
    still = state.step - state.anchor_step
    stays = (still > 0) & (still % jnp.maximum(_steps(behaviour.stuck_time, constants) // 3, 1) == 0)
    return stays | (state.lost >= _steps(behaviour.lost_time, constants))


def next_target(target: jax.Array, position: jax.Array, points: jax.Array, count: jax.Array,
                tolerance: Scalar) -> jax.Array:
    """[] int32: the next point not yet within `tolerance`; the last stays (§4 B). points: [P, 2], `count` in use."""

    def cond_fun(index: jax.Array) -> jax.Array:
        offset = points[index] - position
        return (index < count - 1) & (jnp.sum(offset * offset) <= tolerance * tolerance)

    return lax.while_loop(cond_fun, lambda index: index + 1, target)


def local_target(index: jax.Array, scenario: Scenario, plan: Plan) -> jax.Array:
    """[2] (x, y) [m]: the key point, or the goal itself in place of the last."""
    return jnp.where(index >= plan.key_point_count - 1, scenario.goal, plan.key_points[index])


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


def _position(state: EpisodeState) -> jax.Array:
    return jnp.stack([state.robot.x, state.robot.y])


def _sensed(state: EpisodeState, scenario: Scenario, constants: Constants, options: Options) -> Sensed:
    """What the robot senses where it is now."""
    time = state.step.astype(jnp.float32) * constants.behaviour.dt
    sensed = sense(scenario.squares, state.known, scenario.movers, movers_at(scenario.movers, time), _position(state),
                   constants.behaviour.sensor_range)
    if not options.rules.border:
        return sensed
    grid = scenario.grid
    size = jnp.stack([grid.width, grid.height]).astype(jnp.float32) * grid.resolution
    return sensed._replace(border=jnp.stack([grid.origin, grid.origin + size]))


def _steps(duration: Scalar, constants: Constants) -> jax.Array:
    """[] int32: control steps in a duration [s]."""
    return jnp.round(duration / constants.behaviour.dt).astype(jnp.int32)


def _first_true(cases: list[tuple[jax.Array, Outcome]]) -> jax.Array:
    outcome = RUNNING
    for holds, value in reversed(cases):
        outcome = jnp.where(holds, np.int32(value), outcome)
    return jnp.asarray(outcome)


def _squared(dx: jax.Array, dy: jax.Array) -> jax.Array:
    return dx * dx + dy * dy
