"""A stretch of an episode, driven by relaxed decisions, and how bad it was: a loss that has gradients.

The stretch starts from a state on the way of a hard episode. What the robot has learnt until then, its route and the
hidden cells it has seen, is held fixed: nothing is planned anew.
Dimension letters: T control steps; B lanes; P starts on the way.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from adwa_jax.checks import require_choice, require_whole
from adwa_jax.constants import Constants, Options
from adwa_jax.episode import RUNNING, EpisodeState, sensed_now
from adwa_jax.grid import DistanceField, Scalar
from adwa_jax.guide import guide
from adwa_jax.lanes import Lanes, Task, advanced
from adwa_jax.learn import Memory, field_of, first_memory
from adwa_jax.obstacles import Sensed, movers_at
from adwa_jax.plan import Plan
from adwa_jax.prediction import mover_clearance, static_clearance
from adwa_jax.relaxed import Softness, Variant, relaxed_decide
from adwa_jax.rollout import Pose, RobotState, euler_step, wrap
from adwa_jax.route import ahead_of, foot_on
from adwa_jax.scenario import Scenario
from adwa_jax.simulate import start_episode

COMFORT = 0.3
"""Clearance below which a step counts as too near [m]: more than twice what is a danger point."""


@jax.tree_util.register_static
@dataclass(frozen=True)
class Stretch:
    """Static choices of the relaxed drive."""

    steps: int = 30  # T
    truncate: int = 10  # gradients reach back over so many steps at most
    variant: Variant = "smooth"

    def __post_init__(self) -> None:
        """Refuse empty stretches and unknown variants."""
        require_whole("steps", self.steps, 1)
        require_whole("truncate", self.truncate, 1)
        require_choice("variant", self.variant, ("smooth", "straight_through"))


class Loss(NamedTuple):
    """Parts of a loss, or their weights; [] float32 each. Each is about 0 for a good stretch and 1 for a bad one."""

    progress: Scalar = 1.0  # of the route that could be covered in the time, the share that was not
    length: Scalar = 1.0  # metres driven beyond the progress, over what could be driven
    clearance: Scalar = 1.0  # mean shortfall from `COMFORT`, over it
    turning: Scalar = 1.0  # mean |yaw rate| over its limit
    finish: Scalar = 1.0  # way left at the end over way left at the start


class OnTheWay(NamedTuple):
    """A state of an episode from which a stretch may start."""

    state: EpisodeState
    memory: Memory


def recorded(tasks: Task, options: Options, every: int, count: int) -> OnTheWay:
    """B hard episodes as they stand before the first step and after each `every` more: [B, P = count, ...].

    An episode that has ended stays as it ended; its outcome tells. tasks: a leading axis B on everything.
    """
    lanes = Lanes(jax.vmap(start_episode)(tasks.scenario, tasks.plan),
                  jax.vmap(first_memory)(tasks.scenario, tasks.plan), tasks)  # fmt: skip

    def body_fun(lanes: Lanes, _: None) -> tuple[Lanes, OnTheWay]:
        return advanced(lanes, options, every), OnTheWay(lanes.state, lanes.memory)

    _, rows = lax.scan(body_fun, lanes, None, length=count)
    return jax.tree.map(lambda leaf: jnp.swapaxes(leaf, 0, 1), rows)


def stretch_loss(start: OnTheWay, scenario: Scenario, plan: Plan, constants: Constants, softness: Softness,
                 weights: Loss, options: Options, stretch: Stretch) -> tuple[jax.Array, Loss]:
    """Weighted sum of the loss's parts over T relaxed steps, [] float32, and the parts.

    Differentiable in `constants` (score weights and behaviour), through the closed loop over `truncate` steps. Both are
    0 where the episode has ended before. Unbatched. No NaN, in the gradient neither.
    """
    start, scenario, plan = jax.tree.map(jnp.asarray, (start, scenario, plan))
    state, memory = lax.stop_gradient(start)

    def body_fun(state: EpisodeState, count: jax.Array) -> tuple[EpisodeState, tuple]:
        state = state._replace(robot=_cut(state.robot, count % stretch.truncate == 0))
        moved = _relaxed_step(state, memory, scenario, plan, constants, softness, options, stretch.variant)
        arrived = _distance_to(scenario.goal, state.robot) <= scenario.goal_tolerance
        moved = jax.tree.map(lambda new, old: jnp.where(arrived, old, new), moved, state)
        still = jnp.where(arrived, 0.0, 1.0)
        near = _soft_shortfall(_true_clearance(moved, memory, scenario, plan, constants), softness.margin)
        return moved, (still * near, still * moved.robot.v, still * moved.robot.yaw_rate)

    end, (near, v, yaw_rate) = lax.scan(body_fun, state, jnp.arange(stretch.steps))
    parts = _parts(_way_left(state, memory), _way_left(end, memory), near, v, yaw_rate, constants)
    runs = jnp.where(start.state.outcome == RUNNING, 1.0, 0.0)
    parts = Loss(*(runs * part for part in parts))
    return jnp.sum(jnp.stack([weight * part for weight, part in zip(weights, parts, strict=True)])), parts


def _relaxed_step(state: EpisodeState, memory: Memory, scenario: Scenario, plan: Plan, constants: Constants,
                  softness: Softness, options: Options, variant: Variant) -> EpisodeState:
    """As `simulate.control_step`, without its judgement."""
    dt, robot = constants.behaviour.dt, state.robot
    sensed = lax.stop_gradient(sensed_now(state, scenario, constants, options))
    field = field_of(memory, plan)
    target, guidance, _ = guide(state, memory, scenario, plan, field, sensed, constants, options)
    decision = relaxed_decide(robot, guidance, field, sensed, constants, softness, options, variant)
    moved = euler_step(Pose(robot.x, robot.y, robot.heading), decision.v, decision.yaw_rate, dt)
    return state._replace(
        robot=RobotState(moved.x, moved.y, wrap(moved.heading), decision.v, decision.yaw_rate),
        step=state.step + 1,
        target=target,
        known=sensed.square_known,
    )


def _parts(before: jax.Array, after: jax.Array, near: jax.Array, v: jax.Array, yaw_rate: jax.Array,
           constants: Constants) -> Loss:
    """before, after: [] way left [m]; near, v, yaw_rate: [T]."""
    dt, limits = constants.behaviour.dt, constants.robot
    reach = limits.v_max * dt * v.shape[0]
    driven = jnp.sum(jnp.abs(v)) * dt
    return Loss(
        progress=(after - jnp.maximum(before - reach, 0.0)) / reach,
        length=(driven - (before - after)) / reach,
        clearance=jnp.mean(near) / COMFORT,
        turning=jnp.mean(jnp.abs(yaw_rate)) / limits.yaw_rate_max,
        finish=after / jnp.maximum(before, reach),
    )


def _way_left(state: EpisodeState, memory: Memory) -> jax.Array:
    """[] along the route to its end, and from the robot to the route [m]."""
    foot = foot_on(ahead_of(memory.route, state.target), state.robot.x, state.robot.y)
    end = memory.route.along[jnp.maximum(memory.route.count - 1, 0)]
    return end - foot.along + _root(foot.apart)


def _true_clearance(state: EpisodeState, memory: Memory, scenario: Scenario, plan: Plan,
                    constants: Constants) -> jax.Array:
    """[] from the robot's outline to what is there, sensed or not, but for hidden cells [m]."""
    now = movers_at(scenario.movers, state.step.astype(jnp.float32) * constants.behaviour.dt)
    squares = scenario.squares
    everything = Sensed(squares.centre, squares.half_width, squares.valid, now.position, now.velocity,
                        scenario.movers.radius, now.present, squares.rounding)  # fmt: skip
    field: DistanceField = field_of(memory, plan)
    robot = state.robot
    x, y, cosine, sine = (value.reshape(1, 1) for value in (robot.x, robot.y, jnp.cos(robot.heading),
                                                           jnp.sin(robot.heading)))  # fmt: skip
    statics = static_clearance(field, everything, constants.robot, x, y, cosine, sine)
    movers = mover_clearance(everything, constants.robot, x, y, cosine, sine, jnp.float32(0.0))
    return jnp.minimum(statics, movers)[0, 0]


def _soft_shortfall(clearance: jax.Array, softness: Scalar) -> jax.Array:
    """A smooth max(COMFORT − clearance, 0) [m]."""
    return softness * jax.nn.softplus((COMFORT - clearance) / softness)


def _distance_to(goal: jax.Array, robot: RobotState) -> jax.Array:
    dx, dy = goal[0] - robot.x, goal[1] - robot.y
    return _root(dx * dx + dy * dy)


def _cut(robot: Any, here: jax.Array) -> Any:
    """The same robot, without a past where `here`."""
    return jax.tree.map(lambda leaf: jnp.where(here, lax.stop_gradient(leaf), leaf), robot)


def _root(squared: jax.Array) -> jax.Array:
    positive = squared > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, squared, 1.0)), 0.0)
