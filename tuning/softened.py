"""One decision of the paper's planner, hard and relaxed: what softness does to it.

Dimension letters: L temperatures; X values of a weight; V, N candidates.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.constants import Constants, Options
from adwa_jax.dwa import Decision, Guidance, decide
from adwa_jax.grid import Scalar
from adwa_jax.presets import Preset
from adwa_jax.relaxed import RelaxedDecision, Softness, relaxed_decide
from tuning.replay import Replay
from tuning.stages import Situation, sensed_at, situation_at

MARGIN = Softness().margin  # [m] the gradient method's


class Softened(NamedTuple):
    """The same decision at L temperatures, and for X values of one weight."""

    temperatures: np.ndarray  # [L]
    v: np.ndarray  # [V] the window's speeds [m/s]
    yaw_rate: np.ndarray  # [N] [rad/s]
    share: np.ndarray  # [L, V, N] of each candidate in the command, with the weights as they are
    weight: str  # whose values
    values: np.ndarray  # [X]
    own: float  # its value in the planner
    hard: np.ndarray  # [X, 2] command (speed, yaw rate) [m/s, rad/s] of the hard planner
    soft: np.ndarray  # [L, X, 2] of the relaxed planner


def softened(driven: Replay, config: Preset, step: int, weight: str, values: np.ndarray,
             temperatures: Sequence[float], margin: Scalar = MARGIN) -> Softened:
    """Control step `step` of a drive by the paper's planner. Raises as `stages.situation_at`.

    weight: of eq. 9; margin: `Softness.margin` [m] at every temperature. Hard in the limit of both.
    """
    here = situation_at(driven, config, step)
    constants = jax.tree.map(np.float32, config.constants)
    own = float(getattr(constants.weights, weight))
    margins = jnp.full(len(temperatures), margin, jnp.float32)
    softness = Softness(jnp.asarray(temperatures, jnp.float32), margins)
    tried = np.append(own, values).astype(np.float32)  # the share is that of the first
    hard, soft = jax.device_get(_decisions(here, constants, tried, softness, config.options, weight))
    candidates = hard.candidates
    return Softened(
        np.asarray(temperatures), candidates.v[0], candidates.yaw_rate[0], soft.share[:, 0], weight, values, own,
        np.stack([hard.v, hard.yaw_rate], axis=-1)[1:], np.stack([soft.v, soft.yaw_rate], axis=-1)[:, 1:],
    )  # fmt: skip


@partial(jax.jit, static_argnames=("options", "weight"))
def _decisions(here: Situation, constants: Constants, values: jax.Array, softness: Softness, options: Options,
               weight: str) -> tuple[Decision, RelaxedDecision]:
    """Hard [X] and relaxed [L, X] decisions. values: [X]; softness: [L] each."""
    sensed = sensed_at(here, constants)
    guidance = Guidance(jnp.asarray(here.target), jnp.asarray(here.scenario.goal))

    def with_value(value: jax.Array) -> Constants:
        return replace(constants, weights=replace(constants.weights, **{weight: value}))

    def hard(value: jax.Array) -> Decision:
        return decide(here.robot, guidance, here.field, sensed, with_value(value), options)

    def soft(softness: Softness, value: jax.Array) -> RelaxedDecision:
        return relaxed_decide(here.robot, guidance, here.field, sensed, with_value(value), softness, options, "smooth")

    return jax.vmap(hard)(values), jax.vmap(lambda one: jax.vmap(partial(soft, one))(values))(softness)
