"""The relaxed decision and drive: the hard one in the limit, right gradients, and no NaN anywhere."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from adwa_jax.constants import Constants, DwaOptions, Options, PlanOptions
from adwa_jax.dwa import Guidance, decide
from adwa_jax.episode import Outcome
from adwa_jax.lanes import Task
from adwa_jax.plan import plan
from adwa_jax.presets import paper
from adwa_jax.relaxed import Softness, relaxed_decide, soft_minimum
from adwa_jax.relaxed_drive import Loss, Stretch, recorded, stretch_loss
from scenarios.padding import pad, padded_shape
from tests.test_adwa_jax.scenes import EMPTY, SUBDIVISION, field_of, random_scene, scene_field, sensed, state
from tests.test_adwa_jax.worlds import grid_of
from tests.test_tuning.worlds import OPEN, drawn

OPTIONS = Options(plan=PlanOptions(subdivision=2), dwa=DwaOptions(v_samples=5, yaw_rate_samples=7, horizon_steps=6))
NAMES = ("local_heading", "clearance", "velocity", "global_heading")
CONSTANTS: Constants = jax.tree.map(jnp.float32, paper().constants)
SOFT, SHARP = Softness(jnp.float32(0.03), jnp.float32(0.02)), Softness(jnp.float32(1e-6), jnp.float32(1e-6))
WALLED = field_of(grid_of(np.ones((12, 12), bool)), subdivision=SUBDIVISION)

hard = jax.jit(decide, static_argnames="options")
relaxed = jax.jit(relaxed_decide, static_argnames=("options", "variant"))


def guidance(local, goal=(11.0, 6.0)):
    return Guidance(jnp.float32(local), jnp.float32(goal))


def moment(seed):
    _, start, known, seen, local, goal = random_scene(seed)
    return state(*start), guidance(local, goal), scene_field(seed), sensed(known, seen)


def with_weights(values) -> Constants:
    return replace(CONSTANTS, weights=replace(CONSTANTS.weights, **dict(zip(NAMES, values, strict=True))))


def with_cap(cap) -> Constants:
    return replace(CONSTANTS, behaviour=replace(CONSTANTS.behaviour, clearance_cap=cap))


def test_without_softness_the_command_is_the_hard_one():
    same = 0
    for seed in range(24):
        here = moment(seed)
        command = hard(*here, CONSTANTS, options=OPTIONS)
        soft = relaxed(*here, CONSTANTS, SHARP, options=OPTIONS, variant="smooth")
        score = np.where(command.candidates.admissible, command.candidates.score, -np.inf).ravel()
        best = np.sort(score)[-2:]
        if command.index >= 0 and best[1] - best[0] > 1e-6:  # no tie
            same += 1
            np.testing.assert_allclose([soft.v, soft.yaw_rate], [command.v, command.yaw_rate], atol=1e-4)
    assert same >= 8


def test_with_much_softness_all_candidates_share_alike():
    alone = relaxed(state(6.0, 6.0, 0.0, 0.5), guidance((11.0, 6.0)), EMPTY, sensed(), CONSTANTS,
                    Softness(jnp.float32(1e6), jnp.float32(0.05)), options=OPTIONS, variant="smooth")
    np.testing.assert_allclose(alone.share, np.full((5, 7), 1 / 35), rtol=1e-3)
    np.testing.assert_allclose([alone.v, alone.yaw_rate], [0.5, 0.0], atol=1e-3)  # middle of the window


def test_straight_through_commands_the_hard_choice_and_has_the_gradient_of_the_mean():
    here = moment(3)

    def speed(weights, variant):
        return relaxed_decide(*here, with_weights(weights), SOFT, OPTIONS, variant).v

    weights = jnp.array([0.8, 0.3, 0.8, 0.1])
    through = jax.jit(jax.value_and_grad(lambda w: speed(w, "straight_through")))(weights)
    smooth = jax.jit(jax.value_and_grad(lambda w: speed(w, "smooth")))(weights)
    assert through[0] == hard(*here, with_weights(weights), options=OPTIONS).v
    assert through[0] != smooth[0]
    np.testing.assert_allclose(through[1], smooth[1], rtol=1e-4, atol=1e-6)
    assert np.abs(smooth[1]).max() > 0


def test_scaling_all_weights_changes_nothing():
    here = moment(3)
    one = relaxed(*here, with_weights((0.8, 0.3, 0.8, 0.1)), SOFT, options=OPTIONS, variant="smooth")
    ten = relaxed(*here, with_weights((8.0, 3.0, 8.0, 1.0)), SOFT, options=OPTIONS, variant="smooth")
    np.testing.assert_allclose(one.share, ten.share, rtol=1e-3, atol=1e-6)


def test_a_soft_minimum_is_below_the_minimum_by_its_softness_at_most():
    assert float(soft_minimum(jnp.float32(2.0), 2.0, 0.1)) == pytest.approx(2.0 - 0.1 * np.log(2.0))
    assert float(soft_minimum(jnp.float32(5.0), 1.0, 0.1)) == pytest.approx(1.0)


@pytest.mark.parametrize(("field", "movers", "place", "weights"), [
    (EMPTY, (), (6.0, 6.0), (0.8, 0.3, 0.8, 0.1)),  # nothing about
    (EMPTY, [((6.0, 6.0), (0.0, 0.0), 1.0)], (6.0, 6.0), (0.8, 0.3, 0.8, 0.1)),  # in the middle of a mover
    (WALLED, (), (6.0, 6.0), (0.8, 0.3, 0.8, 0.1)),  # no candidate is admissible
    (EMPTY, (), (11.0, 6.0), (0.8, 0.3, 0.8, 0.1)),  # on the goal
    (EMPTY, (), (6.0, 6.0), (0.0, 0.0, 0.0, 0.0)),  # all candidates score alike
])  # fmt: skip
def test_degenerate_scenes_have_finite_gradients(field, movers, place, weights):
    slopes = decision_slopes(jnp.float32(weights), jnp.float32(0.5), state(*place, 0.0), field, sensed((), movers))
    assert all(np.isfinite(slope).all() for slope in slopes)


@jax.jit
def decision_slopes(weights, cap, robot, field, known):
    def command(weights, cap, robot):
        constants = replace(with_cap(cap), weights=with_weights(weights).weights)
        decision = relaxed_decide(robot, guidance((11.0, 6.0)), field, known, constants, SOFT, OPTIONS, "smooth")
        return decision.v + decision.yaw_rate

    weights_slope, cap_slope, robot_slope = jax.grad(command, (0, 1, 2))(weights, cap, robot)
    return weights_slope, cap_slope, *robot_slope


def open_world():
    scenario = drawn(OPEN, 20.0)
    return pad(scenario, padded_shape(scenario))


WORLD = open_world()
PLAN = jax.jit(lambda: plan(WORLD.grid, jnp.asarray(WORLD.start[:2]), jnp.asarray(WORLD.goal), CONSTANTS,
                            OPTIONS.plan))()  # fmt: skip
TASKS = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], Task(WORLD, PLAN, CONSTANTS))
WAY = jax.jit(lambda: recorded(TASKS, OPTIONS, 20, 5))()


def start(row):
    return jax.tree.map(lambda leaf: leaf[0, row], WAY)


@jax.jit
def losses(constants, begin):
    """Smooth; the past reaches through all steps."""
    value, parts = stretch_loss(begin, WORLD, PLAN, constants, SOFT, Loss(), OPTIONS, Stretch(5, 5, "smooth"))
    return value, parts


loss_slopes = jax.jit(jax.grad(lambda weights, cap, begin: losses(
    replace(with_cap(cap), weights=with_weights(weights).weights), begin)[0], (0, 1)))  # fmt: skip


def test_starts_lie_on_the_hard_episode():
    assert WAY.state.step[0, :2].tolist() == [0, 20]
    assert WAY.state.outcome[0, -1] == Outcome.REACHED


def test_slopes_are_those_of_finite_differences():
    weights, cap, step = np.float32([0.8, 0.3, 0.8, 0.1]), np.float32(0.5), 3e-3
    slope, cap_slope = loss_slopes(jnp.asarray(weights), jnp.asarray(cap), start(0))

    def value(weights, cap):
        return float(losses(replace(with_cap(jnp.float32(cap)), weights=with_weights(jnp.float32(weights)).weights),
                            start(0))[0])

    for index in range(4):
        change = np.eye(4)[index] * step
        expected = (value(weights + change, cap) - value(weights - change, cap)) / (2 * step)
        assert float(slope[index]) == pytest.approx(expected, rel=0.05, abs=2e-3)
    expected = (value(weights, cap + step) - value(weights, cap - step)) / (2 * step)
    assert float(cap_slope) == pytest.approx(expected, rel=0.05, abs=2e-3)
    assert np.abs(slope).max() > 0.02  # or the differences above would prove nothing


def test_an_episode_that_has_ended_costs_nothing():
    value, parts = losses(CONSTANTS, start(-1))
    assert float(value) == 0.0
    assert [float(part) for part in parts] == [0.0] * 5
    assert not np.any(loss_slopes(jnp.float32([0.8, 0.3, 0.8, 0.1]), jnp.float32(0.5), start(-1))[0])


def test_a_robot_that_stands_makes_no_progress():
    standing = replace(CONSTANTS, robot=replace(CONSTANTS.robot, v_max=jnp.float32(1e-6)))
    moving, still = losses(CONSTANTS, start(1))[1], losses(standing, start(0))[1]
    assert float(moving.progress) < 0.6
    assert float(still.finish) == pytest.approx(1.0, abs=1e-3)


def test_stretches_refuse_nonsense():
    with pytest.raises(ValueError, match="variant"):
        Stretch(variant="hard")  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="steps"):
        Stretch(steps=0)


