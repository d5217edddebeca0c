"""One decision of the Dynamic Window Approach, relaxed so that it has gradients.

The choice becomes a softmax over the candidates, the border of what is admissible a sigmoid, the cap of the clearance
a smooth minimum. As both softnesses go to 0 the command goes to that of `dwa.decide`, but for ties.
Dimension letters: V speeds, N yaw rates.
"""

from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from adwa_jax.constants import Constants, Options
from adwa_jax.dwa import Guidance, Judged, chosen, judged_candidates, last_resort, scales_of, terms_of
from adwa_jax.grid import DistanceField, Scalar
from adwa_jax.obstacles import Sensed
from adwa_jax.rollout import RobotState
from adwa_jax.score import Normalisation, ScoreWeights, Terms, normalise, weighted_sum

Variant = Literal["smooth", "straight_through"]
LEAST_TOTAL = 1e-4  # a term whose sum is nearer to 0 says nothing
BARRIER = 0.1  # of the score, for each unit of log admissibility: scores of the candidates lie about so far apart


class Softness(NamedTuple):
    """How soft a decision is, [] float32 each, above 0. Traced."""

    temperature: Scalar = 0.03  # of the softmax, in units of the score (a term's mean, or its scale; Σ weights = 1)
    margin: Scalar = 0.02  # over which a candidate turns admissible, and clearance reaches its cap [m]


class RelaxedDecision(NamedTuple):
    """The command and the candidates' shares in it."""

    v: jax.Array  # [] float32 [m/s]
    yaw_rate: jax.Array  # [] float32 [rad/s]
    share: jax.Array  # [V, N] float32, sums to 1
    moves: jax.Array  # [] float32 in (0, 1): how far any candidate is admissible; the rest is `dwa.last_resort`


def relaxed_decide(state: RobotState, guidance: Guidance, field: DistanceField, sensed: Sensed, constants: Constants,
                   softness: Softness, options: Options, variant: Variant) -> RelaxedDecision:
    """The mean command under shares = softmax((score + BARRIER · log sigmoid(margin / softness.margin)) / temperature).

    `smooth` commands that mean; `straight_through` commands what `decide` does and has the gradient of the mean.
    `sensed` must not be counted (`Sensed.square_count`): loops of unknown length have no gradient. Unbatched. No NaN
    for finite input, in the gradient neither.
    """
    judged = judged_candidates(state, field, sensed, constants, options)
    log_admissible = jax.nn.log_sigmoid(judged.margin / softness.margin)
    score = _score(state, judged, guidance, log_admissible, constants, softness, options)
    share = jax.nn.softmax((score + BARRIER * log_admissible) / softness.temperature, axis=(0, 1))
    moves = jnp.exp(jnp.max(log_admissible))
    otherwise = last_resort(state, judged, guidance, constants, options)
    v = moves * jnp.sum(share * judged.v[:, None]) + (1.0 - moves) * otherwise[0]
    yaw_rate = moves * jnp.sum(share * judged.yaw_rate[None, :]) + (1.0 - moves) * otherwise[1]
    if variant == "straight_through":
        hard = lax.stop_gradient(chosen(state, judged, guidance, constants, options))
        v, yaw_rate = hard.v + (v - lax.stop_gradient(v)), hard.yaw_rate + (yaw_rate - lax.stop_gradient(yaw_rate))
    return RelaxedDecision(v, yaw_rate, share, moves)


def soft_minimum(a: jax.Array, b: Scalar, softness: Scalar) -> jax.Array:
    """A smooth lower bound of min(a, b), `softness` · ln 2 below it where they are equal."""
    return -softness * jnp.logaddexp(-a / softness, -b / softness)


def _score(state: RobotState, judged: Judged, guidance: Guidance, log_admissible: jax.Array, constants: Constants,
           softness: Softness, options: Options) -> jax.Array:
    """[V, N]: eq. 9 in units in which the weights sum to 1 and so does, for sums, a term's mean: temperatures then
    mean the same whatever the weights' size and the number of candidates.
    """
    terms = terms_of(state, judged, guidance, constants, options)
    clearance = judged.clearance if judged.prediction is None else jnp.maximum(judged.clearance, 0.0)
    capped = soft_minimum(clearance, constants.behaviour.clearance_cap, softness.margin)
    terms = terms._replace(clearance=capped)
    terms = _normalised(terms, judged, log_admissible, scales_of(constants, options), options.dwa.normalisation)
    return weighted_sum(terms, constants.weights) / jnp.maximum(_total(constants.weights, terms), 1e-6)


def _normalised(terms: Terms, judged: Judged, log_admissible: jax.Array, scales: Terms,
                normalisation: Normalisation) -> Terms:
    """As `score.normalise`; a sum counts a candidate as far as it is admissible, and is a mean."""
    if normalisation != "sum":
        return normalise(terms, judged.admissible, scales, normalisation)
    # Relative to the candidate that is most so: the total keeps away from 0 where none is.
    counts = jnp.exp(log_admissible - jnp.max(log_admissible))

    def over_mean(term: jax.Array) -> jax.Array:
        total = jnp.sum(counts * term)
        says = jnp.abs(total) > LEAST_TOTAL
        return jnp.where(says, term * (jnp.sum(counts) / jnp.where(says, total, 1.0)), 0.0)

    used = {name: over_mean(term) for name, term in terms._asdict().items() if term is not None}
    return Terms(**used)


def _total(weights: ScoreWeights, terms: Terms) -> jax.Array:
    """[] sum of the weights in use."""
    used = [getattr(weights, name) for name in Terms._fields if getattr(terms, name) is not None]
    return jnp.sum(jnp.stack([jnp.asarray(weight, jnp.float32) for weight in used]))
