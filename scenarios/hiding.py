"""Worlds of which the robot has no map: it senses every obstacle itself."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from adwa_jax.scenario import Scenario
from scenarios.packing import map_of


def hide(scenario: Scenario) -> Scenario:
    """The scenario with nothing known: every occupied cell hidden, the robot's map free up to its border.

    Unbatched, padded or not; numpy leaves. Cells hidden before stay hidden. A `reference_length` of 0 then stands for
    the shortest path over the free map.
    """
    grid, before = scenario.grid, np.asarray(scenario.hidden)
    on_map = np.zeros(np.shape(grid.occupied), np.bool_)
    on_map[: int(grid.height), : int(grid.width)] = True
    occupied: Any = np.asarray(grid.occupied)
    hidden = occupied & on_map
    return replace(scenario, grid=replace(grid, occupied=occupied & ~on_map),
                   hidden=hidden | before if before.size else hidden)


def hide_all(scenarios: Sequence[Scenario]) -> tuple[Scenario, ...]:
    """`hide` for many scenarios; those that shared a map share what it becomes."""
    one_of_each = {map_of(scenario): scenario for scenario in scenarios}
    twins = {key: hide(scenario) for key, scenario in one_of_each.items()}
    return tuple(replace(scenario, grid=twins[map_of(scenario)].grid, hidden=twins[map_of(scenario)].hidden)
                 for scenario in scenarios)
