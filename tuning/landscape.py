"""A loss over a few constants: of the hard planner, of the relaxed one that stands for it, and the slopes of both.

Dimension letters: C candidates; D parameters; O objectives; B points; P pairs of probes; S scenarios, S' of them seen
by the surrogate; R resamples.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.stats import spearmanr

from adwa_jax.relaxed import Softness
from scenarios.suite import Suite
from tuning.engine import Judged, judge_pairs
from tuning.findings import Interval
from tuning.gradients import (
    HIGH,
    LOW,
    Probes,
    Scaling,
    agreement,
    cosine,
    hard_slopes,
    mean_slopes,
    probes_about,
    scaling_of,
    slope,
)
from tuning.methods.gradient import loss_weights
from tuning.objectives import Goals, Scores
from tuning.space import Space
from tuning.surrogate import Look, Recorded, record, surrogate


@dataclass(frozen=True)
class Terrain:
    """What a landscape is of."""

    space: Space  # D
    goals: Goals  # O
    weights: np.ndarray  # [O] of the objectives, sum 1
    suite: Suite  # S scenarios, common to all
    look: Look  # where the surrogate looks
    seen: int  # of the scenarios, the first ones: S' that the surrogate looks at, which costs more than driving


class Probed(NamedTuple):
    """B points and what the hard planner made of their probes."""

    probes: tuple[Probes, ...]  # B, of P pairs each
    judged: Judged  # of all B · 2P probes in their order


def lattice(count: int) -> np.ndarray:
    """[count², 2] middles of count × count cells of the unit square, the first coordinate running fastest."""
    middles = (np.arange(count) + 0.5) / count
    return np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)


def judged_at(terrain: Terrain, unit: np.ndarray) -> Judged:
    """The hard planner with constants [C, D] of the unit cube, planned and driven on every scenario."""
    candidates = [terrain.space.preset(row).constants for row in terrain.space.values(unit)]
    return judge_pairs(terrain.suite.scenarios, candidates, terrain.space.base.options)


def scores_of(terrain: Terrain, judged: Judged, rows: slice = slice(None), drawn: np.ndarray | None = None) -> Scores:
    """Of some candidates, on all scenarios or on those `drawn`."""
    columns, done = judged.columns, judged.done[rows]
    at = np.arange(done.shape[1]) if drawn is None else drawn
    return terrain.goals.scores({name: values[rows][:, at] for name, values in columns.items()}, done[:, at])


def scaling_from(terrain: Terrain, judged: Judged) -> Scaling:
    """0 is the best and 1 the worst that these candidates have of each objective."""
    return scaling_of(scores_of(terrain, judged))


def hard_losses(terrain: Terrain, judged: Judged, scaling: Scaling, drawn: np.ndarray | None = None) -> np.ndarray:
    """[C] scalarised objectives, less is better."""
    return scaling.scalarised(scores_of(terrain, judged, drawn=drawn), terrain.weights)


def recorded_at(terrain: Terrain, unit: np.ndarray) -> list[Recorded]:
    """States on the way of the hard episodes of constants [C, D], from which the relaxed planner starts."""
    return record(terrain.space, unit, terrain.suite.scenarios[: terrain.seen], terrain.look)


def relaxed_at(terrain: Terrain, unit: np.ndarray, rows: Sequence[Recorded],
               softness: Softness) -> tuple[np.ndarray, np.ndarray]:
    """The surrogate's losses [C, S'] and gradients [C, S', D]; rows: recorded for the same [C, D]."""
    weights = np.repeat(loss_weights(terrain.goals, terrain.weights[None]), len(unit), axis=0)
    return surrogate(terrain.space, unit, weights, rows, terrain.look, softness)


def probed_about(terrain: Terrain, points: np.ndarray, pairs: int, scale: float, seed: int) -> Probed:
    """Antithetic probes about points [B, D], judged by the hard planner in one go."""
    free = np.ones(points.shape[1], np.bool_)
    probes = tuple(probes_about(point, free, pairs, scale, np.random.default_rng([seed, place]))
                   for place, point in enumerate(points))  # fmt: skip
    return Probed(probes, judged_at(terrain, np.concatenate([probe.points for probe in probes])))


def hard_slopes_at(terrain: Terrain, found: Probed, scaling: Scaling, resamples: int, seed: int,
                   drawn: np.ndarray | None = None) -> np.ndarray:
    """[B, 1 + R, D] evolution-strategies gradients; each resample is of the same scenarios at every point."""
    size = len(found.probes[0].points)
    return np.stack([
        hard_slopes(scores_of(terrain, found.judged, slice(place * size, (place + 1) * size), drawn), terrain.goals,
                    probes, scaling, terrain.weights, resamples, np.random.default_rng(seed))
        for place, probes in enumerate(found.probes)
    ])  # fmt: skip


def resampled(each: np.ndarray, resamples: int, seed: int) -> np.ndarray:
    """[B, 1 + R, D] mean over scenarios of gradients [B, S', D]; each resample is of the same ones at every point."""
    return np.stack([mean_slopes(one, resamples, np.random.default_rng(seed)) for one in each])


def own_slopes(probes: Sequence[Probes], losses: np.ndarray) -> np.ndarray:
    """[B, S', D] slope of a loss by its values [B · 2P, S'] at the probes: what a gradient of it should be."""
    parts = np.split(losses, len(probes))
    return np.stack([slope(part.T, probe) for part, probe in zip(parts, probes, strict=True)])


def agreement_at(first: np.ndarray, second: np.ndarray) -> dict[str, np.ndarray]:
    """[B] each, of gradients [B, 1 + R, D]: `cosine`, `cosine_low`, `cosine_high` and `sign_agreement`."""
    found = [agreement(one, other) for one, other in zip(first, second, strict=True)]
    return {
        "cosine": np.array([one.cosine for one in found]), "cosine_low": np.array([one.low for one in found]),
        "cosine_high": np.array([one.high for one in found]),
        "sign_agreement": np.array([one.sign.mean() for one in found]),
    }  # fmt: skip


def mean_cosine(first: np.ndarray, second: np.ndarray) -> Interval:
    """Over the points, of gradients [B, 1 + R, D] whose resamples are of the same scenarios."""
    return interval(cosine(first, second).mean(axis=0))


def sign_agreement(first: np.ndarray, second: np.ndarray) -> Interval:
    """Share of the B · D components that have the same sign; the toss of a coin gives ½."""
    return interval((np.sign(first) == np.sign(second)).mean(axis=(0, 2)))


def halves_agree(terrain: Terrain, found: Probed, scaling: Scaling, splits: int, seed: int) -> Interval:
    """Mean cosine over the points between the hard gradients of one half of the scenarios and of the other, over random
    splits: their mean and 95 % of them.

    How much chance there is in the hard gradient: a surrogate with the right gradient would agree about so well.
    """
    random, scenarios = np.random.default_rng(seed), len(terrain.suite.scenarios)
    return interval(_mean_first([_half_against_half(terrain, found, scaling, random.permutation(scenarios))
                                 for _ in range(splits)]))  # fmt: skip


def rank_agreement(terrain: Terrain, judged: Judged, scaling: Scaling, losses: np.ndarray, resamples: int,
                   seed: int) -> Interval:
    """Spearman's rank correlation over the C candidates of hard and relaxed loss [C, S']: 1 is the same order."""
    random = np.random.default_rng(seed)
    hard, relaxed = (_with_resamples(count, resamples, random) for count in (judged.done.shape[1], losses.shape[1]))
    return interval(np.array([_rank(hard_losses(terrain, judged, scaling, those), losses[:, these].mean(axis=1))
                              for those, these in zip(hard, relaxed, strict=True)]))  # fmt: skip


def interval(estimates: np.ndarray) -> Interval:
    """Of an estimate and its resamples, [1 + R]."""
    low, high = np.percentile(estimates[1:] if len(estimates) > 1 else estimates, [LOW, HIGH])
    return Interval(float(estimates[0]), float(low), float(high))


def _with_resamples(scenarios: int, resamples: int, random: np.random.Generator) -> np.ndarray:
    """[1 + R, S] all scenarios, then draws of as many with replacement."""
    return np.concatenate([np.arange(scenarios)[None], random.integers(scenarios, size=(resamples, scenarios))])


def _half_against_half(terrain: Terrain, found: Probed, scaling: Scaling, order: np.ndarray) -> float:
    first, second = (hard_slopes_at(terrain, found, scaling, 0, 0, half)[:, 0] for half in np.array_split(order, 2))
    return float(cosine(first, second).mean())


def _mean_first(values: Sequence[float]) -> np.ndarray:
    return np.array([np.mean(values), *values])


def _rank(first: np.ndarray, second: np.ndarray) -> float:
    """0 where one of them is flat."""
    if np.ptp(first) == 0 or np.ptp(second) == 0:
        return 0.0
    return float(spearmanr(first, second)[0])  # pyright: ignore[reportArgumentType]
