"""What the heuristic weight does to the search is a step function: its mean over perturbations, which has a slope.

Dimension letters: X values of ω; S scenarios.
"""

from typing import NamedTuple

import numpy as np

from scenarios.errors import InputError
from scenarios.suite import Suite
from tuning.search_study import Weighting, search_all


class Smoothed(NamedTuple):
    """A function f of ω on every map, its mean over a window about ω, and the slope of that mean."""

    weight: np.ndarray  # [X] ω, evenly spaced
    each: np.ndarray  # [S, X] f
    inner: slice  # where the whole window lies within the values: X' of them
    mean: np.ndarray  # [S, X']
    slope: np.ndarray  # [S, X']
    reach: float  # half of the window's width


def expansions_over(suite: Suite, weights: np.ndarray) -> np.ndarray:
    """[S, X] expansions of searches with a constant ω, on common maps. weights: [X]."""
    found = search_all(suite, {str(place): Weighting(float(weight)) for place, weight in enumerate(weights)})
    return np.stack([searches.expansions for searches in found.values()], axis=1).astype(np.float64)


def smoothed(weight: np.ndarray, each: np.ndarray, reach: float) -> Smoothed:
    """f̄(ω) = mean of f over ω ± reach, and f̄'(ω) = (f(ω + reach) − f(ω − reach)) / (2 · reach).

    That difference of an antithetic pair is the slope of the mean, and not merely near it: ∂/∂ω ∫ f from ω − reach to
    ω + reach. With one parameter it is what `gradients.slope` gives. f is taken as linear between the values.
    weight: [X]; each: [S, X]. Raises InputError unless the window fits and spans whole steps of evenly spaced values.
    """
    step = float(weight[1] - weight[0])
    steps = round(reach / step)
    if steps < 1 or 2 * steps >= len(weight) - 1 or not np.allclose([steps * step, *np.diff(weight)],
                                                                 [reach, *np.full(len(weight) - 1, step)]):  # fmt: skip
        raise InputError(f"reach: {reach:g}; must be whole steps of evenly spaced values, {step:g} each, and twice it "
                         f"less than their span; change reach or values")  # fmt: skip
    total = np.concatenate([np.zeros((len(each), 1)), np.cumsum((each[:, 1:] + each[:, :-1]) / 2, axis=1)], axis=1)
    mean = (total[:, 2 * steps :] - total[:, : -2 * steps]) / (2 * steps)
    slope = (each[:, 2 * steps :] - each[:, : -2 * steps]) / (2 * reach)
    return Smoothed(weight, each, slice(steps, len(weight) - steps), mean, slope, reach)
