"""The terms of the evaluation function and their weighted sum (eqs. 8 and 9). Larger is better.

Dimension letters: V speeds, N yaw rates.
"""

from dataclasses import dataclass
from functools import partial
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp

from adwa_jax.checks import require_numbers
from adwa_jax.grid import Scalar
from adwa_jax.native import largest, total
from adwa_jax.rollout import RobotState, wrap

Normalisation = Literal["sum", "minmax", "none"]
# arctan(r) = r · Σ ARCTAN[i] · r²ⁱ for r in [0, 1], within 1.5e-7: interpolated at Chebyshev's points of r².
ARCTAN = (0.999999881, -0.333318114, 0.199669614, -0.140032902, 0.0986886546, -0.0588297546, 0.0237805191,
          -0.00455979211)  # fmt: skip


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["local_heading", "clearance", "velocity", "global_heading", "progress", "on_route", "contact_time",
                 "mover_clearance", "forward"],
    meta_fields=[],
)
@dataclass(frozen=True)
class ScoreWeights:
    """α, β, γ, δ of eq. 9; with `global_heading` 0 and the goal as local target, eq. 8. Traced, ≥ 0."""

    local_heading: Scalar  # α
    clearance: Scalar  # β
    velocity: Scalar  # γ
    global_heading: Scalar  # δ
    # Of the rules beyond the paper.
    progress: Scalar = 0.0
    on_route: Scalar = 0.0
    contact_time: Scalar = 0.0
    mover_clearance: Scalar = 0.0
    forward: Scalar = 0.0

    def __post_init__(self) -> None:
        """Refuse negative and non-finite weights; traced values pass unseen."""
        require_numbers(self, least=0.0)


class Terms(NamedTuple):
    """One value a candidate and term, ≥ 0 but for the velocity of a robot in reverse; None: a term not in use."""

    local_heading: jax.Array  # [V, N]
    clearance: jax.Array  # [V, N]
    velocity: jax.Array | None = None  # [V, N]
    global_heading: jax.Array | None = None  # [V, N]
    progress: jax.Array | None = None  # [V, N]
    on_route: jax.Array | None = None  # [V, N]
    contact_time: jax.Array | None = None  # [V, N]
    mover_clearance: jax.Array | None = None  # [V, N]
    forward: jax.Array | None = None  # [V, N]


def heading_term(x: jax.Array, y: jax.Array, heading: jax.Array, target: jax.Array) -> jax.Array:
    """π − |angle between the end heading and the bearing end → target|, in [0, π] (LHeading and GHeading of eq. 9).

    On the target itself the term is π. Shapes fit, the heading's may have a 1 for each that shares it; target: [2] [m].
    """
    dx, dy = target[0] - x, target[1] - y
    cosine, sine = jnp.cos(heading), jnp.sin(heading)
    arrived = dx * dx + dy * dy < 1e-12
    ahead, aside = cosine * dx + sine * dy, cosine * dy - sine * dx
    return jnp.pi - _angle(jnp.where(arrived, 1.0, ahead), jnp.where(arrived, 0.0, aside))


@jax.custom_jvp
def _angle(ahead: jax.Array, aside: jax.Array) -> jax.Array:
    """|arctan2(aside, ahead)| in [0, π], within 4e-7 rad: a tenth of arctan2's cost. Not both 0."""
    across, along = jnp.abs(aside), jnp.abs(ahead)
    steep = across > along
    ratio = jnp.where(steep, along, across) / jnp.where(steep, across, along)
    squared, series = ratio * ratio, jnp.float32(ARCTAN[-1])
    for coefficient in ARCTAN[-2::-1]:
        series = series * squared + coefficient
    acute = jnp.where(steep, 0.5 * jnp.pi - series * ratio, series * ratio)
    return jnp.where(ahead < 0, jnp.pi - acute, acute)


@_angle.defjvp
def _angle_jvp(primals: tuple, tangents: tuple) -> tuple[jax.Array, jax.Array]:
    """The slope of arctan2 itself, more exact than that of the series."""
    (ahead, aside), (ahead_dot, aside_dot) = primals, tangents
    slope = (ahead * aside_dot - aside * ahead_dot) / (ahead * ahead + aside * aside)
    return _angle(ahead, aside), jnp.sign(aside) * slope


def mean_heading_term(state: RobotState, headings: jax.Array, target: jax.Array, shape: tuple[int, ...]) -> jax.Array:
    """π − |angle between a predicted heading and the bearing robot → target|, on average over the prediction.

    The bearing is taken from where the robot is, as the target is near: from the end of a candidate that passes it, it
    would lie behind. The average is taken, as a robot judged by its last heading alone puts off turning.

    headings: [K, N] [rad]; target: [2] [m]; shape (V, N).
    """
    bearing = state.heading + turn_towards(state.x, state.y, state.heading, target)
    off = jnp.abs(wrap(headings - bearing))
    return jnp.broadcast_to(jnp.pi - (sum(off[1:], off[0]) / headings.shape[0])[None, :], shape)


def turn_towards(x: jax.Array, y: jax.Array, heading: jax.Array, target: jax.Array) -> jax.Array:
    """Angle in [−π, π] from the heading to the bearing of the target [rad], anticlockwise positive.

    On the target (within 1 µm) the bearing has no meaning and the angle is 0. Any equal shapes; target: [2] [m].
    """
    dx, dy = target[0] - x, target[1] - y
    ahead = jnp.cos(heading) * dx + jnp.sin(heading) * dy
    aside = jnp.cos(heading) * dy - jnp.sin(heading) * dx
    arrived = dx * dx + dy * dy < 1e-12
    return jnp.arctan2(jnp.where(arrived, 0.0, aside), jnp.where(arrived, 1.0, ahead))


def clearance_term(clearance: jax.Array, cap: Scalar) -> jax.Array:
    """Dist of eq. 9: the candidate's clearance [m] up to `cap`, beyond which more room is no better."""
    return jnp.minimum(clearance, cap)


def velocity_term(v: jax.Array, shape: tuple[int, ...]) -> jax.Array:
    """Vel of eq. 9: the candidate's speed [m/s], negative in reverse. v: [V]; shape (V, N)."""
    return jnp.broadcast_to(v[:, None], shape)


def progress_term(along: jax.Array, now: jax.Array, farthest: Scalar) -> jax.Array:
    """How much farther along the route the candidate ends than the robot is [m], plus `farthest`, which no candidate
    exceeds in either direction: in [0, 2 · farthest].
    """
    return jnp.clip(along - now + farthest, 0.0, 2.0 * farthest)


def on_route_term(squared: jax.Array, now: jax.Array, farthest: Scalar) -> jax.Array:
    """How much nearer to the route the candidate ends than the robot is [m], plus `farthest`: in [0, 2 · farthest].

    squared, now: distance² of the ends and of the robot [m²].
    """
    return jnp.clip(_root(now) - _root(squared) + farthest, 0.0, 2.0 * farthest)


def mover_clearance_term(clearance: jax.Array, cap: Scalar) -> jax.Array:
    """The candidate's least clearance to predicted movers [m], in [0, `cap`]."""
    return jnp.clip(clearance, 0.0, cap)


def forward_term(v: jax.Array, shape: tuple[int, ...]) -> jax.Array:
    """1 for candidates that go forward or stand, 0 for those in reverse. v: [V]; shape (V, N)."""
    return jnp.broadcast_to((v >= 0).astype(jnp.float32)[:, None], shape)


def normalise(terms: Terms, admissible: jax.Array, scales: Terms, normalisation: Normalisation) -> Terms:
    """Each term over its sum over the admissible candidates (`sum`), its range there (`minmax`) or a fixed scale.

    A term whose sum or range is 0 says nothing and becomes 0. admissible: [V, N] bool; scales: [] each, for `none`.
    """
    def normalised(name: str) -> jax.Array:
        if normalisation == "none":
            return getattr(terms, name) / getattr(scales, name)
        return (_over_range if normalisation == "minmax" else _over_sum)(getattr(terms, name), admissible)

    return Terms(**{name: normalised(name) for name in Terms._fields if getattr(terms, name) is not None})


def weighted_sum(terms: Terms, weights: ScoreWeights) -> jax.Array:
    """G = α·LHeading + β·Dist + γ·Vel + δ·GHeading (eq. 9) and so on for the terms in use, [V, N]."""
    total = weights.local_heading * terms.local_heading
    for name in Terms._fields[1:]:
        term = getattr(terms, name)
        if term is not None:
            total = total + getattr(weights, name) * term
    return total


def _over_sum(term: jax.Array, admissible: jax.Array) -> jax.Array:
    over_all = total(jnp.where(admissible, term, 0.0))
    return jnp.where(over_all != 0, term / jnp.where(over_all != 0, over_all, 1.0), 0.0)


def _over_range(term: jax.Array, admissible: jax.Array) -> jax.Array:
    least = -largest(jnp.where(admissible, -term, -jnp.inf))
    span = largest(jnp.where(admissible, term, -jnp.inf)) - least
    distinct = jnp.isfinite(span) & (span > 1e-12)
    return jnp.where(distinct, (term - jnp.where(distinct, least, 0.0)) / jnp.where(distinct, span, 1.0), 0.0)


def _root(squared: jax.Array) -> jax.Array:
    positive = squared > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, squared, 1.0)), 0.0)
