"""Judge a planner on a suite: plan and drive every scenario, in batches of a fixed width.

The same scenario gives the same bits alone or in any company, because what is compiled for it depends on nothing but
itself: its padded shape sets the width of the batch, and a batch that is not full is filled by repetition.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from math import ceil

import jax
import numpy as np

from adwa_jax.constants import Constants, Options
from adwa_jax.episode import Episode
from adwa_jax.lanes import drive_lanes
from adwa_jax.plan import Plan, plan
from adwa_jax.presets import Preset
from adwa_jax.scenario import Scenario
from adwa_jax.score import ScoreWeights
from scenarios.errors import InputError
from scenarios.padding import PaddedShape, pad, padded_shape, stack
from scenarios.suite import Suite
from tuning.results import Results

FINEST_SPACING = 0.1  # [m]; the distance field is no finer, however many lattice steps a cell the options ask for
# Side of the map [cells] up to which a batch has so many lanes. More lanes wait longer for the slowest of them: 200
# episodes on 25 x 25 cells take 7.9 s in batches of 16, 13 s in batches of 64.
LANES = ((128, 16), (256, 8), (512, 4))
FEWEST_LANES = 2
WORKERS = 2  # batches in flight: XLA leaves cores idle between the small steps of one

Progress = Callable[[int, int], None]  # (scenarios done, of how many)


@dataclass(frozen=True)
class Batch:
    """What one compiled program serves. All of it follows from each scenario by itself."""

    shape: PaddedShape
    options: Options
    lanes: int  # B


def evaluate(suite: Suite, config: Preset, weights: ScoreWeights | None = None,
             progress: Progress | None = None) -> Results:
    """Plan and drive every scenario of a suite; `weights`, if given, stand in for the configuration's.

    Changing weights, limits or ω constants compiles nothing anew. `progress` is called after each batch. Raises
    InputError for a suite without scenarios.
    """
    if not suite.scenarios:
        raise InputError(f"{suite.name}: 0 scenarios; there must be at least one; make the suite again")
    constants = config.constants if weights is None else replace(config.constants, weights=weights)
    constants = jax.tree.map(np.float32, constants)
    batches = _batches(suite.scenarios, constants, config.options)
    rows: list[dict[str, np.ndarray] | None] = [None] * len(suite.scenarios)
    done = 0
    with ThreadPoolExecutor(WORKERS) as pool:
        for indices, columns in pool.map(partial(_run, suite.scenarios, constants), batches):
            for lane, index in enumerate(indices):
                rows[index] = {name: values[lane] for name, values in columns.items()}
            done += len(indices)
            if progress:
                progress(done, len(rows))
    return _results(suite, [row for row in rows if row is not None])


def batch_of(scenario: Scenario, constants: Constants, options: Options) -> Batch:
    """The compiled program a scenario belongs to."""
    shape = padded_shape(scenario)
    resolution = float(scenario.grid.resolution)
    subdivision = min(options.plan.subdivision, max(1, ceil(resolution / FINEST_SPACING - 1e-6)))
    reach = max(options.contact_reach, ceil(float(constants.robot.radius) / resolution) + 1)
    options = replace(options, plan=replace(options.plan, subdivision=subdivision), contact_reach=reach)
    side = max(shape.rows, shape.columns)
    return Batch(shape, options, next((lanes for limit, lanes in LANES if side <= limit), FEWEST_LANES))


def _batches(scenarios: tuple[Scenario, ...], constants: Constants,
             options: Options) -> list[tuple[Batch, list[int]]]:
    """Scenarios of one program together, in runs of its width."""
    members: dict[Batch, list[int]] = {}
    for index, scenario in enumerate(scenarios):
        members.setdefault(batch_of(scenario, constants, options), []).append(index)
    return [(batch, indices[start : start + batch.lanes])
            for batch, indices in members.items() for start in range(0, len(indices), batch.lanes)]  # fmt: skip


def _run(scenarios: tuple[Scenario, ...], constants: Constants,
         work: tuple[Batch, list[int]]) -> tuple[list[int], dict[str, np.ndarray]]:
    """Evaluate one batch; lanes beyond its scenarios repeat the first."""
    batch, indices = work
    filled = indices + indices[:1] * (batch.lanes - len(indices))
    lanes = stack([pad(scenarios[index], batch.shape) for index in filled])
    planned, episodes = _episodes(lanes, constants, batch.options)
    return indices, _columns(planned, jax.device_get(episodes))


@partial(jax.jit, static_argnames="options")
def _episodes(lanes: Scenario, constants: Constants, options: Options) -> tuple[dict[str, jax.Array], Episode]:
    """Plans one after another (a vmapped search would run until the slowest ends), episodes side by side."""

    def plan_one(scenario: Scenario) -> Plan:
        return plan(scenario.grid, scenario.start[:2], scenario.goal, constants, options.plan)

    plans = jax.lax.map(plan_one, lanes)
    return planned_columns(plans), drive_lanes(lanes, plans, constants, options)


def planned_columns(planned: Plan) -> dict[str, jax.Array]:
    """The planned path's figures, named apart from the driven path's."""
    return {
        "optimal_length": planned.optimal_length,
        "planned_length": planned.length,
        "key_point_length": planned.key_point_length,
        "key_point_count": planned.key_point_count,
        "expansions": planned.search.expansions,
        **{f"planned_{name}": value for name, value in planned.measures._asdict().items()},
    }


def _columns(planned: dict[str, jax.Array], episodes: Episode) -> dict[str, np.ndarray]:
    """Every figure of a batch by name, [B] each."""
    driven = {"outcome": episodes.outcome, "hit_while_stopped": episodes.hit_while_stopped,
              "brakings": episodes.brakings, "replans": episodes.replans, **episodes.measures._asdict()}  # fmt: skip
    return {name: np.asarray(value) for name, value in {**planned, **driven}.items()}


def _results(suite: Suite, rows: list[dict[str, np.ndarray]]) -> Results:
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    outcome = columns.pop("outcome")
    return Results(suite.name, suite.names, outcome, columns)
