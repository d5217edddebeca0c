import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.obstacles import movers_at, sense
from tests.yardstick_scenarios import scenarios_of

MAPS = np.zeros((1, 3, 5), np.uint8)
MAPS[0, 2, 4] = 1
(SCENARIO,) = scenarios_of(MAPS, np.array([[[2.5, 0.5, 0.3]]]), np.array([[[1.0, 1.0, -0.5, 1.0, 0.25]]]),
                           np.array([[0.5, 0.5]]), np.array([[4.5, 1.5]]))  # fmt: skip
kernel_movers_at = jax.jit(movers_at)


def test_the_task_is_that_of_its_episodes():
    np.testing.assert_array_equal(np.argwhere(SCENARIO.grid.occupied), [[2, 4]])
    assert float(SCENARIO.grid.resolution) == 1.0
    np.testing.assert_array_equal(SCENARIO.start[:2], [0.5, 0.5])
    np.testing.assert_array_equal(SCENARIO.goal, [4.5, 1.5])
    assert not SCENARIO.heading_given
    assert (float(SCENARIO.goal_tolerance), float(SCENARIO.time_limit)) == (np.float32(0.4), 60.0)


def test_movers_turn_back_where_their_outline_meets_the_border():
    # x: 1.0 to 0.25 in 1.5 s, then back; y: 1.0 to 2.75 in 1.75 s, then back.
    for time, expected in ((1.5, (0.25, 2.5)), (2.0, (0.5, 2.5)), (4.25, (1.625, 0.25))):
        state = kernel_movers_at(SCENARIO.movers, jnp.float32(time))
        np.testing.assert_allclose(state.position[0], expected, atol=1e-5)


def test_unknown_obstacles_are_discs():
    states = kernel_movers_at(SCENARIO.movers, jnp.float32(0.0))
    for sensor_range, known in ((2.2 - 1e-3, False), (2.2 + 1e-3, True)):
        here = jnp.float32([0.0, 0.5])
        seen = sense(SCENARIO.squares, jnp.zeros(1, bool), SCENARIO.movers, states, here, jnp.float32(sensor_range))
        assert bool(seen.square_known[0]) == known
