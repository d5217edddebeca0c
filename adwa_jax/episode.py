"""An episode in progress, and what comes of it."""

from enum import IntEnum
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.constants import Constants, Options
from adwa_jax.grid import Scalar
from adwa_jax.metrics import Measures, Running
from adwa_jax.obstacles import Sensed, movers_at, sense
from adwa_jax.rollout import RobotState
from adwa_jax.scenario import Scenario


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


def position_of(state: EpisodeState) -> jax.Array:
    """[2] (x, y) [m]."""
    return jnp.stack([state.robot.x, state.robot.y])


def sensed_now(state: EpisodeState, scenario: Scenario, constants: Constants, options: Options) -> Sensed:
    """What the robot senses where it is now."""
    time = state.step.astype(jnp.float32) * constants.behaviour.dt
    sensed = sense(scenario.squares, state.known, scenario.movers, movers_at(scenario.movers, time), position_of(state),
                   constants.behaviour.sensor_range)
    if not options.rules.border:
        return sensed
    grid = scenario.grid
    size = jnp.stack([grid.width, grid.height]).astype(jnp.float32) * grid.resolution
    return sensed._replace(border=jnp.stack([grid.origin, grid.origin + size]))


def steps_in(duration: Scalar, constants: Constants) -> jax.Array:
    """[] int32: control steps in a duration [s]."""
    return jnp.round(duration / constants.behaviour.dt).astype(jnp.int32)
