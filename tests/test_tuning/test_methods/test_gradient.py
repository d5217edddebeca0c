"""The gradient method on a made-up objective: descent, budget, what it remembers, and replay."""

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from adwa_jax.presets import paper
from scenarios.errors import InputError
from scenarios.suite import make_suite
from tests.test_tuning.worlds import brief
from tuning.methods.gradient import Settings, gradient, loss_weights, planned_slopes, starts_of
from tuning.methods.method import Problem, computed_anew
from tuning.objectives import Goals, Scores, Statistic
from tuning.planned_losses import planned_measures
from tuning.space import Parameter, Space

BASE = paper()
SMALL = BASE._replace(options=replace(BASE.options, dwa=replace(BASE.options.dwa, v_samples=3, yaw_rate_samples=5,
                                                               horizon_steps=4)))  # fmt: skip
SUITE = make_suite("paper-15", 5, 3)
SUITE = replace(SUITE, scenarios=tuple(brief(scenario, 4.0) for scenario in SUITE.scenarios))
SPACE = Space((Parameter("clearance", 0.01, 1.0, "log"), Parameter("velocity", 0.0, 1.0),
               Parameter("v_samples", 2, 5, "integer")), SMALL)  # fmt: skip
GOALS = Goals((Statistic("success", "max"), Statistic("length_ratio", "min")))
SETTINGS = {"starts": 2, "steps": 2, "scenarios": 2, "stretch": 4, "truncate": 2, "stretches": 2, "every": 10,
            "es_pairs": 2, "resamples": 20}  # fmt: skip
ROUND = 2 * (2 * 2 + 2 + 3)  # starts · (probes + optax steps + points along the hard gradient)


def problem(remember=computed_anew, candidates=2 + 2 * ROUND, **settings):
    return Problem(SPACE, GOALS, 7, candidates, SUITE, {**SETTINGS, **settings}, remember)


def test_a_budget_that_pays_for_no_round_is_refused():
    with pytest.raises(InputError, match=f"pays for {1 + ROUND} candidates; 2 starts and a .* need {2 + ROUND}; raise"):
        next(gradient(problem(candidates=1 + ROUND)))


def bowl(points):
    """Both objectives are least at (0.7, 0.2)."""
    apart = (points[:, 0] - 0.7) ** 2 + (points[:, 1] - 0.2) ** 2
    return Scores(np.stack([apart - 1.0, 2.0 * apart], axis=1), np.zeros(len(points)))


def driven(problem):
    """All generations."""
    search, generations = gradient(problem), []
    points = next(search)
    while True:
        generations.append(points)
        try:
            points = search.send(bowl(points))
        except StopIteration:
            return generations


@pytest.fixture(scope="module")
def kept():
    return {}


@pytest.fixture(scope="module")
def generations(kept):
    def remember(key, compute):
        assert key not in kept
        return kept.setdefault(key, compute())

    return driven(problem(remember))


def test_a_round_is_probes_and_proposals_while_the_budget_pays(generations):
    assert [len(points) for points in generations] == [2, 8, 10, 8, 10]
    assert all(((points >= 0) & (points <= 1)).all() for points in generations)


def test_integer_parameters_keep_the_base_value(generations):
    counts = [SPACE.values(points)[:, 2] for points in generations]
    assert np.unique(np.concatenate(counts)).tolist() == [3.0]


def test_every_start_gets_better(generations):
    def least(points):
        return bowl(points).objectives[:, 1].reshape(2, -1).min(axis=1)

    assert (least(generations[4]) < 0.5 * least(generations[0])).all()


def test_what_is_remembered_is_not_computed_again_and_gives_the_same_bits(generations, kept):
    def remembered(key, _):
        return kept[key]

    again = driven(problem(remembered))
    assert [points.tobytes() for points in again] == [points.tobytes() for points in generations]


def test_the_relaxed_steps_are_the_same_bits_when_computed_again(generations):
    again = driven(problem(candidates=2 + ROUND))
    assert [points.tobytes() for points in again] == [points.tobytes() for points in generations[:3]]


def test_the_agreement_has_a_row_a_start_and_a_column_a_parameter(generations, kept):
    found = kept["agreement"]
    assert found["surrogate"].shape == found["hard"].shape == found["sign_agreement"].shape == (2, 3)
    assert found["informed"].tolist() == [True, True, False]
    assert np.isnan(found["sign_agreement"]).tolist() == [[False, False, True]] * 2
    assert np.abs(found["surrogate"][:, :2]).max() > 0
    assert (found["surrogate"][:, 2] == 0).all()
    assert (found["cosine_low"] <= found["cosine_high"]).all()
    # Two pairs tell the two free parameters of the bowl apart: its gradient points away from (0.7, 0.2).
    away = found["points"][:, :2] - np.array([0.7, 0.2])
    inside = np.all((found["points"][:, :2] > 0.1) & (found["points"][:, :2] < 0.9), axis=1)
    assert inside.any()
    for row in np.flatnonzero(inside):
        hard = found["hard"][row, :2]
        assert hard @ away[row] / np.linalg.norm(hard) / np.linalg.norm(away[row]) == pytest.approx(1.0, abs=1e-6)


def test_starts_have_weights_that_sum_to_one_the_first_equal_ones():
    points, weights = starts_of(problem(starts=5), Settings(starts=5), np.array([True, True, False]))
    assert points.shape == (5, 3)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    np.testing.assert_allclose(weights[0], 0.5)
    assert (weights >= 0.25).all()


def test_loss_weights_follow_the_objectives():
    goals = Goals((Statistic("length_ratio", "min"), Statistic("breaking_points", "min")))
    # progress, length, clearance, turning, finish: (1, 0.8, 0, 0, 1) and (1, 0, 0, 0.8, 1), over 2.8
    np.testing.assert_allclose(loss_weights(goals, np.array([[0.75, 0.25]])),
                               np.array([[1.0, 0.6, 0.0, 0.2, 1.0]]) / 2.8)  # fmt: skip
    unknown = Goals((Statistic("expansions", "min"),))
    np.testing.assert_allclose(loss_weights(unknown, np.array([[1.0]])), np.full((1, 5), 0.2))


def test_eq5_gets_a_slope_from_planned_paths_where_it_changes_them():
    space = Space((Parameter("clearance", 0.0, 1.0), Parameter("sparse_base", 1.0, 8.0)), SMALL)
    goals = Goals((Statistic("expansions", "min"),))
    slopes = planned_slopes(space, goals, np.array([0.5, 0.2]), np.array([1.0]), list(SUITE.scenarios), 4, 0.15,
                            np.random.default_rng(0))  # fmt: skip
    assert slopes.shape == (3, 2)
    assert (slopes[:, 0] == 0).all()
    few, many = planned_measures(space, np.array([[0.5, 0.1], [0.5, 0.3]]), SUITE.scenarios)["expansions"]
    assert (few < many).all()  # ω above 1 in sparse cells alone draws the search away from them
    assert (slopes[:, 1] > 0).all()


def test_nothing_but_integers_is_refused():
    space = Space((Parameter("v_samples", 2, 5, "integer"),), SMALL)
    with pytest.raises(InputError, match="no gradient"):
        next(gradient(replace(problem(), space=space)))


def test_unknown_settings_are_refused():
    with pytest.raises(ValidationError, match="momentum"):
        Settings(momentum=0.9)  # pyright: ignore[reportCallIssue]
