import numpy as np
import pytest

from adwa_jax.astar import Status
from adwa_jax.metrics import PlannedMeasures
from scenarios.suite import Suite
from tuning.planning import PlannedPath
from tuning.table1 import QUANTITIES, PlannedMaps, measured, plan_maps, random_maps, verdicts

NOTHING = np.zeros((0, 2), np.float32)


def planned(length, breaking, danger, *, key_points):
    """A path of which only the grid path's figures count, or only the key points'."""
    kind = "key_point_" if key_points else ""
    measures = dict.fromkeys(PlannedMeasures._fields, 99) | {f"{kind}breaking_points": breaking,
                                                             f"{kind}danger_points": danger}  # fmt: skip
    lengths = (99.0, length) if key_points else (length, 99.0)
    return PlannedPath((0, 0), (1, 1), Status.FOUND, lengths[0], 9, measures, NOTHING, NOTHING, lengths[1])


IMPROVED = [planned(*figures, key_points=True) for figures in ((9.0, 2, 0), (12.0, 3, 0), (10.0, 3, 0), (8.0, 1, 0))]
TRADITIONAL = [planned(*figures, key_points=False)
               for figures in ((10.0, 2, 3), (10.0, 1, 0), (10.00001, 4, 1), (10.0, 2, 2))]  # fmt: skip
MAPS = PlannedMaps(Suite("four", (), (), {}), IMPROVED, TRADITIONAL)


def test_the_improved_planners_key_points_stand_beside_the_traditional_ones_grid_path():
    found = measured(MAPS)
    assert found[QUANTITIES[0]] == ([9.0, 12.0, 10.0, 8.0], [10.0, 10.0, 10.00001, 10.0])
    assert found[QUANTITIES[1]] == ([2, 3, 3, 1], [2, 1, 4, 2])
    assert found[QUANTITIES[2]] == ([0, 0, 0, 0], [3, 0, 1, 2])


def test_verdicts_are_shares_of_the_maps_with_less_as_much_and_more():
    found = verdicts(MAPS)
    assert found[QUANTITIES[0]] == pytest.approx((0.5, 0.25, 0.25))  # a hundredth of a millimetre is no difference
    assert found[QUANTITIES[1]] == pytest.approx((0.5, 0.25, 0.25))
    assert found[QUANTITIES[2]] == pytest.approx((0.75, 0.25, 0.0))


def test_maps_are_planned_by_both_and_only_the_traditional_planner_cuts_corners():
    done = []
    maps = plan_maps(random_maps(0.3, seed=1, count=3), lambda count, of: done.append((count, of)))
    assert done == [(count, 6) for count in range(1, 7)]
    assert [len(plans) for plans in (maps.improved, maps.traditional)] == [3, 3]
    found = measured(maps)[QUANTITIES[2]]
    assert sum(found[0]) == 0 < sum(found[1])


def test_random_maps_are_as_full_as_they_should_be():
    maps = random_maps(0.3, seed=1, count=20)
    assert maps.name == "30 % occupied"
    occupied = np.stack([np.asarray(scenario.grid.occupied) for scenario in maps.scenarios])
    assert occupied.shape == (20, 15, 15)
    assert abs(occupied.mean() - 0.3) < 0.04  # four standard deviations are 0.027; solvable maps are emptier
