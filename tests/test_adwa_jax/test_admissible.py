"""Which commands leave the robot a way to stop: against the oracle, and from one step to the next."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from adwa_jax.admissible import halts_clear
from adwa_jax.dwa import Guidance, candidate_profiles, decide
from adwa_jax.prediction import clearance_now
from adwa_jax.presets import extended, paper, preset
from adwa_jax.profiles import Profiles
from adwa_jax.rollout import Pose, RobotState, euler_step
from adwa_jax.rules import EVERY_RULE
from tests.reference import prediction as reference
from tests.test_adwa_jax.scenes import (
    EMPTY,
    looked_up,
    random_scene,
    scene_field,
    scene_lattice,
    sensed,
    state,
)

DT = 0.1
STEPS = 6  # from 1 m/s and 1.5 rad/s to rest at 2 m/s² and 6 rad/s²
DISC = extended().constants.robot
ROD = replace(DISC, radius=0.2, disc_offsets=(-0.25, 0.0, 0.4))
PLAIN = replace(paper().constants.behaviour, dt=DT)
WARY = replace(PLAIN, mover_margin=0.1, mover_growth=0.2)

halts = jax.jit(halts_clear, static_argnames=("steps", "growing_margin"))


def asked(v, yaw_rate):
    """Profiles of which only the commands matter."""
    v, yaw_rate = jnp.float32(v), jnp.float32(yaw_rate)
    return Profiles(v, yaw_rate, jnp.zeros((1, *v.shape)), jnp.zeros((1, *yaw_rate.shape)))


def halt(start, v, yaw_rate, known, robot=DISC, behaviour=PLAIN, room=0.0, field=EMPTY):
    return jax.device_get(halts(start, asked(v, yaw_rate), field, known, robot, behaviour, STEPS, behaviour is WARY,
                                jnp.float32(room)))


def test_room_to_stop_by_hand():
    # One step of 0.1 m at 1 m/s, then at 0.8, 0.6, 0.4, 0.2 and 0: 0.3 m. The outline is 0.31 m from the side.
    wall = sensed(squares=[((7.56, 6.0), 1.0)])
    found = halt(state(6, 6, 0, 1.0), [1.0, 0.9, -0.4, 0.0], [0.0] * 5, wall)
    np.testing.assert_allclose(found.static[:, 0], [0.01, 0.06, 0.35, 0.31], atol=1e-5)
    np.testing.assert_array_equal(found.clear_of_statics[:, 0], [True] * 4)
    nearer = halt(state(6, 6, 0, 1.0), [1.0, 0.9, -0.4, 0.0], [0.0] * 5, wall, room=0.05)
    np.testing.assert_array_equal(nearer.clear_of_statics[:, 0], [False, True, True, True])
    assert (found.moving > 1e4).all()


def test_mover_is_met_where_the_braking_robot_is():
    # Standing, with a mover that comes from 1 m away at 1 m/s: after 0.6 s it is 0.4 m away; 0.1 + 0.2 · 0.6 of margin.
    coming = sensed(movers=[((7.35, 6.0), (-1.0, 0.0), 0.1)])
    found = halt(state(6, 6, 0), [0.0] * 4, [0.0] * 5, coming)
    assert found.moving[0, 0] == pytest.approx(0.4, abs=1e-5)
    wary = halt(state(6, 6, 0), [0.0] * 4, [0.0] * 5, coming, behaviour=WARY)
    assert wary.moving[0, 0] == pytest.approx(0.4 - 0.22, abs=1e-5)


@pytest.mark.parametrize(("robot", "behaviour", "room"), [(DISC, PLAIN, 0.1), (ROD, WARY, 0.1)], ids=["disc", "rod"])
def test_braking_equals_the_oracle(robot, behaviour, room):
    clear = 0
    for seed in range(12):
        _, start, known, seen, _, _ = random_scene(seed)
        random = np.random.default_rng(seed)
        v, yaw_rate = random.uniform(-0.4, 1.0, 4), random.uniform(-1.5, 1.5, 5)
        found = halt(state(*start), v, yaw_rate, sensed(known, seen), robot, behaviour, room, scene_field(seed))
        around = reference.Surroundings(lambda x, y, seed=seed: looked_up(scene_lattice(seed), x, y), tuple(known),
                                        tuple(seen), behaviour.mover_margin, behaviour.mover_growth)
        outline = reference.Outline(robot.radius, robot.disc_offsets)
        for i, j in np.ndindex(4, 5):
            profile = reference.braking(v[i], yaw_rate[j], 2.0 * DT, 6.0 * DT, STEPS)
            expected = reference.outlook(start[:3], *profile, STEPS, DT, 1, outline, around)
            assert found.static[i, j] == pytest.approx(expected.static, abs=5e-5)
            assert found.moving[i, j] == pytest.approx(expected.moving, abs=5e-5, rel=1e-6)
            if abs(expected.static - room) > 1e-4:
                assert found.clear_of_statics[i, j] == (expected.static > room)
            clear += bool(found.clear_of_statics[i, j])
    assert 60 < clear < 220


def rooms(start, field, known, robot, behaviour):
    """What `decide` asks for [m]: the margin, or less where the robot is too near for that already."""
    return min(behaviour.static_margin, 0.5 * float(clearance_now(start, field, known, robot)))


def test_one_who_takes_an_admissible_command_may_go_on_braking():
    # The next step's braking is the rest of this one's: as far from all statics, whatever was commanded.
    constants, options = extended()
    constants, robot = replace(constants, robot=ROD), ROD
    behaviour, margin, taken = constants.behaviour, constants.behaviour.static_margin, 0
    profiles_of = jax.jit(candidate_profiles, static_argnames="options")
    for seed in range(10):
        _, start, known, _, _, _ = random_scene(seed)
        here, field, around = state(*start), scene_field(seed), sensed(known)
        if float(clearance_now(here, field, around, robot)) < 2 * margin:
            continue
        profiles = profiles_of(here, constants, options=options)
        found = halts(here, profiles, field, around, robot, behaviour, STEPS, False, jnp.float32(margin))
        for i, j in np.argwhere(found.clear_of_statics)[::17]:
            v, yaw_rate = profiles.v[i], profiles.yaw_rate[j]
            there = euler_step(Pose(*here[:3]), v, yaw_rate, DT)
            (_, slower), (_, straighter) = reference.braking(float(v), float(yaw_rate), 2.0 * DT, 6.0 * DT, 2)
            again = halt(RobotState(*there, v, yaw_rate), [slower] * 4, [straighter] * 5, around, robot, behaviour,
                         margin, field)
            assert again.static[0, 0] >= found.static[i, j] - 1e-5
            assert again.static[0, 0] > margin - 1e-5
            taken += 1
    assert taken > 30


def test_command_whose_braking_hits_a_square_is_never_taken_and_one_is_found_if_there_is_any():
    decided = jax.jit(decide, static_argnames="options")
    constants, options = preset(EVERY_RULE.without("progress"))  # there is no route here
    chosen = 0
    for seed in range(20):
        _, start, known, seen, local, goal = random_scene(seed)
        here, field, around = state(*start), scene_field(seed), sensed(known, seen)
        guidance = Guidance(jnp.float32(local), jnp.float32(goal))
        found = decided(here, guidance, field, around, constants, options=options)
        room = rooms(here, field, around, constants.robot, constants.behaviour)
        stop = halt(here, [float(found.v)] * 4, [float(found.yaw_rate)] * 5, around, constants.robot,
                    constants.behaviour, room, field)
        if int(found.index) >= 0:
            chosen += 1
            assert stop.static[0, 0] > room - 1e-5
        assert bool(found.candidates.admissible.any()) == (int(found.index) >= 0)
    assert chosen > 10
