"""One decision of the (improved) Dynamic Window Approach (§3).

Dimension letters: V speeds, N yaw rates, K predicted points.
"""

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from adwa_jax.checks import require_choice, require_whole
from adwa_jax.grid import DistanceField, Scalar, clearance_at
from adwa_jax.obstacles import NOWHERE, Sensed, clearance_to_movers, clearance_to_squares
from adwa_jax.rollout import Arcs, Pose, arcs
from adwa_jax.score import (
    Normalisation,
    ScoreWeights,
    Terms,
    clearance_term,
    heading_term,
    normalise,
    turn_towards,
    velocity_term,
    weighted_sum,
)
from adwa_jax.window import RobotLimits, velocity_window


@jax.tree_util.register_static
@dataclass(frozen=True)
class DwaOptions:
    """Static choices of a decision: how many candidates, how far ahead, how terms are made comparable."""

    v_samples: int = 11  # V
    yaw_rate_samples: int = 21  # N
    horizon_steps: int = 20  # K
    normalisation: Normalisation = "sum"

    def __post_init__(self) -> None:
        """Refuse windows without both their ends and empty horizons."""
        for name, least in (("v_samples", 2), ("yaw_rate_samples", 2), ("horizon_steps", 1)):
            require_whole(name, getattr(self, name), least)
        require_choice("normalisation", self.normalisation, ("sum", "minmax", "none"))


class RobotState(NamedTuple):
    """Pose and present velocities, [] float32 each."""

    x: jax.Array  # [m]
    y: jax.Array  # [m]
    heading: jax.Array  # [rad]
    v: jax.Array  # [m/s]
    yaw_rate: jax.Array  # [rad/s]


class Candidates(NamedTuple):
    """Why a decision fell as it did: every candidate's data. Candidate (i, j) has index i·N + j."""

    v: jax.Array  # [V] float32 [m/s]
    yaw_rate: jax.Array  # [N] float32 [rad/s]
    clearance: jax.Array  # [V, N] float32 [m], least over the predicted points
    admissible: jax.Array  # [V, N] bool
    terms: Terms  # raw terms, before normalisation
    score: jax.Array  # [V, N] float32; of no meaning where not admissible


class Decision(NamedTuple):
    """The command and where it came from."""

    v: jax.Array  # [] float32 [m/s]
    yaw_rate: jax.Array  # [] float32 [rad/s]
    index: jax.Array  # [] int32, the chosen candidate; -1: none was admissible, the robot brakes
    candidates: Candidates


def decide(state: RobotState, local_target: jax.Array, goal: jax.Array, field: DistanceField, sensed: Sensed,
           weights: ScoreWeights, robot: RobotLimits, clearance_cap: Scalar, dt: Scalar,
           options: DwaOptions) -> Decision:
    """The admissible candidate of largest score (eq. 9); ties go to the lower index.

    Traditional DWA (eq. 8) is the goal as `local_target` and `global_heading` 0. Without an admissible candidate the
    robot brakes within its window and turns towards the local target.

    Unbatched. local_target, goal: [2] [m]; clearance_cap [m], dt [s]: []. No NaN for finite input.
    """
    v, yaw_rate = velocity_window(state.v, state.yaw_rate, robot, dt, options.v_samples, options.yaw_rate_samples)
    arc = arcs(state.heading, yaw_rate, dt, options.horizon_steps)
    clearance = candidate_clearance(state, v, arc, field, sensed, dt) - robot.radius
    admissible = is_admissible(clearance, v, yaw_rate, robot)
    terms = _terms(state, v, arc, clearance, local_target, goal, clearance_cap)
    scales = Terms(*map(jnp.float32, (jnp.pi, clearance_cap, robot.v_max, jnp.pi)))
    score = weighted_sum(normalise(terms, admissible, scales, options.normalisation), weights)
    candidates = Candidates(v, yaw_rate, clearance, admissible, terms, score)
    best = jnp.argmax(jnp.where(admissible, score, -jnp.inf)).astype(jnp.int32)
    brake_v, brake_yaw_rate = brake_and_turn(state, v, yaw_rate, local_target, dt)
    moves = jnp.any(admissible)
    return Decision(
        v=jnp.where(moves, v[best // options.yaw_rate_samples], brake_v),
        yaw_rate=jnp.where(moves, yaw_rate[best % options.yaw_rate_samples], brake_yaw_rate),
        index=jnp.where(moves, best, -1),
        candidates=candidates,
    )


def candidate_clearance(state: RobotState, v: jax.Array, arc: Arcs, field: DistanceField, sensed: Sensed,
                        dt: Scalar) -> jax.Array:
    """[V, N]: least distance [m] of each candidate's K points to known squares, sensed squares and predicted movers.

    Measured from the robot's centre. Points are taken one step at a time: a scan that carries the minima moves fewer
    bytes than one [K, V, N] expression.
    """

    def body_fun(least: jax.Array, point: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, None]:
        reach_x, reach_y, count = point
        x = state.x + v[:, None] * reach_x[None, :]
        y = state.y + v[:, None] * reach_y[None, :]
        static = jnp.minimum(clearance_at(field, x, y), clearance_to_squares(sensed, x, y))
        moving = clearance_to_movers(sensed, x, y, count * dt)
        return jnp.minimum(least, jnp.minimum(static, moving)), None

    count = jnp.arange(1, arc.reach_x.shape[0] + 1, dtype=jnp.float32)
    start = jnp.full((v.shape[0], arc.reach_x.shape[1]), NOWHERE, jnp.float32)
    least, _ = lax.scan(body_fun, start, (arc.reach_x, arc.reach_y, count))
    return least


def is_admissible(clearance: jax.Array, v: jax.Array, yaw_rate: jax.Array, robot: RobotLimits) -> jax.Array:
    """[V, N] bool: clearance > 0, |v| ≤ √(2·clearance·brake) and |yaw rate| ≤ √(2·clearance·yaw_brake).

    The robot can stop within the room it has; in reverse too.
    """
    room = 2.0 * jnp.maximum(clearance, 0.0)
    stops = (v * v)[:, None] <= room * robot.brake
    stops &= (yaw_rate * yaw_rate)[None, :] <= room * robot.yaw_brake
    return (clearance > 0) & stops


def brake_and_turn(state: RobotState, v: jax.Array, yaw_rate: jax.Array, local_target: jax.Array,
                   dt: Scalar) -> tuple[jax.Array, jax.Array]:
    """The speed nearest 0 and the yaw rate nearest to facing the target after one step, both within the window."""
    turn = turn_towards(state.x, state.y, state.heading, local_target) / dt
    return jnp.clip(0.0, v[0], v[-1]), jnp.clip(turn, yaw_rate[0], yaw_rate[-1])


def wrap(angle: jax.Array) -> jax.Array:
    """The same angle in [−π, π) [rad]."""
    return angle - 2.0 * jnp.pi * jnp.floor(angle / (2.0 * jnp.pi) + 0.5)


def _terms(state: RobotState, v: jax.Array, arc: Arcs, clearance: jax.Array, local_target: jax.Array,
           goal: jax.Array, clearance_cap: Scalar) -> Terms:
    end = Pose(
        x=state.x + v[:, None] * arc.reach_x[-1][None, :],
        y=state.y + v[:, None] * arc.reach_y[-1][None, :],
        heading=jnp.broadcast_to(arc.heading[-1][None, :], clearance.shape),
    )
    return Terms(
        local_heading=heading_term(end.x, end.y, end.heading, local_target),
        clearance=clearance_term(clearance, clearance_cap),
        velocity=velocity_term(v, clearance.shape),
        global_heading=heading_term(end.x, end.y, end.heading, goal),
    )
