from dataclasses import replace

import numpy as np
import pytest

from adwa_jax.presets import extended
from scenarios.errors import InputError
from tests.test_tuning.test_methods.problems import dtlz2, problem, searched
from tuning.methods.sweep import Settings, needed, sweep
from tuning.space import Parameter, Space

# Of `extended`: clearance 0.1, lookahead 6, v_samples 6; dense_base 0.5, dense_gain 0.5 with dense_ratio 1.5.
MIXED = Space((Parameter("clearance", 0.0, 0.5), Parameter("lookahead", 1.0, 10.0, "log"),
               Parameter("v_samples", 5, 8, "integer")), extended())  # fmt: skip


def swept(space, candidates, **settings):
    of = replace(problem(1, 4, candidates, **settings), space=space)
    return [space.values(points) for points in searched(sweep, of, dtlz2_of_any)]


def dtlz2_of_any(points):
    return dtlz2(np.full((len(points), 4), 0.5))


def test_each_parameter_goes_through_its_range_by_its_own_steps_while_the_others_stay():
    clearance, lookahead, samples = swept(MIXED, 100)
    np.testing.assert_allclose(clearance[:, 0], [0.0, 0.2, 0.3, 0.4, 0.5], atol=1e-12)  # the default, 0.1, is known
    np.testing.assert_allclose(clearance[:, 1:], [[6.0, 6.0]] * 5)
    np.testing.assert_allclose(lookahead[:, 1], 10.0 ** np.linspace(0.0, 1.0, 11))
    np.testing.assert_allclose(lookahead[:, [0, 2]], [[0.1, 6.0]] * 11)
    np.testing.assert_array_equal(samples[:, 2], [5.0, 7.0, 8.0])


def test_what_is_needed_is_what_is_asked_for():
    assert needed(MIXED, Settings()) == 5 + 11 + 3
    assert sum(map(len, swept(MIXED, 1000, step=0.05))) == needed(MIXED, Settings(step=0.05)) == 10 + 21 + 3


def test_a_smaller_budget_thins_all_parameters_evenly_and_keeps_the_ends():
    lines = swept(MIXED, 12)  # 2 ends each, and (12 − 6)/(19 − 6) of the 3, 9 and 1 between, rounded down
    assert [len(line) for line in lines] == [2 + 1, 2 + 4, 2 + 0]
    for index, line in enumerate(lines):
        assert line[:, index][[0, -1]] == pytest.approx([[0.0, 0.5], [1.0, 10.0], [5.0, 8.0]][index])


def test_a_budget_too_small_for_any_curve_is_refused():
    with pytest.raises(InputError, match=r"method.episodes: pays for 5 .* 3 parameters needs 6 at least"):
        swept(MIXED, 5)


def test_what_eq_5_forbids_beside_the_other_defaults_is_left_out():
    """ω = base + 0.5 / 1.5 must stay below 1 where dense: base below 0.667."""
    space = Space((Parameter("dense_base", 0.0, 1.0), Parameter("clearance", 0.0, 0.5)), extended())
    base, _ = swept(space, 100)
    np.testing.assert_allclose(base[:, 0], [0.0, 0.1, 0.2, 0.3, 0.4, 0.6], atol=1e-12)  # 0.5 is the default


def test_a_default_outside_its_range_is_swept_from_the_ranges_end():
    """Lookahead 6 is above its range: clearance is swept at lookahead 3, which the default itself has not."""
    space = Space((Parameter("clearance", 0.0, 0.2), Parameter("lookahead", 1.0, 3.0)), extended())
    clearance, lookahead = swept(space, 100)
    np.testing.assert_allclose(clearance, [[0.0, 3.0], [0.1, 3.0], [0.2, 3.0]], atol=1e-12)
    np.testing.assert_allclose(lookahead[:, 0], 0.1, atol=1e-12)
