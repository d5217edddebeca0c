"""The route ahead: where on the key-point polyline the robot is, how far along, and the carrot it follows.

Dimension letters: P route points; L segments looked at; C places for the carrot; I points of a line of sight.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from adwa_jax.grid import Scalar

SEGMENTS = 6  # L: segments from the present one on that are looked at
PLACES = 6  # C: places along the lookahead at which the carrot may be
SIGHT_POINTS = 16  # I: points at which a line of sight must be clear


class Route(NamedTuple):
    """A polyline from the robot to the goal."""

    points: jax.Array  # [P, 2] float32 [m]; beyond the count the last repeats
    count: jax.Array  # [] int32
    along: jax.Array  # [P] float32, distance along the route from its start [m]


class Ahead(NamedTuple):
    """The segments of the route that count at present; those beyond its end are points."""

    begin: jax.Array  # [L, 2] float32 [m]
    span: jax.Array  # [L, 2] float32, end − begin [m]
    along: jax.Array  # [L] float32, of the beginnings [m]
    length: jax.Array  # [L] float32 [m]


class Foot(NamedTuple):
    """Nearest point of the route; any equal shapes."""

    along: jax.Array  # [m]
    apart: jax.Array  # distance to it, squared [m²]
    segment: jax.Array  # int32, which of the L


def route_through(points: jax.Array, count: jax.Array) -> Route:
    """The polyline through points [P, 2], the first `count` of them."""
    steps = points[1:] - points[:-1]
    used = jnp.arange(1, points.shape[0]) < count
    lengths = jnp.where(used, _norm(steps[:, 0], steps[:, 1]), 0.0)
    return Route(points, count, jnp.concatenate([jnp.zeros(1, jnp.float32), jnp.cumsum(lengths)]))


def ahead_of(route: Route, target: jax.Array) -> Ahead:
    """The L segments from the one that ends at point `target` on."""
    index = jnp.minimum(jnp.maximum(target - 1, 0) + jnp.arange(SEGMENTS + 1), jnp.maximum(route.count - 1, 0))
    points, along = route.points[index], route.along[index]
    return Ahead(points[:-1], points[1:] - points[:-1], along[:-1], along[1:] - along[:-1])


def foot_on(ahead: Ahead, x: jax.Array, y: jax.Array) -> Foot:
    """The point of the route nearest to (x, y) [m]; among equals the earlier. x, y: any equal shapes."""
    best = Foot(jnp.zeros_like(x), jnp.full_like(x, jnp.inf), jnp.zeros(x.shape, jnp.int32))
    for segment in range(SEGMENTS):
        span, length = ahead.span[segment], ahead.length[segment]
        squared = jnp.maximum(length * length, 1e-12)
        dx, dy = x - ahead.begin[segment, 0], y - ahead.begin[segment, 1]
        share = jnp.clip((dx * span[0] + dy * span[1]) / squared, 0.0, 1.0)
        dx, dy = dx - share * span[0], dy - share * span[1]
        apart = dx * dx + dy * dy
        nearer = apart < best.apart
        best = Foot(
            along=jnp.where(nearer, ahead.along[segment] + share * length, best.along),
            apart=jnp.where(nearer, apart, best.apart),
            segment=jnp.where(nearer, jnp.int32(segment), best.segment),
        )
    return best


def point_along(ahead: Ahead, along: jax.Array) -> jax.Array:
    """[2] (x, y) [m] of the point so far along the route, [] [m]; clamped to the L segments."""
    segment = jnp.clip(jnp.sum(ahead.along <= along) - 1, 0, SEGMENTS - 1)
    share = (along - ahead.along[segment]) / jnp.maximum(ahead.length[segment], 1e-6)
    return ahead.begin[segment] + jnp.clip(share, 0.0, 1.0) * ahead.span[segment]


def carrot(ahead: Ahead, position: jax.Array, lookahead: Scalar,
           clear: Callable[[jax.Array, jax.Array], jax.Array]) -> tuple[jax.Array, jax.Array]:
    """The farthest of C places, evenly along the route up to `lookahead` [m], that is in sight; and whether one is.

    The nearest place where none is. `clear` tells which points (x, y) are free. Unbatched. position: [2] [m].
    """
    here = foot_on(ahead, position[0], position[1]).along
    share = jnp.arange(1, PLACES + 1, dtype=jnp.float32) / PLACES
    places = jax.vmap(lambda part: point_along(ahead, here + part * lookahead))(share)
    part = (jnp.arange(1, SIGHT_POINTS + 1, dtype=jnp.float32) / SIGHT_POINTS)[None, :]
    x = position[0] + part * (places[:, :1] - position[0])
    y = position[1] + part * (places[:, 1:] - position[1])
    seen = jnp.all(clear(x, y), axis=1)
    farthest = jnp.max(jnp.where(seen, jnp.arange(PLACES), 0))
    return places[farthest], jnp.any(seen)


def _norm(dx: jax.Array, dy: jax.Array) -> jax.Array:
    squared = dx * dx + dy * dy
    return jnp.where(squared > 0, jnp.sqrt(jnp.where(squared > 0, squared, 1.0)), 0.0)
