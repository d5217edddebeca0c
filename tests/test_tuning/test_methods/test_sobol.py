import numpy as np
import pytest
from pydantic import ValidationError

from tests.test_tuning.test_methods.problems import dtlz2, problem, searched
from tuning.methods.sobol import Settings, sobol, sobol_points


def test_generations_are_of_one_size_and_the_last_takes_what_is_left():
    assert [len(points) for points in searched(sobol, problem(3, 4, 70, generation=32), dtlz2)] == [32, 32, 6]


def test_every_parameter_is_covered_evenly():
    """A scrambled net in base 2: each of 64 equal parts of every axis holds one of 64 points."""
    points = sobol_points(7, 64, seed=3)
    for column in points.T:
        assert sorted(np.floor(column * 64).astype(int)) == list(range(64))


def test_a_longer_sequence_begins_with_the_shorter():
    np.testing.assert_array_equal(sobol_points(4, 100, seed=1)[:10], sobol_points(4, 10, seed=1))
    assert sobol_points(4, 0, seed=1).shape == (0, 4)


@pytest.mark.parametrize("settings", [{"generation": 48}, {"generation": 0}, {"population": 8}])
def test_settings_that_make_no_sense_are_refused(settings):
    with pytest.raises(ValidationError):
        Settings(**settings)
