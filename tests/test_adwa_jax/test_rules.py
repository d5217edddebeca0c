"""The switches between the paper's method and the extended planner, and what each does to a decision."""

from dataclasses import fields, replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from adwa_jax.constants import Options
from adwa_jax.dwa import Guidance, candidate_profiles, decide
from adwa_jax.presets import extended, on_robot, paper, preset
from adwa_jax.route import ahead_of, route_through
from adwa_jax.rules import EVERY_RULE, RULE_NAMES, Rules
from adwa_jax.score import ScoreWeights
from tests.reference import beyond as reference
from tests.reference.prediction import Outline, Surroundings
from tests.test_adwa_jax.scenes import EMPTY, looked_up, random_scene, scene_field, scene_lattice, sensed, state
from tests.test_adwa_jax.worlds import counting

decided, traces = counting(decide, static_argnames="options")
profiles_of = jax.jit(candidate_profiles, static_argnames="options")


def differences(some, other):
    """Names of the switches that differ."""
    return {field.name for field in fields(Rules) if getattr(some, field.name) != getattr(other, field.name)}


# The switches.


def test_no_rule_is_the_paper():
    assert preset(Rules()) == paper()
    assert paper().options.rules == Rules()
    rules = EVERY_RULE
    for name in RULE_NAMES:
        rules = rules.without(name)
    assert preset(rules) == paper()


def test_every_rule_is_the_extended_preset():
    assert preset(EVERY_RULE) == extended()
    assert all(getattr(extended().options.rules, name) for name in RULE_NAMES)


@pytest.mark.parametrize("name", RULE_NAMES)
def test_each_rule_is_turned_on_and_off_alone(name):
    assert differences(preset(Rules().only(name)).options.rules, Rules()) == {name}
    assert differences(preset(EVERY_RULE.without(name)).options.rules, EVERY_RULE) == {name}


@pytest.mark.parametrize("change", [Rules().only, EVERY_RULE.without])
def test_unknown_rules_are_refused(change):
    with pytest.raises(ValueError, match="teleport"):
        change("teleport")


def test_options_tell_rules_apart():
    assert len({hash(Options(rules=Rules().only(name))) for name in RULE_NAMES}) == len(RULE_NAMES)


@pytest.mark.parametrize("name", ["second_phase", "border", "least_bad"])
def test_rules_without_constants_change_nothing_but_themselves(name):
    config = preset(Rules().only(name))
    assert config.constants == paper().constants
    assert replace(config.options, rules=Rules()) == paper().options


def test_planner_on_another_robot_by_hand():
    base = extended()
    robot = replace(base.constants.robot, radius=0.4, v_max=3.0, acceleration=4.0, yaw_acceleration=8.0, v_min=-0.3)
    config = on_robot(base, robot)
    margin = base.constants.behaviour.clearance_margin - base.constants.robot.radius
    assert config.constants.behaviour.clearance_margin == pytest.approx(0.4 + margin)
    assert config.constants.behaviour.lookahead == 2 * base.constants.behaviour.lookahead  # no more than twice
    assert config.options.dwa.halt_steps == 9  # 3 / 4 s are 7.5 steps, and one at speed
    assert config.constants.robot.v_min == -0.3
    assert on_robot(paper(), robot).constants.robot.v_min == 0.0
    assert on_robot(paper(), paper().constants.robot) == paper()
    turning = on_robot(base, replace(robot, v_max=0.1, yaw_rate_max=1.5, yaw_acceleration=1.0))
    assert turning.options.dwa.halt_steps == 16  # 1.5 s to stop turning
    assert turning.constants.behaviour.lookahead == base.constants.behaviour.lookahead / 2


# What they do to a decision.


def choose(rules, start, known=None, target=(11.0, 6.0), goal=(11.0, 6.0), field=EMPTY, ahead=None, constants=None):
    """A decision of the rules' preset."""
    config = preset(rules)
    guidance = Guidance(jnp.float32(target), jnp.float32(goal), ahead)
    return jax.device_get(decided(start, guidance, field, known or sensed(), constants or config.constants,
                                  options=config.options))


def test_constants_of_rules_that_are_off_change_no_bit_of_a_decision():
    constants = paper().constants
    odd = replace(
        constants,
        weights=replace(constants.weights, progress=9.0, on_route=8.0, contact_time=7.0, mover_clearance=6.0,
                        forward=5.0),
        behaviour=replace(constants.behaviour, static_margin=0.5, mover_margin=0.6, mover_growth=0.7, mover_cap=0.8,
                          lookahead=0.9, route_margin=1.0, lost_time=9.0),
    )  # fmt: skip
    for seed in range(8):
        _, start, known, seen, local, goal = random_scene(seed)
        scene = (state(*start), sensed(known, seen), local, goal, scene_field(seed))
        for found, plain in zip(jax.tree.leaves(choose(Rules(), *scene, constants=odd)),
                                jax.tree.leaves(choose(Rules(), *scene)), strict=True):
            np.testing.assert_array_equal(found, plain)


TOWARDS_WALL = sensed(squares=[((8.5, 6.0), 1.0)])  # its side is at x = 7.5


def test_rule_ramp_predicts_what_the_robot_can_come_to():
    # From rest the paper's fastest candidate is 0.2 m/s for ever; a ramp reaches 1 m/s within half a second.
    assert choose(Rules(), state(6, 6, 0)).candidates.terms.global_heading.shape == (11, 21)
    wall = sensed(squares=[((9.0, 6.0), 1.0)])
    found = choose(Rules().only("ramp"), state(6, 6, 0), wall)
    np.testing.assert_allclose(found.candidates.v[-1], 0.2, rtol=1e-5)
    config = preset(Rules().only("ramp"))
    steps = config.options.dwa.horizon_steps * config.options.dwa.stride
    reach = 0.1 * (0.2 + 0.4 + 0.6 + 0.8) + 0.1 * (steps - 4)  # 1 m/s from the fifth step on
    straight = config.options.dwa.yaw_rate_samples // 2
    assert found.candidates.clearance[-1, straight] == pytest.approx(2.0 - reach - 0.25, abs=1e-3)


def test_rule_second_phase_adds_candidates_that_change_their_mind():
    plain, more = choose(Rules(), state(6, 6, 0, 0.5)), choose(Rules().only("second_phase"), state(6, 6, 0, 0.5))
    assert (plain.candidates.v.size, plain.candidates.yaw_rate.size) == (11, 21)
    assert (more.candidates.v.size, more.candidates.yaw_rate.size) == (13, 61)
    np.testing.assert_allclose(more.candidates.clearance[:11, :21], plain.candidates.clearance, atol=1e-5)
    np.testing.assert_array_equal(more.candidates.admissible[:11, :21], plain.candidates.admissible)


def test_rule_reverse_backs_up_at_a_cost():
    found = choose(Rules().only("reverse"), state(6, 6, 0))
    back = found.candidates.v < -1e-6
    assert back.any()
    np.testing.assert_array_equal(found.candidates.terms.forward, np.broadcast_to(~back[:, None], (11, 21)))
    assert choose(Rules(), state(6, 6, 0)).candidates.terms.forward is None
    assert choose(Rules(), state(6, 6, 0)).candidates.v.min() == 0


def test_rule_stopping_admits_what_can_stop_before_a_wall():
    # 1 m/s, 1.25 m before the outline meets the wall: straight on it would be hit within the 2 s of the horizon.
    plain = choose(Rules(), state(6, 6, 0, 1.0), TOWARDS_WALL).candidates
    stopping = choose(Rules().only("stopping"), state(6, 6, 0, 1.0), TOWARDS_WALL).candidates
    assert not plain.admissible[:, 10].any()
    assert stopping.admissible[:, 10].all()
    # 0.3 m are needed to stop, and there are 0.29.
    near = choose(Rules().only("stopping"), state(6.96, 6, 0, 1.0), TOWARDS_WALL).candidates
    assert not near.admissible[-1, 10]
    assert near.admissible[0, 10]  # at 0.8 m/s at once: 0.2 m


def test_rule_long_watch_sees_who_comes_later():
    # Outlines are 2.5 m apart, nearing at 1 m/s: after the paper's horizon of 2 s.
    coming = sensed(movers=[((9.0, 6.0), (-1.0, 0.0), 0.25)])
    both = Rules(), Rules().only("long_watch")
    plain, watching = (choose(rules, state(6, 6, 0), coming).candidates for rules in both)
    assert plain.clearance[0, 10] == pytest.approx(0.5, abs=1e-5)
    config = preset(Rules().only("long_watch"))
    watched = 0.1 * (config.options.dwa.horizon_steps + config.options.dwa.watch_beyond)
    assert watched > 2.5
    assert watching.clearance[0, 10] == pytest.approx(2.5 - watched, abs=1e-4)
    assert plain.admissible[0, 10]
    assert not watching.admissible[0, 10]
    # Statics count to the horizon: 2 m ahead at most.
    wall = sensed(squares=[((9.25 + 1.0, 6.0), 1.0)])
    fast = [choose(rules, state(6, 6, 0, 1.0), wall).candidates for rules in both]
    np.testing.assert_allclose(fast[0].clearance, fast[1].clearance, atol=1e-5)


def test_rule_mover_terms_parts_movers_from_statics():
    coming = sensed(squares=[((6.0, 8.0), 1.0)], movers=[((7.75, 6.0), (-1.0, 0.0), 0.25)])
    found = choose(Rules().only("mover_terms"), state(6, 6, 0), coming).candidates
    assert found.clearance[0, 10] == pytest.approx(0.75, abs=1e-5)  # the square beside it
    assert found.terms.contact_time[0, 10] == pytest.approx(1.3)  # 1.25 m between the outlines
    assert found.terms.mover_clearance[0, 10] == 0
    assert not found.admissible[0, 10]
    plain = choose(Rules(), state(6, 6, 0), coming).candidates
    assert plain.terms.contact_time is plain.terms.mover_clearance is None
    assert plain.clearance[0, 10] == pytest.approx(0.05 - 0.5, abs=1e-5)  # after 1.7 and 1.8 s


def test_rule_mover_margin_keeps_away_from_movers():
    config = preset(Rules().only("mover_margin"))
    margin, growth = config.constants.behaviour.mover_margin, config.constants.behaviour.mover_growth
    assert min(margin, growth) > 0
    waiting = sensed(movers=[((7.0, 6.0), (0.0, 0.0), 0.25)])
    found = choose(Rules().only("mover_margin"), state(6, 6, 0), waiting).candidates
    assert found.clearance[0, 10] == pytest.approx(0.5 - margin - growth * 2.0, abs=1e-5)  # after 2 s
    assert choose(Rules(), state(6, 6, 0), waiting).candidates.clearance[0, 10] == pytest.approx(0.5, abs=1e-5)


def ahead(*points):
    return ahead_of(route_through(jnp.float32([*points, *[points[-1]] * (12 - len(points))]), jnp.int32(len(points))),
                    jnp.int32(1))


def test_rule_progress_rewards_the_way_along_the_route():
    # The target lies to the left, the route goes straight on.
    route = ahead((5.0, 6.0), (11.0, 6.0))
    found = choose(Rules().only("progress"), state(6, 6, 0, 0.5), target=(6.0, 9.0), ahead=route)
    terms = found.candidates.terms
    assert terms.velocity is terms.global_heading is None
    farthest = 1.0 * 2.0  # at full speed over the horizon
    np.testing.assert_allclose(terms.progress[:, 10], farthest + 2.0 * found.candidates.v, rtol=1e-5)
    np.testing.assert_allclose(terms.on_route[:, 10], farthest, rtol=1e-5)  # no nearer, no farther
    assert (terms.on_route[-1, [0, -1]] < farthest).all()
    assert terms.progress[-1].argmax() == 10
    # Without a route in hand eq. 9's terms stay.
    assert choose(Rules().only("progress"), state(6, 6, 0)).candidates.terms.progress is None


def test_rule_fixed_scale_divides_by_what_a_term_can_be_at_most():
    found = choose(Rules().only("fixed_scale"), state(6, 6, 0.3, 0.5)).candidates
    weights, constants = preset(Rules().only("fixed_scale")).constants.weights, paper().constants
    terms = found.terms
    expected = (weights.local_heading * terms.local_heading / np.pi
                + weights.clearance * terms.clearance / constants.behaviour.clearance_cap
                + weights.velocity * terms.velocity / constants.robot.v_max
                + weights.global_heading * terms.global_heading / np.pi)
    np.testing.assert_allclose(found.score, expected, rtol=1e-5)


def test_rule_least_bad_takes_what_postpones_the_contact():
    # In a box of squares nothing is admissible. The paper brakes; the least bad candidate has the most room.
    box = sensed(squares=[((6.0, 7.3), 1.0), ((6.0, 4.7), 1.0), ((7.3, 6.0), 1.0)])
    plain, least = (choose(rules, state(6.0, 6, 0, 0.6, 0.2), box) for rules in (Rules(), Rules().only("least_bad")))
    assert int(plain.index) == int(least.index) == -1
    assert float(plain.v) == pytest.approx(0.4)
    best = np.unravel_index(least.candidates.clearance.argmax(), least.candidates.clearance.shape)
    assert (float(least.v), float(least.yaw_rate)) == (least.candidates.v[best[0]], least.candidates.yaw_rate[best[1]])


def test_decisions_without_ramps_are_finite_and_within_the_limits():
    rules = EVERY_RULE.without("ramp")  # the mix whose candidates are the strangest
    constants, _ = preset(rules)
    robot, dt = constants.robot, constants.behaviour.dt
    for seed in (1, 5, 7):
        _, start, known, seen, local, goal = random_scene(seed)
        route = ahead(start[:2], goal)
        found = choose(rules, state(*start), sensed(known, seen), local, goal, scene_field(seed), route)
        assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(found))
        assert abs(float(found.v) - start[3]) <= robot.acceleration * dt + 1e-5
        assert abs(float(found.yaw_rate) - start[4]) <= robot.yaw_acceleration * dt + 1e-5
        for term in found.candidates.terms:
            assert term is None or term is found.candidates.terms.velocity or term.min() >= 0


# All of them together.

SMALL = replace(extended().options, dwa=replace(extended().options.dwa, v_samples=3, yaw_rate_samples=3))
IN_USE = ("local_heading", "clearance", "progress", "on_route", "contact_time", "mover_clearance", "forward")


def planner(constants, options):
    robot, behaviour, dwa = constants.robot, constants.behaviour, options.dwa
    return reference.Planner(
        dt=behaviour.dt, stride=dwa.stride, horizon=dwa.horizon_steps, halt_steps=dwa.halt_steps, v_max=robot.v_max,
        v_reach=robot.acceleration * behaviour.dt, yaw_reach=robot.yaw_acceleration * behaviour.dt,
        clearance_cap=behaviour.clearance_cap, mover_cap=behaviour.mover_cap, static_margin=behaviour.static_margin,
        weights={name: getattr(constants.weights, name) for name in IN_USE},
    )  # fmt: skip


def scene_with_squares(seed):
    """A random scene; in every sixth, squares hold the robot fast."""
    occupied, start, known, seen, local, goal = random_scene(seed)
    if seed % 6 == 5:
        known = [((start[0] + 0.3, start[1] - 0.1), 0.1), ((start[0] - 0.28, start[1] + 0.2), 0.1)]
    return occupied, start, known, seen, local, goal


def expected_candidates(seed, profiles, route, constants, options):
    """[V][N] candidates by the oracle."""
    _, start, known, seen, local, _ = scene_with_squares(seed)
    behaviour = constants.behaviour
    around = Surroundings(lambda x, y: looked_up(scene_lattice(seed), x, y), tuple(known), tuple(seen),
                          behaviour.mover_margin, behaviour.mover_growth)
    v, yaw_rate, v_ahead, yaw_ahead = (np.asarray(part, float) for part in profiles)
    return [[reference.candidate(start[:3], v[i], yaw_rate[j], v_ahead[:, i], yaw_ahead[:, j], route, local,
                                 Outline(constants.robot.radius), around, planner(constants, options))
             for j in range(yaw_rate.size)] for i in range(v.size)]  # fmt: skip


def test_extended_decisions_equal_the_oracle():
    constants, options = extended().constants, SMALL
    chosen, desperate = 0, 0
    for seed in range(18):
        _, start, known, seen, local, goal = scene_with_squares(seed)
        route = [(float(start[0]) - 0.3, float(start[1]) + 0.2), local, goal]
        profiles = jax.device_get(profiles_of(state(*start), constants, options=options))
        expected = expected_candidates(seed, profiles, route, constants, options)
        guidance = Guidance(jnp.float32(local), jnp.float32(goal), ahead(*route))
        found = jax.device_get(decided(state(*start), guidance, scene_field(seed), sensed(known, seen), constants,
                                       options=options))
        sure = True
        for (i, j), _ in np.ndenumerate(found.candidates.score):
            each = expected[i][j]
            if each.closest_call < 1e-4:
                sure = False
                continue
            assert found.candidates.admissible[i, j] == each.admissible
            for name in IN_USE:
                term = getattr(found.candidates.terms, name)[i, j]
                assert term == pytest.approx(each.terms[name], abs=2e-3), name
            assert found.candidates.score[i, j] == pytest.approx(each.score, abs=3e-3)
        if not sure:
            continue
        everything = [each for row in expected for each in row]
        width = profiles.yaw_rate.size
        if any(each.admissible for each in everything):
            chosen += 1
            best = max(each.score for each in everything if each.admissible)
            taken = everything[int(found.index)]
            assert taken.admissible
            assert taken.score > best - 3e-3
            index = int(found.index)
        else:
            desperate += 1
            assert int(found.index) == -1
            index = int(np.argmin([each.badness for each in everything]))
        assert float(found.v) == profiles.v[index // width]
        assert float(found.yaw_rate) == profiles.yaw_rate[index % width]
    assert chosen > 8
    assert desperate > 1


def test_changing_any_constant_of_the_extended_planner_does_not_retrace():
    start, guidance = state(6, 6, 0), Guidance(jnp.float32([9, 9]), jnp.float32([9, 9]), ahead((6, 6), (9, 9)))
    constants = extended().constants
    decided(start, guidance, EMPTY, sensed(), constants, options=SMALL)
    before = len(traces)
    leaves, tree = jax.tree.flatten(constants)
    for k, leaf in enumerate(leaves):
        changed = [*leaves[:k], leaf * 1.1, *leaves[k + 1 :]]
        decided(start, guidance, EMPTY, sensed(), jax.tree.unflatten(tree, changed), options=SMALL)
    assert len(traces) == before


def test_gradients_of_extended_scores_are_finite():
    constants, options = extended().constants, SMALL

    def total(weights, target, known, start):
        guidance = Guidance(target, target, ahead((5.0, 6.0), (9.0, 6.0)))
        found = decide(start, guidance, scene_field(2), known, replace(constants, weights=weights), options)
        return jnp.sum(jnp.where(found.candidates.admissible, found.candidates.score, 0.0)) + found.v + found.yaw_rate

    slopes = jax.jit(jax.grad(total, argnums=(0, 1)))
    weights = ScoreWeights(**{name: jnp.float32(value) for name, value in vars(constants.weights).items()})
    for place in ((5.4, 6.0), (5.0, 7.0), (0.0, 0.0)):  # on the route, in the square, in the map's corner
        for target, mover in (((9.0, 6.0), place), (place, (5.8, 6.2))):
            known = sensed([((5.0, 7.0), 0.4)], [(mover, (0.1, 0.0), 0.2)])
            found = slopes(weights, jnp.float32(target), known, state(*place, 0.3, 0.5, 0.1))
            assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(found))
