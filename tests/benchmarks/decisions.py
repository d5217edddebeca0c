"""Single DWA decisions: 11 × 21 candidates, 30 points each, 8 movers sensed; and the extended planner's beside them."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.constants import Constants, DwaOptions, Options
from adwa_jax.dwa import Decision, Guidance, decide
from adwa_jax.grid import DistanceField
from adwa_jax.obstacles import Sensed
from adwa_jax.presets import Preset, extended, paper
from adwa_jax.rollout import RobotState
from adwa_jax.route import ahead_of, route_through
from adwa_jax.score import ScoreWeights
from adwa_jax.window import RobotLimits
from tests.benchmarks.inputs import Arrays, scenes
from tests.benchmarks.timing import Figure, contest, in_threads, rate_of
from tests.benchmarks.yardstick import Yardstick, doubled, peer
from tests.yardstick_scenarios import field_of
from tuning.engine import usable_cores

ROBOT = RobotLimits(0.25, 0.0, 1.0, 1.5, acceleration=1.0, yaw_acceleration=3.0, brake=1.0, yaw_brake=1e9)
OPTIONS = Options(dwa=DwaOptions(v_samples=11, yaw_rate_samples=21, horizon_steps=30, normalisation="sum"))
SCENES, CHUNK = 1000, 125  # decisions; in one call of a core
SCALAR_SCENES = 25  # for peers that take one at a time
Scene = tuple[DistanceField, RobotState, Guidance, Sensed]


def constants() -> Constants:
    """Those of the yardstick."""
    base = paper().constants
    return replace(base, weights=ScoreWeights(0.4, 0.2, 0.2, 0.1), robot=ROBOT,
                   behaviour=replace(base.behaviour, dt=0.1, clearance_cap=1.0))  # fmt: skip


def prepared(arrays: Arrays) -> Scene:
    """All scenes; a leading axis on everything. The field is that of the yardstick."""
    single = {name: jnp.asarray(values, jnp.float32) for name, values in arrays.items()}

    @jax.jit
    def fields(maps: jax.Array) -> DistanceField:
        return jax.lax.map(field_of, maps)

    def scene(state: jax.Array, local: jax.Array, goal: jax.Array, disc: jax.Array) -> tuple:
        count = disc.shape[0]
        nothing = jnp.zeros((0, 2)), jnp.zeros(0), jnp.zeros(0, bool)
        sensed = Sensed(*nothing, disc[:, :2], disc[:, 2:4], disc[:, 4], jnp.ones(count, bool), jnp.zeros(0))
        route = route_through(jnp.stack([state[:2], local, goal]), jnp.int32(3))
        return RobotState(*state), Guidance(local, goal, ahead_of(route, jnp.int32(1))), sensed

    rest = jax.vmap(scene)(single["state"], single["local"], single["goal"], single["disc"])
    return jax.block_until_ready((fields(single["maps"]), *rest))


def decider(values: Constants, options: Options) -> Callable[[Scene], Decision]:
    """The compiled decision of a chunk of scenes; what is not needed of its diagnostics is not worked out."""

    @jax.jit
    def decided(scene: Scene) -> tuple:
        def one(field: DistanceField, state: RobotState, guidance: Guidance, sensed: Sensed) -> tuple:
            found = decide(state, guidance, field, sensed, values, options)
            return found.v, found.yaw_rate, found.index

        return jax.vmap(one)(*scene)

    return decided


def decisions_a_second(decided: Callable[[Scene], Decision], scene: Scene) -> float:
    """On all cores: a thread each, which takes chunk after chunk; on an accelerator all in one call."""
    count = len(scene[1].x)
    chunk = CHUNK if jax.default_backend() == "cpu" else count
    parts = [jax.tree.map(lambda leaf, start=start: leaf[start : start + chunk], scene)
             for start in range(0, count, chunk)]  # fmt: skip

    def share(worker: int) -> None:
        for part in parts[worker :: usable_cores()]:
            jax.block_until_ready(decided(part))

    return rate_of(count, lambda: in_threads(partial(share, worker) for worker in range(usable_cores())))


def against_peers(yardstick: Yardstick | None) -> list[Figure]:
    """The same scenes decided by all."""
    arrays = scenes(SCENES)
    scene, decided = prepared(arrays), decider(constants(), OPTIONS)
    contestants = {"adwa-jax": lambda: decisions_a_second(decided, scene)}
    if yardstick:
        contestants["C++ AVX-512"] = lambda: yardstick.rate("dwa", arrays, "--impl", "simd", "--repeat", "7")
    if (python := peer("dwa_np")) is not None:
        fields = [python.edf(grid) for grid in arrays["maps"][:SCALAR_SCENES]]

        def one_core(decide_one: Callable) -> float:
            def work() -> None:
                for index, field in enumerate(fields):
                    decide_one(*(arrays[name][index] for name in ("state", "local", "goal")), field,
                               arrays["disc"][index])

            return doubled([rate_of(SCALAR_SCENES, work)])

        contestants["numba"] = lambda: one_core(python.dwa_numba)
        contestants["NumPy"] = lambda: one_core(python.dwa_numpy)
    return contest("DWA, 231 × 30 points, 8 movers", "decisions", contestants)


def choices_that_differ(yardstick: Yardstick) -> list[float]:
    """Of 1000 scenes those in which the double-precision program chooses otherwise: by how much our score is better."""
    arrays = scenes(SCENES)
    expected = np.array([record["idx"] for record in yardstick.items("dwa", arrays, "--impl", "scalar")])
    scene = prepared(arrays)
    every = jax.jit(jax.vmap(lambda field, state, guidance, sensed: decide(
        state, guidance, field, sensed, constants(), OPTIONS)))(*scene)  # fmt: skip
    ours, scores = np.asarray(every.index), np.asarray(every.candidates.score).reshape(SCENES, -1)
    return [float(scores[index, ours[index]] - scores[index, expected[index]]) if min(ours[index], expected[index]) >= 0
            else np.inf for index in np.flatnonzero(ours != expected)]  # fmt: skip


def points_of(preset: Preset) -> int:
    """Points at which a decision looks up clearances, those of braking included."""
    dwa, rules = preset.options.dwa, preset.options.rules
    # A second phase: two speeds more, one more in reverse, and each turn but the middle one twice more.
    speeds = dwa.v_samples + rules.reverse + 2 * rules.second_phase
    turns = dwa.yaw_rate_samples + 2 * (dwa.yaw_rate_samples - 1) * rules.second_phase
    steps = dwa.horizon_steps + dwa.watch_beyond * rules.long_watch + dwa.halt_steps * rules.stopping
    return speeds * turns * steps


def presets_beside() -> list[Figure]:
    """Candidate points a second of both presets, in the same scenes."""
    scene = prepared(scenes(SCENES))

    def of(preset: Preset) -> Callable[[], float]:
        decided = decider(preset.constants, preset.options)
        return lambda: points_of(preset) * decisions_a_second(decided, scene)

    return contest("DWA of the presets", "points", {"paper": of(paper()), "extended": of(extended())})
