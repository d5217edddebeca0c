import math

import pytest
from scipy import stats

from tuning.intervals import Z95, mean_interval, paired_difference, small_sample_interval, student, wilson


def test_wilson_of_95_in_100_by_hand():
    # z² = 3.841459, centre (0.95 + 0.01920729) / 1.03841459 = 0.93335320,
    # half width 1.95996398 / 1.03841459 · √(0.95·0.05/100 + 3.841459/40000) = 0.04517735
    low, high = wilson(95, 100)
    assert low == pytest.approx(0.8882495, abs=1e-6)
    assert high == pytest.approx(0.9784555, abs=1e-6)


def test_wilson_solves_its_defining_equation():
    """Its ends are the rates p that lie z standard errors, of p itself, from the rate observed."""
    for successes, count in ((1, 3), (17, 40), (950, 1000)):
        for end in wilson(successes, count):
            assert abs(successes / count - end) == pytest.approx(Z95 * math.sqrt(end * (1 - end) / count))


def test_wilson_of_all_and_of_none_stays_within_0_and_1():
    low, high = wilson(3, 3)
    assert (low, high) == (pytest.approx(3 / (3 + Z95**2)), 1.0)
    assert wilson(0, 3) == (0.0, pytest.approx(1.0 - low))


def test_wilson_of_an_empty_sample_says_nothing():
    assert wilson(0, 0) == (0.0, 1.0)


def test_wilson_narrows_with_the_sample():
    widths = [high - low for low, high in (wilson(count // 2, count) for count in (2, 20, 200, 2000))]
    assert widths == sorted(widths, reverse=True)


def test_mean_interval_by_hand():
    mean, low, high = mean_interval([1.0, 2.0, 3.0, 6.0])  # variance (4 + 1 + 0 + 9) / 3
    assert mean == 3.0
    assert high - mean == pytest.approx(Z95 * math.sqrt(14 / 3 / 4))
    assert mean - low == pytest.approx(high - mean)


def test_mean_interval_of_few_values():
    assert mean_interval([]) == (0.0, 0.0, 0.0)
    assert mean_interval([2.5]) == (2.5, 2.5, 2.5)
    assert mean_interval([2.5, 2.5, 2.5]) == (2.5, 2.5, 2.5)


@pytest.mark.parametrize(("table", "expected"), [
    # Cavo et al. 2012, in Fagerland, Lydersen and Laake: Statistical Analysis of Contingency Tables (2017), chapter 8.
    ((59, 6, 16, 80), (-0.0621, -0.1186, -0.0046)),
    # By hand: no correlation where a margin is empty, and Wilson's upper limit of 0 in 54 is z² / (54 + z²).
    ((0, 0, 0, 54), (0.0, -(Z95**2) / (54 + Z95**2), Z95**2 / (54 + Z95**2))),
])  # fmt: skip
def test_paired_differences_of_known_tables(table, expected):
    assert paired_difference(*table) == pytest.approx(expected, abs=5e-5)


def test_a_paired_difference_turns_round_with_its_two_sides():
    difference, low, high = paired_difference(40, 13, 4, 9)
    assert paired_difference(40, 4, 13, 9) == pytest.approx((-difference, -high, -low))
    assert difference == pytest.approx(9 / 66)
    assert low < difference < high


def test_pairs_that_mostly_agree_tell_more_than_the_two_rates_alone():
    """φ is (80·16 − 2·2 − 50) / √(82·18·82·18), and the sides are those of Wilson's intervals of 82 in 100 twice."""
    _, low, high = paired_difference(80, 2, 2, 16)
    below, above = 0.82 - wilson(82, 100)[0], wilson(82, 100)[1] - 0.82
    phi = (80 * 16 - 4 - 50) / (82 * 18)
    assert -low == pytest.approx(high) == pytest.approx(math.sqrt(below**2 - 2 * phi * below * above + above**2))
    assert high < 0.5 * math.hypot(below, above)


def test_no_difference_is_exactly_none():
    assert paired_difference(30, 0, 0, 10)[0] == 0.0
    assert paired_difference(0, 1, 0, 0)[2] == 1.0


def test_students_points_are_scipys():
    for freedom in (1, 2, 3, 4, 5, 9, 30, 1000):
        assert student(freedom) == pytest.approx(stats.t.ppf(0.975, freedom), rel=0.0013)


def test_the_interval_of_a_small_sample_is_students():
    mean, low, high = small_sample_interval([1.0, 2.0, 3.0, 6.0])
    assert (mean, high - mean) == (3.0, pytest.approx(3.182 * math.sqrt(14 / 3 / 4), rel=0.0013))
    assert low == pytest.approx(6.0 - high)
    assert small_sample_interval([2.5]) == (2.5, 2.5, 2.5)
