"""Gradients of what has none: antithetic evolution strategies on common scenarios, and how far gradients agree.

Dimension letters: C candidates; D parameters; P pairs of probes; O objectives; S scenarios; R resamples.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tuning.objectives import NOTHING, Goals, Scores

INFEASIBLE = 10.0  # what a unit of violation adds to a scalarised objective
WORST = 3.0  # a normalised objective counts no more, so that "solved nothing" does not drown the rest
LOW, HIGH = 2.5, 97.5  # percentiles of a 95 % interval


class Probes(NamedTuple):
    """Points about a centre, in pairs on opposite sides of it."""

    points: np.ndarray  # [2P, D] in the unit cube: P plus, then P minus
    noise: np.ndarray  # [P, D] the directions, of length √D on average
    scale: float


class Agreement(NamedTuple):
    """Of two gradients."""

    cosine: float
    low: float  # 95 % interval
    high: float
    sign: np.ndarray  # [D] share of the resamples in which the signs agree


@dataclass(frozen=True)
class Scaling:
    """What makes objectives comparable: 0 is the best seen, 1 the worst seen."""

    best: np.ndarray  # [O]
    span: np.ndarray  # [O] above 0

    def scalarised(self, scores: Scores, weights: np.ndarray) -> np.ndarray:
        """[C] to be minimised: weighted sum of the normalised objectives, plus the violation. weights: [O], sum 1."""
        normalised = np.clip((scores.objectives - self.best) / self.span, -WORST, WORST)
        return normalised @ weights + INFEASIBLE * scores.violation


def scaling_of(scores: Scores) -> Scaling:
    """From some candidates' scores; means over no scenario count for nothing, and a span of 0 as 1."""
    known = np.where(np.abs(scores.objectives) < NOTHING, scores.objectives, np.nan)
    known = np.where(np.all(np.isnan(known), axis=0), 0.0, known)
    best = np.nanmin(known, axis=0)
    span = np.nanmax(known, axis=0) - best
    return Scaling(best, np.where(span > 1e-9, span, 1.0))


def probes_about(centre: np.ndarray, free: np.ndarray, pairs: int, scale: float,
                 random: np.random.Generator) -> Probes:
    """P antithetic pairs: Gaussian directions, made orthogonal D at a time, along the `free` parameters, [D] bool.

    Orthogonal directions (Choromanski 2018) tell D parameters apart with D pairs. A centre, [D], nearer to the cube's
    side than `scale` is moved in by what is missing: beyond the side nothing changes, which would look like no slope.
    """
    noise = np.zeros((pairs, centre.size))
    noise[:, free] = _orthogonal(pairs, int(free.sum()), random)
    inside = np.where(free, np.clip(centre, min(scale, 0.5), max(1.0 - scale, 0.5)), centre)
    return Probes(np.clip(np.concatenate([inside + scale * noise, inside - scale * noise]), 0.0, 1.0), noise, scale)


def slope(values: np.ndarray, probes: Probes) -> np.ndarray:
    """[..., D] gradient: mean over the pairs of (f(+) − f(−)) / (2 · scale) · direction. values: [..., 2P]."""
    pairs = probes.noise.shape[0]
    change = (values[..., :pairs] - values[..., pairs:]) / (2.0 * probes.scale)
    return change @ probes.noise / pairs


def hard_slopes(scores: Scores, goals: Goals, probes: Probes, scaling: Scaling, weights: np.ndarray, resamples: int,
                random: np.random.Generator) -> np.ndarray:
    """[1 + R, D] gradient of the scalarised hard objective: as it is, then over R resamples of the scenarios.

    scores: of the 2P probes. Without the columns they come from the resamples are of the pairs.
    """
    whole = slope(scaling.scalarised(scores, weights), probes)
    if scores.columns is None or scores.counted is None:
        values, pairs = scaling.scalarised(scores, weights), probes.noise.shape[0]
        drawn = random.integers(pairs, size=(resamples, pairs))
        again = [slope(values[np.concatenate([at, at + pairs])], probes._replace(noise=probes.noise[at]))
                 for at in drawn]  # fmt: skip
        return np.stack([whole, *again])
    columns, counted = scores.columns, scores.counted
    drawn = random.integers(counted.shape[1], size=(resamples, counted.shape[1]))
    again = [goals.scores({name: values[:, at] for name, values in columns.items()}, counted[:, at]) for at in drawn]
    return np.stack([whole, *(slope(scaling.scalarised(one, weights), probes) for one in again)])


def mean_slopes(each: np.ndarray, resamples: int, random: np.random.Generator) -> np.ndarray:
    """[1 + R, D] mean gradient over S scenarios, then over R resamples of them. each: [S, D]."""
    drawn = random.integers(each.shape[0], size=(resamples, each.shape[0]))
    return np.concatenate([each.mean(axis=0, keepdims=True), each[drawn].mean(axis=1)])


def agreement(surrogate: np.ndarray, hard: np.ndarray) -> Agreement:
    """Of two gradients with their resamples, [1 + R, D] each; row 0 is the estimate."""
    cosines = cosine(surrogate, hard)
    low, high = np.percentile(cosines[1:], [LOW, HIGH]) if len(cosines) > 1 else (cosines[0], cosines[0])
    signs = np.sign(surrogate) == np.sign(hard)
    return Agreement(float(cosines[0]), float(low), float(high), signs[min(1, len(signs) - 1) :].mean(axis=0))


def cosine(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """[...] of the angle between vectors [..., D]; 0 where one is 0."""
    lengths = np.linalg.norm(first, axis=-1) * np.linalg.norm(second, axis=-1)
    return np.where(lengths > 0, np.sum(first * second, axis=-1) / np.where(lengths > 0, lengths, 1.0), 0.0)


def _orthogonal(count: int, size: int, random: np.random.Generator) -> np.ndarray:
    """[count, size] directions of length √size, orthogonal within each block of `size`, evenly distributed."""
    blocks = [np.linalg.qr(random.standard_normal((size, size)))[0].T for _ in range(-(-count // max(size, 1)))]
    return np.sqrt(size) * np.concatenate(blocks)[:count] if size else np.zeros((count, 0))
