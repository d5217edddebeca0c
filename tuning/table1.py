"""Table 1 of the paper over many maps: the improved and the traditional A* on each of them (§5.1)."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from adwa_jax.constants import Constants
from adwa_jax.presets import paper
from scenarios.suite import Suite, make_suite
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
Progress = Callable[[int, int], None]  # (paths planned, of how many)


@dataclass(frozen=True)
class PlannedMaps:
    """Both planners on N maps of one size."""

    size: int  # cells a side
    suite: Suite
    improved: list[PlannedPath]  # N
    traditional: list[PlannedPath]  # N


def plan_maps(size: int, seed: int, count: int, progress: Progress | None = None) -> PlannedMaps:
    """Both planners on the first `count` maps of the suite `paper-<size>`, from corner to corner."""
    suite = make_suite(f"paper-{size}", seed, count)
    found: dict[str, list[PlannedPath]] = {"improved": [], "traditional": []}
    for planner, plans in found.items():
        options = planner_options(planner)  # pyright: ignore[reportArgumentType]
        for scenario in suite.scenarios:
            query = np.array([[scenario.start[:2], scenario.goal]])
            plans += plan_paths(scenario.grid, query, _constants(), options)
            if progress:
                progress(sum(map(len, found.values())), len(found) * count)
    return PlannedMaps(size, suite, found["improved"], found["traditional"])


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


def _constants() -> Constants:
    """As the text has it, "the connecting line passes through an obstacle": a line, kept a tenth of a cell clear."""
    constants = paper().constants
    return replace(constants, behaviour=replace(constants.behaviour, clearance_margin=0.1))
