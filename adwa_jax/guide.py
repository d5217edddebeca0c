"""Where to go next: the local target, what of the route lies ahead, and whether there is something to learn (§4 B)."""

import jax
import jax.numpy as jnp
from jax import lax

from adwa_jax.constants import Constants, Options
from adwa_jax.dwa import Guidance
from adwa_jax.episode import EpisodeState, position_of, sensed_now, steps_in
from adwa_jax.grid import DistanceField, Scalar
from adwa_jax.learn import Memory, in_range
from adwa_jax.obstacles import Sensed
from adwa_jax.plan import Plan
from adwa_jax.prediction import static_clearance
from adwa_jax.route import ahead_of, carrot, foot_on
from adwa_jax.scenario import Scenario


def guide(state: EpisodeState, memory: Memory, scenario: Scenario, plan: Plan, field: DistanceField, sensed: Sensed,
          constants: Constants, options: Options) -> tuple[jax.Array, Guidance, jax.Array]:
    """The route point headed for, the local target with what is ahead, and whether any of the route is in sight."""
    behaviour, rules, robot = constants.behaviour, options.rules, state.robot
    position = position_of(state)
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


def next_target(target: jax.Array, position: jax.Array, points: jax.Array, count: jax.Array,
                tolerance: Scalar) -> jax.Array:
    """[] int32: the next point not yet within `tolerance`; the last stays (§4 B). points: [P, 2], `count` in use."""

    def cond_fun(index: jax.Array) -> jax.Array:
        offset = points[index] - position
        return (index < count - 1) & (offset[0] * offset[0] + offset[1] * offset[1] <= tolerance * tolerance)

    return lax.while_loop(cond_fun, lambda index: index + 1, target)


def local_target(index: jax.Array, scenario: Scenario, plan: Plan) -> jax.Array:
    """[2] (x, y) [m]: the key point, or the goal itself in place of the last."""
    return jnp.where(index >= plan.key_point_count - 1, scenario.goal, plan.key_points[index])


def notices(state: EpisodeState, memory: Memory, scenario: Scenario, constants: Constants,
            options: Options) -> jax.Array:
    """[] bool: whether there is something to learn (`learn`) before the next step."""
    behaviour = constants.behaviour
    news = jnp.bool_(False)
    if scenario.hidden.size:
        news |= jnp.any(in_range(scenario, position_of(state), behaviour.sensor_range) & ~memory.seen)
    if options.rules.replan:
        news |= jnp.any(sensed_now(state, scenario, constants, options).square_known & ~state.known)
        news |= is_lost(state, constants)
    return news


def is_lost(state: EpisodeState, constants: Constants) -> jax.Array:
    """[] bool: nothing of the route was in sight for `lost_time`, or the robot stays on the spot: every third of
    `stuck_time`.
    """
    behaviour = constants.behaviour
    still = state.step - state.anchor_step
    stays = (still > 0) & (still % jnp.maximum(steps_in(behaviour.stuck_time, constants) // 3, 1) == 0)
    return stays | (state.lost >= steps_in(behaviour.lost_time, constants))
