"""What the heuristic weight does to the search over many maps, for ω constant or by eq. 5."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.astar import SearchOptions, SearchResult, Status
from adwa_jax.astar_lanes import search_lanes
from adwa_jax.grid import Grid, cell_of
from adwa_jax.heuristic_weight import MAX_WEIGHT, Scope, WeightRule, weight_field
from adwa_jax.presets import paper
from adwa_jax.scenario import Scenario
from scenarios.errors import InputError
from scenarios.padding import ladder_size, pad_grid
from scenarios.suite import Suite
from tuning.compiled import keep_compiled
from tuning.intervals import mean_interval

AT_ONCE = 64  # searches of one call, so that any number of maps is served by one compiled program


@dataclass(frozen=True)
class Weighting:
    """How ω is set: a number for all cells, or eq. 5 with a scope."""

    rule: WeightRule | float
    scope: Scope = "node"

    def __post_init__(self) -> None:
        """Refuse a number that the search cannot hold."""
        if not isinstance(self.rule, WeightRule) and not 0.0 <= self.rule <= MAX_WEIGHT:
            raise InputError(f"weight: {self.rule}; must be in [0, {MAX_WEIGHT:g}], what the search's costs hold; "
                             "take one of these")  # fmt: skip


class _Tasks(NamedTuple):
    """A leading axis of searches on everything."""

    grid: Grid
    start: jax.Array  # [2] float32 (x, y) [m]
    goal: jax.Array  # [2] float32


class Searches(NamedTuple):
    """What N searches took and found; corner rule `never`."""

    expansions: np.ndarray  # [N] int32
    length: np.ndarray  # [N] float64, of the grid path [m]

    def beside(self, others: "Searches") -> tuple[np.ndarray, np.ndarray]:
        """Expansions and length, each over that of the others on the same map, [N] each."""
        return self.expansions / np.maximum(others.expansions, 1), self.length / np.maximum(others.length, 1e-9)


class Tradeoff(NamedTuple):
    """Over many maps, beside ω = 1; each a mean with its 95 % interval (mean, low, high)."""

    expansions: tuple[float, float, float]  # ratio
    length: tuple[float, float, float]  # ratio; 1 is the shortest
    fewer: float  # share of the maps with fewer expansions than ω = 1
    longer: float  # share of the maps with a longer path than the shortest


DEFAULT_RULE = paper().constants.weight_rule
SHAPES = {
    "eq. 5, each cell's rectangle": Weighting(DEFAULT_RULE),
    "eq. 5, start's rectangle": Weighting(DEFAULT_RULE, "start"),
    "eq. 5, sparse ω up to 2.5": Weighting(WeightRule(0.5, 0.5, 1.5, 2.0)),
    "eq. 5, wider bands": Weighting(WeightRule(0.4, 0.6, 1.2, 0.6, dense_ratio=1.1, sparse_ratio=0.9)),
}
"""Shapes of eq. 5 to compare: ours, the text to the letter, and two that change ω more and more often."""


def search_all(suite: Suite, weightings: Mapping[str, Weighting]) -> dict[str, Searches]:
    """Every scenario of the suite searched from start to goal with every weighting, the robot a point.

    Raises InputError where a map has no path.
    """
    keep_compiled()
    tasks = _stacked(suite.scenarios)
    return {name: _searches(suite, _found(tasks, weighting)) for name, weighting in weightings.items()}


def search_one(scenario: Scenario, weighting: Weighting) -> SearchResult:
    """The same search of one scenario, with its path and the order of its expansions, padded."""
    keep_compiled()
    found = _found(_stacked([scenario]), weighting)
    return jax.tree.map(lambda leaf: leaf[0], found)


def tradeoffs(searches: Mapping[str, Searches], optimal: Searches) -> dict[str, Tradeoff]:
    """Each beside the searches with ω = 1, which find the shortest path."""
    return {name: _tradeoff(found, optimal) for name, found in searches.items()}


def _tradeoff(found: Searches, optimal: Searches) -> Tradeoff:
    expansions, length = found.beside(optimal)
    return Tradeoff(mean_interval(expansions.tolist()), mean_interval(length.tolist()),
                    float(np.mean(expansions < 1.0)), float(np.mean(length > 1.0 + 1e-6)))  # fmt: skip


def _stacked(scenarios: Sequence[Scenario]) -> _Tasks:
    """In one padded shape, filled up to whole calls with repetitions of the last."""
    sides = np.array([scenario.grid.occupied.shape for scenario in scenarios]).max(axis=0)
    rows, columns = (ladder_size(int(side)) for side in sides)
    filled = [*scenarios, *[scenarios[-1]] * (-len(scenarios) % AT_ONCE)]
    tasks = [_Tasks(pad_grid(scenario.grid, rows, columns), scenario.start[:2], scenario.goal)
             for scenario in filled]  # fmt: skip
    return jax.tree.map(lambda *leaves: np.stack(leaves), *tasks)


def _found(tasks: _Tasks, weighting: Weighting) -> SearchResult:
    """All tasks, call after call."""
    rule, scope, number = weighting.rule, weighting.scope, 1.0
    if not isinstance(rule, WeightRule):
        rule, scope, number = DEFAULT_RULE, "one", rule
    rule, number = jax.tree.map(np.float32, (rule, number))
    parts = []
    for first in range(0, len(tasks.start), AT_ONCE):
        block = jax.tree.map(lambda leaf, first=first: leaf[first : first + AT_ONCE], tasks)
        parts.append(jax.device_get(_search_block(block, rule, number, scope)))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *parts)


@partial(jax.jit, static_argnames="scope")
def _search_block(tasks: _Tasks, rule: WeightRule, number: jax.Array, scope: Scope) -> SearchResult:
    """AT_ONCE searches; scope `one`: the number is ω."""
    start_cells, goal_cells = jax.vmap(cell_of)(tasks.grid, tasks.start), jax.vmap(cell_of)(tasks.grid, tasks.goal)
    if scope == "one":
        weights = jnp.full(tasks.grid.occupied.shape, number, jnp.float32)
    else:
        weights = jax.vmap(partial(weight_field, rule=rule, scope=scope))(tasks.grid, start_cells, goal_cells)
    return search_lanes(tasks.grid.occupied, start_cells, goal_cells, weights, SearchOptions())


def _searches(suite: Suite, found: SearchResult) -> Searches:
    count = len(suite.scenarios)
    missing = np.flatnonzero(found.status[:count] != Status.FOUND)
    if missing.size:
        status = Status(int(found.status[missing[0]])).name
        raise InputError(f"{suite.name}: scenario {suite.names[missing[0]]}: {status}; every map must have a path; "
                         "leave it out")  # fmt: skip
    side = np.array([scenario.grid.resolution for scenario in suite.scenarios])
    length = (found.straight_steps[:count] + np.sqrt(2.0) * found.diagonal_steps[:count]) * side
    return Searches(np.asarray(found.expansions[:count]), length)
