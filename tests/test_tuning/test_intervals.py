import math

import pytest

from tuning.intervals import Z95, mean_interval, wilson


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
