"""Prints a table and writes out/bench.json. Inputs are scenarios of the `paper` generator from fixed keys."""

import json
import os
import platform
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from rich.console import Console
from rich.table import Table

from adwa_jax.astar import search
from adwa_jax.dwa import Guidance, decide
from adwa_jax.grid import cell_of
from adwa_jax.heuristic_weight import weight_field
from adwa_jax.obstacles import movers_at, sense
from adwa_jax.plan import plan
from adwa_jax.presets import Preset, extended, paper
from adwa_jax.rollout import RobotState
from adwa_jax.route import ahead_of, route_through
from adwa_jax.scenario import Scenario
from scenarios.generators.paper import PaperSpec, generate
from scenarios.padding import pad, padded_shape, stack
from scenarios.suite import make_suite
from tests.benchmarks.timing import Timing, timed
from tuning.evaluate import evaluate

PRESET = paper()
SPEED = 0.5  # [m/s] at which the robots decide: half of what they can, so that the window is whole


def scenarios_of(cells: int, count: int) -> Scenario:
    """`count` scenarios of cells², a fifth of the cells occupied; a leading axis."""
    keys = jax.random.split(jax.random.key(0), count)
    drawn = [generate(key, PaperSpec(cells=cells, movers=8)) for key in keys]
    return jax.device_put(stack([pad(scenario, padded_shape(scenario)) for scenario in drawn]))


def searches(cells: int, count: int) -> Timing:
    """Improved A* from corner to corner, ω(n) included, one search after another."""
    worlds = scenarios_of(cells, count)
    options = PRESET.options.plan

    @jax.jit
    def run(worlds: Scenario) -> jax.Array:
        def one(world: Scenario) -> jax.Array:
            start, goal = cell_of(world.grid, world.start[:2]), cell_of(world.grid, world.goal)
            weight = weight_field(world.grid, start, goal, PRESET.constants.weight_rule, "node")
            return search(world.grid.occupied, start, goal, weight, options.search).expansions

        return jax.lax.map(one, worlds)

    return timed(f"A* {cells} x {cells}", "searches", count, lambda: run(worlds),
                 describe=lambda expansions: {"expansions, mean": float(np.mean(expansions))})


def decisions(name: str, preset: Preset, count: int) -> Timing:
    """One decision in each of `count` 25² worlds, at the start, under way, with what is sensed there."""
    worlds = scenarios_of(25, count)
    constants, options = preset

    def plan_one(world: Scenario) -> Any:
        return plan(world.grid, world.start[:2], world.goal, constants, options.plan)

    plans = jax.jit(lambda worlds: jax.lax.map(plan_one, worlds))(worlds)

    def one(world: Scenario, planned: Any) -> tuple[jax.Array, jax.Array, jax.Array]:
        target = planned.key_points[1]
        heading = jnp.arctan2(target[1] - world.start[1], target[0] - world.start[0])
        robot = RobotState(world.start[0], world.start[1], heading, jnp.float32(SPEED), jnp.float32(0.0))
        unknown = jnp.zeros_like(world.squares.valid)
        sensed = sense(world.squares, unknown, world.movers, movers_at(world.movers, jnp.float32(0.0)),
                       world.start[:2], constants.behaviour.sensor_range)
        route = route_through(planned.key_points, planned.key_point_count)
        guidance = Guidance(target, world.goal, ahead_of(route, jnp.int32(1)))
        decision = decide(robot, guidance, planned.field, sensed, constants, options)
        return decision.v, decision.yaw_rate, decision.candidates.admissible  # as the closed loop, no diagnostics

    def describe(decided: tuple[jax.Array, jax.Array, jax.Array]) -> dict[str, float]:
        admissible = np.asarray(decided[2])
        candidates = float(np.prod(admissible.shape[1:]))
        return {"candidates": candidates, "candidate points": candidates * points_of(preset),
                "admissible share": float(np.mean(admissible))}  # fmt: skip

    run = jax.jit(lambda worlds, plans: jax.vmap(one)(worlds, plans))
    return timed(f"DWA, {name}", "decisions", count, lambda: run(worlds, plans), describe=describe)


def points_of(preset: Preset) -> int:
    """At how many points a candidate's clearance is looked up, those of its braking included."""
    dwa, rules = preset.options.dwa, preset.options.rules
    return dwa.horizon_steps + dwa.watch_beyond * rules.long_watch + dwa.halt_steps * rules.stopping


def episodes(count: int) -> Timing:
    """`evaluate` on the suite paper-25: planning and the closed loop, as a user runs it."""
    suite, dt = make_suite("paper-25", seed=0, count=count), float(PRESET.constants.behaviour.dt)
    return timed("plan and drive 25 x 25", "episodes", count, lambda: evaluate(suite, PRESET), repeats=3,
                 describe=lambda results: {"control steps, mean": float(np.mean(results.measures["time"])) / dt})


def table(timings: list[Timing]) -> Table:
    """One row a timing."""
    shown = Table(title="Median of several calls, after one to compile")
    for heading in ("what", "a second", "counted", "first call [s]", "one call [s]", "work"):
        shown.add_column(heading, justify="left" if heading in ("what", "counted", "work") else "right")
    for timing in timings:
        work = ", ".join(f"{name} {_short(value)}" for name, value in timing.detail.items())
        shown.add_row(timing.name, f"{timing.rate:,.0f}", timing.unit, f"{timing.first_s:.2f}",
                      f"{timing.items / timing.rate:.3f}", work)  # fmt: skip
    return shown


def _short(value: float) -> str:
    return f"{value:,.0f}" if value >= 10 else f"{value:.2f}"


def machine() -> dict[str, Any]:
    """What the figures were measured on."""
    device = jax.devices()[0]
    return {"cores": os.cpu_count(), "processor": platform.machine(), "python": platform.python_version(),
            "jax": jax.__version__, "device": f"{device.platform}: {device.device_kind}"}  # fmt: skip


def main() -> None:
    """Measure, print, write."""
    timings = [searches(25, 256), searches(100, 32), decisions("paper", PRESET, 512),
               decisions("extended", extended(), 512), episodes(128)]
    path = Path("out/bench.json")
    path.parent.mkdir(exist_ok=True)
    rows = [timing._asdict() | {"rate": timing.rate} for timing in timings]
    report = {"machine": machine(), "timings": rows}
    path.write_text(json.dumps(report, indent=2) + "\n")
    console = Console(width=120)
    console.print(table(timings))
    console.print(f"Written to {path}; " + ", ".join(f"{name} {value}" for name, value in machine().items()))


if __name__ == "__main__":
    main()
