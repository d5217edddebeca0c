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
