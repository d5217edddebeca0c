"""The paper's candidates in many lanes: `dwa.decide` up to the scores, equal to it in all but rounding.

Why it stands beside the unbatched kernel: on a CPU every operation of a loop's body is a kernel of its own, and what
is looked up in the field comes fast only from a kernel that does nothing else. So points are looked up in one kernel
for all lanes, and what is before and after is one native function each (`native.whole`), which takes the unknown
obstacles lane after lane: one that cannot come nearer than the map's squares is left out.

Dimension letters: B lanes; V speeds, N yaw rates, K predicted points. K and N are one axis, K·N long and filled up to
whole vectors: loops over 21 yaw rates would be unrolled into single numbers.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from adwa_jax.constants import Constants, Options
from adwa_jax.dwa import Judged, judged_by_clearance
from adwa_jax.grid import BILINEAR_EXCESS, DistanceField, bilinear, lesser
from adwa_jax.native import largest, whole
from adwa_jax.obstacles import Sensed, predicted_centres
from adwa_jax.prediction import VECTOR, least_root
from adwa_jax.rollout import Arcs, RobotState, arcs
from adwa_jax.window import velocity_window

SLACK = 1e-3  # [m] by which distances are held to be less certain than they are, to be safe from rounding


class _Rays(NamedTuple):
    """Where one lane's candidates get to: x = x₀ + v · reach_x."""

    x: jax.Array  # [] float32 [m]
    y: jax.Array  # [] float32 [m]
    v: jax.Array  # [V] float32 [m/s]
    reach_x: jax.Array  # [K·N] float32 [s]
    reach_y: jax.Array  # [K·N] float32
    dt: jax.Array  # [] float32 [s]


class _Shape(NamedTuple):
    """Static."""

    steps: int  # K
    turns: int  # N


def judged_lanes(state: RobotState, field: DistanceField, sensed: Sensed, constants: Constants,
                 options: Options) -> Judged:
    """What is known of the candidates before they are scored; a leading axis B on everything."""
    dwa, robot = options.dwa, constants.robot
    shape = _Shape(dwa.horizon_steps, dwa.yaw_rate_samples)
    v, yaw_rate, rays, last = whole(partial(_rays, options=options), state, constants)
    known = jax.vmap(_looked_up)(field, rays)

    def nearest(lane: tuple[_Rays, jax.Array, jax.Array, Sensed]) -> jax.Array:
        rays, known, spacing, sensed = lane
        return _nearest(rays, known, spacing, sensed, shape)

    clearance = whole(partial(lax.map, nearest), (rays, known, field.spacing, _in_use(sensed)))
    return jax.vmap(judged_by_clearance)(state, v, yaw_rate, last, clearance, robot)


def _in_use(sensed: Sensed) -> Sensed:
    """None for what is not read: the compiler fails on operands of a loop inside a `whole` that are none."""
    sensed = sensed._replace(square_count=None, mover_count=None)
    return jax.tree.map(lambda leaf: leaf if leaf.size else None, sensed)


def _rays(state: RobotState, constants: Constants, options: Options) -> tuple[jax.Array, jax.Array, _Rays, Arcs]:
    """Speeds [B, V], yaw rates [B, N], rays filled up to whole vectors, and the last row of the arcs, [B, N] each."""
    dwa, dt = options.dwa, jnp.asarray(constants.behaviour.dt)

    def window(state: RobotState, constants: Constants) -> tuple[jax.Array, jax.Array]:
        return velocity_window(state.v, state.yaw_rate, constants.robot, constants.behaviour.dt, dwa.v_samples,
                               dwa.yaw_rate_samples)

    v, yaw_rate = jax.vmap(window)(state, constants)

    def flat() -> tuple[jax.Array, ...]:
        return tuple(jnp.broadcast_to(value, yaw_rate.shape).reshape(-1)
                     for value in (state.heading[:, None], yaw_rate, dt[:, None]))  # fmt: skip

    heading, turn, step = whole(flat)
    arc = arcs(heading, turn, step, dwa.horizon_steps)  # of all lanes side by side: [K, B·N]
    arc = jax.tree.map(lambda rows: rows.reshape(-1, *yaw_rate.shape), arc)

    def row_of(rows: jax.Array) -> jax.Array:
        row = jnp.moveaxis(rows, 0, 1).reshape(rows.shape[1], -1)
        return jnp.pad(row, ((0, 0), (0, -row.shape[1] % VECTOR)), mode="edge")

    rays = _Rays(state.x, state.y, v, row_of(arc.reach_x), row_of(arc.reach_y), dt)
    return v, yaw_rate, rays, jax.tree.map(lambda rows: rows[-1], arc)


def _looked_up(field: DistanceField, rays: _Rays) -> jax.Array:
    """[V, K·N], filled up: the field at every point, unbatched."""
    return bilinear(field, rays.x + rays.v[:, None] * rays.reach_x[None, :],
                    rays.y + rays.v[:, None] * rays.reach_y[None, :])  # fmt: skip


def _nearest(rays: _Rays, looked_up: jax.Array, spacing: jax.Array, sensed: Sensed, shape: _Shape) -> jax.Array:
    """[V, N]: `prediction.candidate_clearance` of one lane."""
    used = shape.steps * shape.turns
    rays = rays._replace(reach_x=rays.reach_x[:used], reach_y=rays.reach_y[:used])
    known = whole(lambda: _least_over_steps(looked_up[:, :used], shape) - BILINEAR_EXCESS * spacing)
    bound = largest(known) + SLACK  # what is farther than this is the nearest obstacle of no candidate
    least = _with_squares(known.reshape(-1), rays, sensed, bound, shape)
    return _with_movers(least, rays, sensed, bound, shape).reshape(known.shape)


def _with_squares(least: jax.Array, rays: _Rays, sensed: Sensed, bound: jax.Array, shape: _Shape) -> jax.Array:
    """[V·N] `least`, or the distance to a known square where that is less."""
    if sensed.square_known is None:
        return least
    from_x, from_y = rays.x - sensed.square_centre[:, 0], rays.y - sensed.square_centre[:, 1]

    def beyond(offset: jax.Array, half_width: jax.Array) -> jax.Array:
        return jnp.maximum(jnp.abs(offset) - half_width, 0.0)

    dx, dy = beyond(from_x, sensed.square_half_width), beyond(from_y, sensed.square_half_width)
    room = jnp.maximum(bound + _farthest(rays) * shape.steps + sensed.square_rounding, 0.0)
    counts = sensed.square_known & (dx * dx + dy * dy <= room * room)

    def body_fun(index: jax.Array, least: jax.Array) -> jax.Array:
        def squared() -> jax.Array:
            dx = beyond(from_x[index] + rays.v[:, None] * rays.reach_x[None, :], sensed.square_half_width[index])
            dy = beyond(from_y[index] + rays.v[:, None] * rays.reach_y[None, :], sensed.square_half_width[index])
            return _least_over_steps(dx * dx + dy * dy, shape).reshape(-1)

        return lax.cond(counts[index], lambda: least_root(whole(squared), sensed.square_rounding[index], least),
                        lambda: least)  # fmt: skip

    return lax.fori_loop(0, counts.shape[0], body_fun, least)


def _with_movers(least: jax.Array, rays: _Rays, sensed: Sensed, bound: jax.Array, shape: _Shape) -> jax.Array:
    """[V·N] `least`, or the distance to a seen mover at the time of a point where that is less."""
    if sensed.seen is None:
        return least
    times = jnp.arange(1, shape.steps + 1, dtype=jnp.float32) * rays.dt
    centres = jax.vmap(lambda ahead: predicted_centres(sensed, ahead))(times)
    from_x, from_y = rays.x - centres[..., 0], rays.y - centres[..., 1]  # [K, M]
    steps = np.arange(1, shape.steps + 1, dtype=np.float32)[:, None]
    room = jnp.maximum(bound + _farthest(rays) * steps + sensed.radius[None, :], 0.0)
    counts = sensed.seen & jnp.any(from_x * from_x + from_y * from_y <= room * room, axis=0)
    row = np.repeat(np.arange(shape.steps, dtype=np.int32), shape.turns)  # of each place in K·N

    def body_fun(index: jax.Array, least: jax.Array) -> jax.Array:
        def squared(from_x: jax.Array, from_y: jax.Array) -> jax.Array:
            dx = from_x[None, :] + rays.v[:, None] * rays.reach_x[None, :]
            dy = from_y[None, :] + rays.v[:, None] * rays.reach_y[None, :]
            return _least_over_steps(dx * dx + dy * dy, shape).reshape(-1)

        def nearer() -> jax.Array:
            return least_root(whole(squared, from_x[row, index], from_y[row, index]), sensed.radius[index], least)

        return lax.cond(counts[index], nearer, lambda: least)

    return lax.fori_loop(0, counts.shape[0], body_fun, least)


def _farthest(rays: _Rays) -> jax.Array:
    """[] what the fastest candidate covers in a step [m]."""
    return jnp.maximum(jnp.abs(rays.v[0]), jnp.abs(rays.v[-1])) * rays.dt


def _least_over_steps(values: jax.Array, shape: _Shape) -> jax.Array:
    """[V, N] least over K of [V, K·N]: folded in halves, whose loops are long."""
    steps, turns = shape
    while steps > 1:
        half = steps // 2
        folded = lesser(values[:, : half * turns], values[:, half * turns : 2 * half * turns])
        if steps % 2:
            first = lesser(folded[:, :turns], values[:, 2 * half * turns :])
            folded = jnp.concatenate([first, folded[:, turns:]], axis=1)
        values, steps = folded, half
    return values
