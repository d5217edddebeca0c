"""Trajectory rollout against a candidate-by-candidate oracle and by hand."""

import math
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from adwa_jax.prediction import clearance_now, predict
from adwa_jax.presets import paper
from adwa_jax.profiles import Profiles
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
HORIZON, WATCH = 5, 8  # K = 8: movers are watched for longer than the statics
DISC = replace(paper().constants.robot, radius=0.25)
ROD = replace(DISC, radius=0.2, disc_offsets=(-0.25, 0.0, 0.4))
PLAIN = replace(paper().constants.behaviour, dt=DT)
WARY = replace(PLAIN, mover_margin=0.1, mover_growth=0.2)

predicted = jax.jit(predict, static_argnames=("horizon", "stride", "growing_margin"))
now = jax.jit(clearance_now)


def outline(robot):
    return reference.Outline(robot.radius, robot.disc_offsets)


def random_profiles(seed, steps=WATCH):
    """Any velocities whatever: V = 4 speed profiles and N = 5 of yaw rates, in reverse too."""
    random = np.random.default_rng(seed + 1000)
    v, yaw_rate = random.uniform(-0.5, 1.2, (steps, 4)), random.uniform(-1.5, 1.5, (steps, 5))
    return Profiles(*(jnp.asarray(values, jnp.float32) for values in (v[0], yaw_rate[0], v, yaw_rate)))


def crowd(seed):
    """Three movers that may well be met within a second or two."""
    random = np.random.default_rng(seed + 2000)
    here = np.array(random_scene(seed)[1][:2])
    return [(tuple(here + random.uniform(-1.6, 1.6, 2)), tuple(random.uniform(-0.8, 0.8, 2)), random.uniform(0.1, 0.3))
            for _ in range(3)]


def surroundings_of(seed, behaviour=PLAIN):
    return reference.Surroundings(lambda x, y: looked_up(scene_lattice(seed), x, y), tuple(random_scene(seed)[2]),
                                  tuple(crowd(seed)), behaviour.mover_margin, behaviour.mover_growth)


@pytest.mark.parametrize(("stride", "robot", "behaviour", "room"), [
    (1, DISC, PLAIN, None),
    (2, DISC, WARY, 0.04),
    (1, ROD, WARY, 0.1),
    (2, ROD, PLAIN, None),
], ids=["disc, Euler steps", "disc, stops, wary", "rod, stops, wary", "rod, double steps"])
def test_predictions_equal_the_oracle(stride, robot, behaviour, room):
    compared, stopped, met = 0, 0, 0
    for seed in range(10):
        _, start, known, _, _, _ = random_scene(seed)
        profiles = random_profiles(seed)
        found = jax.device_get(predicted(
            state(*start), profiles, HORIZON, stride, scene_field(seed), sensed(known, crowd(seed)), robot,
            behaviour, behaviour is WARY, None if room is None else jnp.float32(room)))
        v_ahead, yaw_ahead = np.asarray(profiles.v_ahead, float), np.asarray(profiles.yaw_rate_ahead, float)
        for i, j in np.ndindex(4, 5):
            expected = reference.outlook(start[:3], v_ahead[:, i], yaw_ahead[:, j], HORIZON, DT, stride, outline(robot),
                                         surroundings_of(seed, behaviour), room)
            if expected.closest_call < 1e-4:
                continue  # rounding decides whether it stops there, or meets a mover then
            compared += 1
            stopped += room is not None and expected.static <= room
            met += expected.contact_time < WATCH * stride * DT
            end = [np.broadcast_to(axis, (4, 5))[i, j] for axis in found.end]
            np.testing.assert_allclose(end, expected.end, atol=2e-5)
            np.testing.assert_allclose([axis[i, j] for axis in found.middle], expected.middle, atol=2e-5)
            np.testing.assert_allclose(found.headings[:, j], expected.headings, atol=1e-5)
            assert found.static[i, j] == pytest.approx(expected.static, abs=5e-5)
            assert found.moving[i, j] == pytest.approx(expected.moving, abs=5e-5, rel=1e-6)
            assert found.contact_time[i, j] == pytest.approx(expected.contact_time, abs=1e-5)
    assert compared > 190
    assert stopped > 20 or room is None
    assert 20 < met < 180


def held(v, yaw_rate, steps=WATCH):
    """One candidate at constant velocity, among copies of itself."""
    v, yaw_rate = jnp.full(4, v, jnp.float32), jnp.full(5, yaw_rate, jnp.float32)
    return Profiles(v, yaw_rate, jnp.broadcast_to(v, (steps, 4)), jnp.broadcast_to(yaw_rate, (steps, 5)))


def follow(start, profiles, known, robot=DISC, behaviour=PLAIN, room=None, stride=1, field=EMPTY):
    """One candidate's prediction."""
    found = predicted(start, profiles, HORIZON, stride, field, known, robot, behaviour, behaviour is WARY,
                      None if room is None else jnp.float32(room))
    return jax.tree.map(lambda leaf: float(leaf[0, 0]), found._replace(headings=found.headings[:1]))


def test_oncoming_mover_is_met_when_it_will_be_there():
    # Outlines of a standing robot and a mover: 1.35 − 0.5 − 0.25 = 0.6 m apart, nearing at 1 m/s.
    coming = sensed(movers=[((7.35, 6.0), (-1.0, 0.0), 0.5)])
    found = follow(state(6, 6, 0), held(0.0, 0.0), coming)
    assert found.contact_time == pytest.approx(0.7)  # after 0.6 s they touch
    assert found.moving == pytest.approx(-0.2, abs=1e-5)  # after the 0.8 s of the watch
    assert found.static == pytest.approx(5.75 - 0.1465 / 2, abs=1e-5)
    # A margin of 0.1 m that grows by 0.2 m/s: 0.6 − t < 0.1 + 0.2 t from t = 0.4167 s on.
    wary = follow(state(6, 6, 0), held(0.0, 0.0), coming, behaviour=WARY)
    assert wary.contact_time == pytest.approx(0.5)
    assert wary.moving == pytest.approx(-0.2 - 0.1 - 0.2 * 0.8, abs=1e-5)
    # In double steps of 0.2 s the same contact shows at 0.8 s. The watch lasts 1.6 s; centre on centre after 1.35 s.
    coarse = follow(state(6, 6, 0), held(0.0, 0.0), coming, stride=2)
    assert coarse.contact_time == pytest.approx(0.8)
    assert coarse.moving == pytest.approx(0.05 - 0.75, abs=1e-5)  # after 1.4 s
    # One that never comes: the whole watch.
    going = sensed(movers=[((7.35, 6.0), (1.0, 0.0), 0.5)])
    assert follow(state(6, 6, 0), held(0.0, 0.0), going).contact_time == pytest.approx(0.8)


def test_candidate_stays_where_its_next_point_would_be_too_near_to_a_square():
    # At 1 m/s from x = 5 towards a side at x = 5.6: clearance 0.35 − 0.1 k, so 0.15 after two steps, 0.05 after three.
    wall = sensed(squares=[((6.6, 6.0), 1.0)])
    stopping = follow(state(5, 6, 0), held(1.0, 0.0), wall, room=0.1)
    assert stopping.end.x == pytest.approx(5.2)
    assert stopping.middle == pytest.approx((5.2, 6.0))
    assert stopping.static == pytest.approx(0.05, abs=1e-5)  # what made it stop: of the point it did not go to
    through = follow(state(5, 6, 0), held(1.0, 0.0), wall)
    assert through.end.x == pytest.approx(5.5)
    assert through.static == pytest.approx(-0.15, abs=1e-5)


def test_stopped_candidate_is_where_movers_meet_it():
    # It stops at x = 5.2 before the wall. A mover behind it comes to x − 5.2 = 0.25 + 0.25 + … at 1 m/s from 4.0.
    wall, behind = ((6.6, 6.0), 1.0), ((4.0, 6.0), (1.0, 0.0), 0.25)
    found = follow(state(5, 6, 0), held(1.0, 0.0), sensed(squares=[wall], movers=[behind]), room=0.1)
    assert found.moving == pytest.approx(5.2 - 4.8 - 0.5, abs=1e-5)
    assert found.contact_time == pytest.approx(0.8)


def test_every_disc_of_a_long_robot_counts_at_the_heading_it_has_there():
    # Discs of 0.2 m at −0.25, 0 and 0.4 m along the robot, which turns on the spot at 1 rad/s: of 0.1, … 0.8 rad the
    # last brings its front nearest to what is straight above.
    above = sensed(movers=[((6.0, 7.0), (0.0, 0.0), 0.1)])
    found = follow(state(6, 6, 0), held(0.0, 1.0), above, robot=ROD)
    front = (6 + 0.4 * math.cos(0.8), 6 + 0.4 * math.sin(0.8))
    assert found.moving == pytest.approx(math.dist(front, (6, 7)) - 0.3, abs=1e-5)
    assert found.end == pytest.approx((6.0, 6.0, 0.5))


def test_clearance_now_is_that_of_the_pose():
    square = sensed(squares=[((7.5, 6.0), 0.5)])  # its side at x = 7
    assert float(now(state(6, 6, 0), EMPTY, square, DISC)) == pytest.approx(1 - 0.25, abs=1e-6)
    assert float(now(state(6, 6, 0), EMPTY, square, ROD)) == pytest.approx(1 - 0.4 - 0.2, abs=1e-6)
    assert float(now(state(6, 6, math.pi), EMPTY, square, ROD)) == pytest.approx(1 - 0.25 - 0.2, abs=1e-6)
    assert float(now(state(6, 6, math.pi / 2), EMPTY, square, ROD)) == pytest.approx(1 - 0.2, abs=1e-6)


def test_nothing_predicted_is_nan_and_gradients_are_finite():
    def total(start, mover):
        known = sensed([((5.0, 7.0), 0.4)], [((8.0, 8.0), (0.0, 0.0), 0.2)], capacity=1)._replace(position=mover[None])
        found = predict(start, random_profiles(2), HORIZON, 2, scene_field(2), known, ROD, WARY, True, jnp.float32(0.1))
        return sum(jnp.sum(leaf) for leaf in jax.tree.leaves(found))

    slopes = jax.jit(jax.value_and_grad(total, argnums=(0, 1)))
    for place in ((5.4, 6.6), (5.0, 7.0), (0.0, 0.0)):  # before the square, in its middle, in the map's corner
        for mover in ((8.0, 8.0), place):
            found = slopes(state(*place, 0.3, 0.5, 0.2), jnp.float32(mover))
            assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(found))
