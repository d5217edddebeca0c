"""Whether episodes end as the yardstick's do, from its plans and its field: the closed loop alone, ours and numba's."""

from functools import cache
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.constants import Constants, Options
from adwa_jax.episode import Outcome
from adwa_jax.lanes import drive_lanes
from adwa_jax.scenario import Scenario
from scenarios.padding import stack
from tests.benchmarks.inputs import Arrays, scenarios
from tests.benchmarks.yardstick import Yardstick, peer
from tests.test_adwa_jax.worlds import plan_by_hand
from tests.yardstick_scenarios import (
    LOOP,
    LOOP_OPTIONS,
    SAME_END,
    episode_options,
    field_of,
    key_points_of,
    scenarios_of,
)
from tuning.engine import program_of

if TYPE_CHECKING:
    from tests.benchmarks.numba_episodes import Worlds

Found = tuple[np.ndarray, np.ndarray]
"""[N] how each episode ended, as the yardstick counts; [N] the metres driven."""


def agreement(yardstick: Yardstick, count: int = 1000) -> dict[str, Any]:
    """Beside the program in double precision; numba's only where numba is."""
    arrays = scenarios(count)
    records = yardstick.items("episodes", arrays, "--impl", "scalar", *episode_options())
    theirs = np.array([record["kind"] for record in records]), np.array([record["length"] for record in records])
    compared = {"adwa-jax": beside(ours(arrays, keys_of(yardstick, arrays)), theirs)}
    if (worlds := numba_worlds(yardstick, count)) is not None:
        compared["numba"] = beside(in_numba(worlds), theirs)
    return compared


def beside(found: Found, theirs: Found) -> dict[str, float]:
    """Shares of the episodes."""
    apart = np.abs(found[1] - theirs[1])
    return {"count": len(apart), "same outcome": float(np.mean(found[0] == theirs[0])),
            "same path within 2 cm": float(np.mean(apart < 0.02)),
            "success, ours": float(np.mean(found[0] == 0)), "success, theirs": float(np.mean(theirs[0] == 0))}


def keys_of(yardstick: Yardstick, arrays: Arrays) -> list[list]:
    """The key points that it finds, for each map."""
    margin = str(LOOP.behaviour.clearance_margin)
    return [record["key"] for record in yardstick.items("keypts", {"maps": arrays["maps"]}, "--los", margin)]


@cache
def numba_worlds(yardstick: Yardstick, count: int) -> "Worlds | None":
    """The scenarios with its plans and its field for the loop in numba; None where numba is absent."""
    if (python := peer("dwa_np")) is None:
        return None
    from tests.benchmarks.numba_episodes import worlds_of

    arrays = scenarios(count)
    return worlds_of(arrays, keys_of(yardstick, arrays), python.edf)


def in_numba(worlds: "Worlds") -> Found:
    """Driven on one core."""
    from tests.benchmarks.numba_episodes import driven

    found = driven(worlds)
    return found[:, 0], found[:, 2]


def ours(arrays: Arrays, keys: list[list]) -> Found:
    """Driven in lanes, 50 at a time."""
    worlds = scenarios_of(**arrays)
    options = program_of(worlds[0], LOOP, LOOP_OPTIONS).options
    ends, lengths = [], []
    for first in range(0, len(worlds), 50):
        part = [_by_hand(world, key) for world, key in
                zip(worlds[first : first + 50], keys[first : first + 50], strict=True)]  # fmt: skip
        found = _driven(stack([world for world, _, _ in part]), np.stack([points for _, points, _ in part]),
                        np.int32([number for _, _, number in part]), LOOP, options)  # fmt: skip
        ends += [SAME_END[Outcome(outcome)] for outcome in found.outcome.tolist()]
        lengths += found.measures.length.tolist()
    return np.array(ends), np.array(lengths)


def _by_hand(world: Scenario, key: list) -> tuple[Scenario, np.ndarray, int]:
    return world, key_points_of(key, world), len(key)


@jax.jit
def _plans(worlds: Scenario, points: jax.Array, counts: jax.Array) -> Any:
    return jax.lax.map(lambda one: plan_by_hand(one[1], one[2], field_of(one[0].grid.occupied)),
                       (worlds, points, counts))  # fmt: skip


def _driven(worlds: Scenario, points: np.ndarray, counts: np.ndarray, constants: Constants, options: Options) -> Any:
    plans = _plans(worlds, points, counts)
    drive = jax.jit(drive_lanes, static_argnames="options")
    return jax.device_get(drive(worlds, plans, jax.tree.map(jnp.float32, constants), options=options))
