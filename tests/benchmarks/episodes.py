"""Closed-loop episodes through the engine: against the yardstick, and how the engine scales."""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from adwa_jax.constants import Constants
from adwa_jax.presets import extended, paper
from scenarios.suite import make_suite
from tests.benchmarks.agreement import numba_worlds
from tests.benchmarks.inputs import scenarios
from tests.benchmarks.timing import Figure, contest, rate_of
from tests.benchmarks.yardstick import Yardstick
from tests.yardstick_scenarios import LOOP, episode_options, scenarios_of
from tuning.engine import Judged, judge_pairs, usable_cores

BASE = paper()
NUMBA_NOTE = "the control loop alone; plans and fields are given, which take the C++ program under 1 % of its time"


def against_yardstick(yardstick: Yardstick | None, count: int = 1000) -> list[Figure]:
    """Driving the yardstick's scenarios with its constants, planning included save in numba; episodes a second."""
    arrays = scenarios(count)
    worlds = scenarios_of(**arrays)
    steps: dict[str, float] = {}

    def ours() -> float:
        begin = time.perf_counter()
        judged = judge_pairs(worlds, [LOOP], BASE.options)
        seconds = time.perf_counter() - begin
        steps["adwa-jax"] = float(judged.columns["time"].sum()) / 0.1 / seconds
        return count / seconds

    contestants = {"adwa-jax": ours}
    if yardstick:
        contestants["C++ AVX-512"] = lambda: yardstick.rate("episodes", arrays, *episode_options())
        contestants |= in_numba(yardstick, count)
    figures = contest("closed loop, 25 × 25 m", "episodes", contestants, rounds=3)
    figures[0].note = f"plans included, {steps['adwa-jax']:,.0f} control steps a second"
    for figure in figures[1:]:
        figure.note = NUMBA_NOTE if figure.who.startswith("numba") else "plans included"
    return figures


def in_numba(yardstick: Yardstick, count: int) -> dict[str, Callable[[], float]]:
    """The closed loop in numba on one core, as it runs when nothing is said, and on all; none without numba."""
    if (worlds := numba_worlds(yardstick, count)) is None:
        return {}
    from tests.benchmarks.numba_episodes import driven

    def on(threads: int) -> Callable[[], float]:
        return lambda: rate_of(count, lambda: driven(worlds, threads))

    return {"numba, one core": on(1), "numba, all cores": on(usable_cores())}


def presets(count: int = 512) -> list[Figure]:
    """Episodes a second of both presets on the suite paper-25."""
    worlds = make_suite("paper-25", seed=0, count=count).scenarios

    def of(preset: Any) -> Any:
        return lambda: rate_of(count, lambda: judge_pairs(worlds, [preset.constants], preset.options))

    return contest("episodes of paper-25", "episodes", {"paper": of(paper()), "extended": of(extended())}, rounds=3)


def scaling(lanes: tuple[int, ...] = (8, 16, 32, 64), pairs: int = 1024) -> Iterator[list[Figure]]:
    """Lanes of a worker, workers, and how many pairs there are: the rate should not fall as they grow."""
    worlds = make_suite("paper-20", seed=0, count=128).scenarios
    weights = candidates(pairs // len(worlds))

    def run(count: int = len(weights), **how: int) -> Any:
        return lambda: rate_of(count * len(worlds), lambda: judge_pairs(worlds, weights[:count], BASE.options, **how))

    yield contest("lanes of a worker", "episodes", {str(width): run(lanes=width) for width in lanes}, rounds=2)
    yield contest("workers", "episodes", {str(count): run(workers=count)
                                          for count in range(1, usable_cores() + 1)}, rounds=2)  # fmt: skip
    yield contest("pairs", "episodes", {str(count * len(worlds)): run(count)
                                        for count in (1, 2, 4, len(weights))}, rounds=2)  # fmt: skip


def candidates(count: int) -> list[Constants]:
    """Constants that differ in their score weights."""
    weights = BASE.constants.weights
    shares = np.linspace(0.6, 1.0, count)
    return [replace(BASE.constants, weights=replace(weights, local_heading=float(share))) for share in shares]


def job(weights: int, scenarios: int, time_limit: float | None = None, log: float = 30.0) -> dict[str, Any]:
    """A tuning job's evaluations on the suite paper-20: wall time, rate as it went, and peak memory of this process.

    time_limit [s]: of each episode; None: the suite's.
    """
    worlds = make_suite("paper-20", seed=11, count=scenarios).scenarios
    if time_limit is not None:
        worlds = [replace(world, time_limit=np.float32(time_limit)) for world in worlds]
    judge_pairs(worlds[:2], candidates(1), BASE.options)  # compiled before
    begin, seen, shown = time.perf_counter(), [], [0.0]

    def progress(done: int, total: int) -> None:
        seconds = time.perf_counter() - begin
        seen.append((done, seconds))
        if seconds - shown[0] > log:
            shown[0] = seconds
            print(f"  {done:,} of {total:,} episodes in {seconds:,.0f} s: {done / seconds:.1f} a second", flush=True)

    judged: Judged = judge_pairs(worlds, candidates(weights), BASE.options, progress=progress)
    seconds = time.perf_counter() - begin
    return {"weights": weights, "scenarios": scenarios, "episodes": int(judged.done.sum()), "wall_s": seconds,
            "episodes_per_s": judged.done.sum() / seconds, "plans": judged.plans, "peak_MiB": peak_mebibytes(),
            "progress": [seen[int(place)] for place in np.unique(np.geomspace(1, len(seen), 25).astype(int) - 1)]}


def peak_mebibytes() -> float:
    """Of this process so far; by `getrusage`, where there is no other way, it may be that of the one that began it."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
        return next(float(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024
    except (OSError, StopIteration):
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def compile_time() -> dict[str, float]:
    """Seconds of the first evaluation of one scenario in a new process, without and with compiled programs kept."""
    code = ("import time, json; from adwa_jax.presets import {preset}; from scenarios.suite import make_suite; "
            "from tuning.evaluate import evaluate; s = make_suite('paper-25', 0, 1); b = time.perf_counter(); "
            "evaluate(s, {preset}()); print(json.dumps(time.perf_counter() - b))")  # fmt: skip
    found = {}
    for preset in ("paper", "extended"):
        with tempfile.TemporaryDirectory() as folder:
            environment = {**os.environ, "JAX_COMPILATION_CACHE_DIR": folder,
                           "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0.2"}  # fmt: skip
            for state in ("cold", "kept"):
                call = [sys.executable, "-c", code.format(preset=preset)]
                output = subprocess.run(call, env=environment, capture_output=True, text=True, check=True).stdout
                found[f"{preset}, {state}"] = float(json.loads(output))
    return found
