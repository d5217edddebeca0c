"""Table 1 of the paper over many maps: the improved and the traditional A* on each of them (§5.1)."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import jax
import numpy as np

from adwa_jax.constants import Constants
from adwa_jax.presets import paper
from scenarios.generators.paper import PaperSpec, generate
from scenarios.suite import Suite
from tuning.planning import PlannedPath, plan_paths, planner_options

SIZES = (15, 20, 25)
QUANTITIES = ("path length [m]", "breaking points", "danger points")
# Table 1, size: ((improved, traditional) of each quantity); a cell is 1 m. The paper's second row is headed
# "15*15" again; its text speaks of 15, 20 and 25.
PAPER_TABLE = {
    15: ((18.8283, 18.1421), (5, 7), (0, 5)),
    20: ((26.5173, 26.9406), (4, 11), (0, 7)),
    25: ((35.1453, 36.7990), (8, 10), (0, 7)),
}
NEGLIGIBLE = 1e-4  # [m], by which float32 lengths may differ that are equal
Progress = Callable[[int, int], None]  # (paths planned, of how many)


@dataclass(frozen=True)
class PlannedMaps:
    """Both planners on N maps."""

    suite: Suite
    improved: list[PlannedPath]  # N
    traditional: list[PlannedPath]  # N


def plan_maps(suite: Suite, progress: Progress | None = None) -> PlannedMaps:
    """Both planners on every map of a suite, from start to goal, the robot a point."""
    found: dict[str, list[PlannedPath]] = {"improved": [], "traditional": []}
    for planner, plans in found.items():
        options = planner_options(planner)  # pyright: ignore[reportArgumentType]
        for scenario in suite.scenarios:
            query = np.array([[scenario.start[:2], scenario.goal]])
            plans += plan_paths(scenario.grid, query, _constants(), options)
            if progress:
                progress(sum(map(len, found.values())), len(found) * len(suite.scenarios))
    return PlannedMaps(suite, found["improved"], found["traditional"])


def random_maps(share: float, seed: int, count: int, cells: int = 15) -> Suite:
    """Maps as those of `paper-15` of which another share of the cells is occupied."""
    key, spec = jax.random.key(seed), PaperSpec(cells=cells, density=share)
    drawn = tuple(generate(jax.random.fold_in(key, index), spec) for index in range(count))
    return Suite(f"{100 * share:g} % occupied", drawn, tuple(map(str, range(count))), {})


def measured(maps: PlannedMaps) -> dict[str, tuple[list[float], list[float]]]:
    """The quantities of Table 1, (improved, traditional), one value a map."""
    improved, traditional = maps.improved, maps.traditional
    return {
        QUANTITIES[0]: ([plan.key_point_length for plan in improved], [plan.length for plan in traditional]),
        QUANTITIES[1]: ([plan.measures["key_point_breaking_points"] for plan in improved],
                        [plan.measures["breaking_points"] for plan in traditional]),
        QUANTITIES[2]: ([plan.measures["key_point_danger_points"] for plan in improved],
                        [plan.measures["danger_points"] for plan in traditional]),
    }  # fmt: skip


def verdicts(maps: PlannedMaps) -> dict[str, tuple[float, float, float]]:
    """By quantity, the shares of the maps where the improved planner has less, as much and more."""
    shares = {}
    for quantity, (improved, traditional) in measured(maps).items():
        difference = np.array(improved, np.float64) - np.array(traditional, np.float64)
        less, more = float(np.mean(difference < -NEGLIGIBLE)), float(np.mean(difference > NEGLIGIBLE))
        shares[quantity] = less, 1.0 - less - more, more
    return shares


def _constants() -> Constants:
    """As the text has it, "the connecting line passes through an obstacle": a line, kept a tenth of a cell clear."""
    constants = paper().constants
    return replace(constants, behaviour=replace(constants.behaviour, clearance_margin=0.1))
