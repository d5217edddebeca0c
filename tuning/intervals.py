"""Confidence intervals of what a sample of scenarios shows."""

import math

Z95 = 1.959963984540054  # two-sided 95 % point of the normal distribution


def wilson(successes: int, count: int, z: float = Z95) -> tuple[float, float]:
    """Wilson score interval of a rate (Wilson 1927), 95 % unless `z` says otherwise; (0, 1) for an empty sample."""
    if count == 0:
        return 0.0, 1.0
    rate = successes / count
    shrink = 1.0 + z * z / count
    centre = (rate + z * z / (2 * count)) / shrink
    half = z / shrink * math.sqrt(rate * (1.0 - rate) / count + z * z / (4 * count * count))
    return max(0.0, centre - half), min(1.0, centre + half)


def paired_difference(both: int, first: int, second: int, neither: int, z: float = Z95) -> tuple[float, float, float]:
    """Rate of the first minus that of the second on the same N scenarios, and its 95 % interval; N ≥ 1.

    Newcombe's method 10 (Statistics in Medicine 17, 1998, 2635-2650): the Wilson intervals of the two rates, added as
    squares with their correlation φ, which is corrected for continuity. both, first, second, neither: scenarios in
    which both succeed, only the first, only the second, neither.
    """
    count = both + first + second + neither
    rate, other = (both + first) / count, (both + second) / count
    low, high = wilson(both + first, count, z)
    other_low, other_high = wilson(both + second, count, z)
    phi = _correlation(both, first, second, neither)
    below, above = _side(rate - low, other_high - other, phi), _side(high - rate, other - other_low, phi)
    return rate - other, max(-1.0, rate - other - below), min(1.0, rate - other + above)


def _side(half: float, other: float, phi: float) -> float:
    """√(half² − 2φ·half·other + other²)."""
    return math.sqrt(max(0.0, half * half - 2.0 * phi * half * other + other * other))


def _correlation(both: int, first: int, second: int, neither: int) -> float:
    """φ of a fourfold table, drawn towards 0 by N/2 where it is positive; 0 where a margin is empty."""
    margins = (both + first) * (second + neither) * (both + second) * (first + neither)
    product = both * neither - first * second
    if product > 0:
        product = max(product - (both + first + second + neither) / 2, 0.0)
    return product / math.sqrt(margins) if margins else 0.0


def student(freedom: int) -> float:
    """Two-sided 95 % point of Student's t, 0.12 % low at most (Abramowitz and Stegun 1964, 26.7.5). freedom ≥ 1."""
    if freedom < 3:
        return (math.tan(0.475 * math.pi), 0.95 / math.sqrt(2 * 0.975 * 0.025))[freedom - 1]
    z, n = Z95, freedom
    terms = (z, (z**3 + z) / 4, (5 * z**5 + 16 * z**3 + 3 * z) / 96, (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
             (79 * z**9 + 776 * z**7 + 1482 * z**5 - 1920 * z**3 - 945 * z) / 92160)  # fmt: skip
    return sum(term / n**power for power, term in enumerate(terms))


def small_sample_interval(values: list[float]) -> tuple[float, float, float]:
    """Mean and its 95 % interval by Student's t, as `mean_interval`."""
    return mean_interval(values, student(max(len(values) - 1, 1)))


def mean_interval(values: list[float], z: float = Z95) -> tuple[float, float, float]:
    """Mean and its normal 95 % interval; NaN-free: an empty sample gives (0, 0, 0), one value no width."""
    count = len(values)
    if count == 0:
        return 0.0, 0.0, 0.0
    mean = math.fsum(values) / count
    if count == 1:
        return mean, mean, mean
    variance = math.fsum((value - mean) ** 2 for value in values) / (count - 1)
    half = z * math.sqrt(variance / count)
    return mean, mean - half, mean + half
