"""What is kept of the stages is what the planner did."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from adwa_jax.presets import extended, paper
from scenarios.generators import toy
from scenarios.suite import make_suite
from tuning.replay import replay
from tuning.stages import TERMS, densities, moment

DRAWN = toy.generate(jax.random.key(0), toy.ToySpec(drawing="S.##\n..#.\n...G"))


@pytest.fixture(scope="module")
def driven():
    return replay(make_suite("paper-15", 0, 1).scenarios[0], paper())


def test_density_counts_the_rectangle_from_the_cell_to_the_goal():
    found = densities(DRAWN, paper())
    goal_row, goal_column = (int(np.floor(value)) for value in np.asarray(DRAWN.goal)[::-1])
    occupied = np.asarray(DRAWN.grid.occupied)
    assert found.overall == pytest.approx(3 / 12)
    assert found.local.shape == found.weight.shape == (3, 4)
    for row in range(3):
        for column in range(4):
            rows = slice(min(row, goal_row), max(row, goal_row) + 1)
            columns = slice(min(column, goal_column), max(column, goal_column) + 1)
            assert found.local[row, column] == pytest.approx(occupied[rows, columns].mean())


def test_weight_is_that_of_eq_5():
    found = densities(DRAWN, paper())
    # The start's rectangle is the map: P = Q. The goal's is the goal alone: P = 0, hence γ = 1.2.
    start, goal = (tuple(np.floor(np.asarray(point)[:2])[::-1].astype(int)) for point in (DRAWN.start, DRAWN.goal))
    assert found.weight[start] == 1.0
    assert found.weight[goal] == pytest.approx(1.2)


def test_without_eq_5_the_weight_is_1():
    config = paper()
    plain = config._replace(options=replace(config.options, plan=replace(config.options.plan, scope="one")))
    assert (densities(DRAWN, plain).weight == 1.0).all()


@pytest.mark.parametrize("step", [0, 1, 80, 200])
def test_a_moment_decides_as_the_drive_did(driven, step):
    found = moment(driven, paper(), step)
    assert found.chosen is not None
    assert found.v[found.chosen[0]] == pytest.approx(float(driven.trace.robot.v[step]), abs=1e-5)
    assert found.yaw_rate[found.chosen[1]] == pytest.approx(float(driven.trace.robot.yaw_rate[step]), abs=1e-5)
    assert found.time == pytest.approx(0.1 * step, abs=1e-5)


def test_the_chosen_candidate_has_the_largest_score_and_terms_add_up_to_it(driven):
    found = moment(driven, paper(), 80)
    assert tuple(found.terms) == tuple(TERMS.values())
    assert 0 < found.admissible.sum() < found.admissible.size  # or nothing was to be seen
    assert found.score[found.chosen] == found.score[found.admissible].max()
    np.testing.assert_allclose(sum(found.terms.values())[found.admissible], found.score[found.admissible], atol=1e-6)


def test_arcs_begin_at_the_robot_and_the_first_step_of_the_chosen_one_is_the_drives(driven):
    found = moment(driven, paper(), 80)
    here = [float(found.robot.x), float(found.robot.y)]
    np.testing.assert_allclose(found.arcs[0], np.broadcast_to(here, found.arcs[0].shape))
    after = [float(driven.trace.robot.x[80]), float(driven.trace.robot.y[80])]
    np.testing.assert_allclose(found.arcs[1][found.chosen], after, atol=1e-5)


def test_movers_out_of_sight_are_not_there(driven):
    found = moment(driven, paper(), 0)
    apart = np.linalg.norm(np.asarray(driven.scenario.movers.position) - np.asarray(driven.scenario.start)[:2], axis=1)
    in_sight = apart - np.asarray(driven.scenario.movers.radius) <= 5.0
    assert np.isfinite(found.movers[0, : len(in_sight)]).all(axis=1).tolist() == in_sight.tolist()


@pytest.mark.parametrize("step", [-1, 10_000])
def test_a_step_that_was_not_driven_is_refused(driven, step):
    with pytest.raises(ValueError, match=rf"step: {step}; must be one that was driven, 0\.\.\d+"):
        moment(driven, paper(), step)


def test_rules_beyond_the_paper_are_refused(driven):
    with pytest.raises(ValueError, match="rules beyond the paper"):
        moment(driven, extended(), 0)
