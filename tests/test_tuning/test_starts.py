import jax
import numpy as np

from scenarios.suite import Suite
from tests.test_tuning.worlds import OPEN, drawn
from tuning.starts import SHIFT, with_more_starts

WORLDS = Suite("worlds", (drawn(OPEN, 1.0), drawn(OPEN, 2.0)), ("world_3", "world_7"), {"made": "by hand"})


def starts(suite):
    return np.array([scenario.start for scenario in suite.scenarios])


def test_the_first_round_is_the_suite_itself_and_later_ones_are_named_by_their_start():
    more = with_more_starts(WORLDS, seed=0, count=5)
    assert more.names == ("world_3", "world_7", "world_3-start01", "world_7-start01", "world_3-start02")
    assert more.scenarios[:2] == WORLDS.scenarios
    assert [float(scenario.time_limit) for scenario in more.scenarios] == [1.0, 2.0, 1.0, 2.0, 1.0]


def test_only_the_start_pose_is_shifted_and_by_little():
    more = with_more_starts(WORLDS, seed=0, count=200)
    shifts = starts(more) - np.tile(starts(WORLDS), (100, 1))
    assert (shifts[:2] == 0).all()
    assert np.abs(shifts).max() <= SHIFT + 1e-6
    assert (np.abs(shifts[2:]).max(axis=0) > 0.9 * SHIFT).all()
    assert len(np.unique(shifts[2:], axis=0)) == 198
    leaves = [jax.tree.leaves(suite.scenarios[index]) for suite, index in ((more, 3), (WORLDS, 1))]
    assert sum(not np.array_equal(one, other) for one, other in zip(*leaves, strict=True)) == 1


def test_a_longer_suite_begins_with_the_shorter_one_and_seeds_differ():
    short, long = (with_more_starts(WORLDS, seed=4, count=count) for count in (5, 9))
    np.testing.assert_array_equal(starts(short), starts(long)[:5])
    assert (starts(with_more_starts(WORLDS, seed=5, count=5))[2:] != starts(short)[2:]).any()
    assert len(with_more_starts(WORLDS, seed=4, count=1).scenarios) == 1


def test_the_recipe_tells_worlds_seed_and_count():
    recipe = with_more_starts(WORLDS, seed=4, count=5).recipe
    assert recipe == {"suite": "worlds", "starts_near": {"made": "by hand"}, "seed": 4, "count": 5}
