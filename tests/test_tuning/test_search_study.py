import jax
import numpy as np
import pytest

from adwa_jax.heuristic_weight import WeightRule
from scenarios.generators import toy
from scenarios.suite import Suite, make_suite
from tests.test_tuning.worlds import WALLED_GOAL
from tuning.planning import path_length, plan_paths, planner_constants, planner_options
from tuning.search_study import SHAPES, Searches, Weighting, search_all, search_one, tradeoffs

SUITE = make_suite("paper-15", 3, 5)
BY_CELL = SHAPES["eq. 5, each cell's rectangle"]


def planned(planner):
    """As the planner finds them, one map after another."""
    return [next(plan_paths(scenario.grid, np.array([[scenario.start[:2], scenario.goal]]), planner_constants(),
                            planner_options(planner))) for scenario in SUITE.scenarios]  # fmt: skip


@pytest.mark.parametrize(("weighting", "planner"), [(BY_CELL, "improved"), (Weighting(0.0), "dijkstra")])
def test_searches_are_those_of_the_planner(weighting, planner):
    found = search_all(SUITE, {"some": weighting})["some"]
    np.testing.assert_allclose(found.length, [plan.length for plan in planned(planner)], rtol=1e-6)
    if planner == "improved":  # Dijkstra breaks ties otherwise: there h is 0, here ω
        assert found.expansions.tolist() == [plan.expansions for plan in planned(planner)]


def test_one_search_is_that_of_the_suite():
    searches = search_all(SUITE, {"some": BY_CELL})["some"]
    found = search_one(SUITE.scenarios[2], BY_CELL)
    assert int(found.expansions) == searches.expansions[2] == (found.expanded_at >= 0).sum()
    assert path_length(found) == pytest.approx(searches.length[2])


def test_of_the_starts_rectangle_eq_5_makes_1_in_opposite_corners():
    found = search_all(SUITE, {"start": SHAPES["eq. 5, start's rectangle"], "one": Weighting(1.0)})
    assert found["start"].expansions.tolist() == found["one"].expansions.tolist()


def test_a_larger_weight_searches_less_and_finds_no_shorter_path():
    found = search_all(SUITE, {name: Weighting(float(name)) for name in ("0", "1", "3")})
    assert found["0"].expansions.sum() > found["1"].expansions.sum() > found["3"].expansions.sum()
    np.testing.assert_allclose(found["0"].length, found["1"].length)
    assert (found["3"].length >= found["1"].length - 1e-9).all()


def test_a_tradeoff_is_the_mean_of_the_maps_ratios():
    found = Searches(np.array([5, 30]), np.array([10.0, 22.0]))
    (only,) = tradeoffs({"only": found}, Searches(np.array([10, 20]), np.array([10.0, 20.0]))).values()
    assert only.expansions[0] == pytest.approx((0.5 + 1.5) / 2)
    assert only.length[0] == pytest.approx((1.0 + 1.1) / 2)
    assert (only.fewer, only.longer) == (0.5, 0.5)


def test_a_map_without_a_path_is_refused():
    walled = Suite("walled", (toy.generate(jax.random.key(0), toy.ToySpec(drawing=WALLED_GOAL)),), ("here",), {})
    with pytest.raises(ValueError, match="walled: scenario here: UNREACHABLE; every map must have a path"):
        search_all(walled, {"one": Weighting(1.0)})


@pytest.mark.parametrize("weight", [-0.1, 17.0, float("nan")])
def test_a_weight_that_the_search_cannot_hold_is_refused(weight):
    with pytest.raises(ValueError, match=rf"weight: {weight}; must be in \[0, 16\]"):
        Weighting(weight)


def test_the_shapes_keep_eq_5s_promise():
    for shape in SHAPES.values():
        assert isinstance(shape.rule, WeightRule)  # which refuses others
