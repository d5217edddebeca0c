"""Multi-start descent: along gradients of the relaxed planner and of the hard one, judged by the hard one.

In each round, for every start: the hard objective's antithetic evolution-strategies gradient is taken from probes about
the start's best point; a few optax steps are made on the relaxed planner's loss from the same point; then points along
both are judged, and the best so far by the start's scalarised hard objective is where the next round begins.
Integer parameters have no gradient and keep the base's value. What only planning depends on (eq. 5, clearance margin)
has a smoothed gradient: antithetic perturbations, of planned paths on common scenarios.
Dimension letters: B starts; D parameters; O objectives; P pairs of probes; S scenarios; J optax steps.
"""

from collections.abc import Mapping
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
import optax
from pydantic import BaseModel, ConfigDict, Field
from scipy.stats import qmc

from adwa_jax.relaxed import Softness, Variant
from adwa_jax.relaxed_drive import Loss, Stretch
from scenarios.errors import InputError
from tuning.gradients import Agreement, Probes, Scaling, agreement, hard_slopes, mean_slopes, probes_about, scaling_of
from tuning.gradients import slope as slope_of
from tuning.methods.method import Problem, Search
from tuning.objectives import Goals, Scores
from tuning.planned_losses import planned_losses, planned_measures
from tuning.space import Space
from tuning.surrogate import Look, driven, record, surrogate
from tuning.weights_file import COUNTS, OF_A_PLAN

ARRIVES = Loss(1.0, 0.0, 0.0, 0.0, 1.0)
KEEPS_AWAY = Loss(1.0, 0.0, 0.8, 0.0, 1.0)
SHORT = Loss(1.0, 0.8, 0.0, 0.0, 1.0)
STRAIGHT = Loss(1.0, 0.0, 0.0, 0.8, 1.0)
PARTS = {
    "success": ARRIVES, "time": ARRIVES, "barn_score": ARRIVES, "spl": SHORT, "length_ratio": SHORT, "length": SHORT,
    "collision": KEEPS_AWAY, "danger_points": KEEPS_AWAY, "least_clearance": KEEPS_AWAY, "mean_clearance": KEEPS_AWAY,
    "breaking_points": STRAIGHT, "curvature": STRAIGHT, "angle_over_length": STRAIGHT, "command_variation": STRAIGHT,
    "jerk": STRAIGHT,
}  # fmt: skip
"""Which parts of the relaxed loss stand for a measure; other measures have none. Progress is in all of them: most
measures are of solved scenarios only, and a robot that stands is short of nothing but of that.
"""
LENGTHS = (0.5, 1.0, 2.0)  # points along a hard gradient, in units of the start's reach


class Settings(BaseModel):
    """What the job file may say."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)
    starts: int = Field(8, ge=1, le=256)
    steps: int = Field(3, ge=1, le=100)  # J, on the relaxed loss in a round
    learning_rate: float = Field(0.05, gt=0.0, le=1.0)  # Adam's, in the unit cube
    temperature: float = Field(0.03, gt=0.0, le=10.0)
    variant: Variant = "straight_through"
    scenarios: int = Field(8, ge=1, le=1024)  # of the training suite, drawn anew for each round's surrogate
    stretch: int = Field(30, ge=1, le=1000)  # control steps
    truncate: int = Field(10, ge=1, le=1000)  # control steps that gradients reach back
    stretches: int = Field(3, ge=1, le=100)  # of each episode
    every: int = Field(50, ge=1, le=10_000)  # control steps between their beginnings
    es_pairs: int = Field(4, ge=1, le=1024)  # P
    es_scale: float = Field(0.1, gt=0.0, le=0.25)  # of the probes, in the unit cube
    reach: float = Field(0.15, gt=0.0, le=1.0)  # of a first step along a hard gradient, times √D
    trust: Literal["surrogate", "hard", "blend"] = "blend"  # whose points are judged; blend: both
    resamples: int = Field(200, ge=2, le=10_000)  # for the intervals of the agreement


def gradient(problem: Problem) -> Search:
    """Yields starts, then probes and proposals in turn, while the budget pays for a round.

    Remembers, as columns the parameters, of the starts before their first step: "agreement" with `points`, `surrogate`,
    `hard` [B, D] (gradients in the unit cube of what is minimised), `sign_agreement` [B, D] (share of the resamples),
    `informed` [D] (whether the surrogate has a gradient there, over which the cosine is), `weights` [B, O], and
    `cosine`, `cosine_low`, `cosine_high` [B] (95 % over resamples of the scenarios). Raises InputError if no parameter
    has a gradient, or the budget pays for no round.
    """
    settings = Settings(**problem.settings)
    free = np.array([name not in COUNTS for name in problem.space.names])
    if not free.any():
        raise InputError("method.name: 'gradient'; integer parameters have no gradient; tune another constant as "
                         "well, or choose another method")  # fmt: skip
    needed = settings.starts + _cost(settings, 0)
    if problem.candidates < needed:
        raise InputError(f"method.episodes: pays for {problem.candidates} candidates; {settings.starts} starts and "
                         f"a first round need {needed}; raise it, or take fewer starts or es_pairs")  # fmt: skip
    points, weights = starts_of(problem, settings, free)
    scores = yield points
    scaling = scaling_of(scores)
    best = _each(scaling, scores, weights, 1)[:, 0]
    reach = np.full(len(points), settings.reach * np.sqrt(free.sum()))
    spent, number = len(points), 0
    while spent + _cost(settings, number) <= problem.candidates:
        hard = np.zeros_like(points)
        if number == 0 or settings.trust != "surrogate":
            probes = [probes_about(point, free, settings.es_pairs, settings.es_scale,
                                   np.random.default_rng([problem.seed, number, place]))
                      for place, point in enumerate(points)]  # fmt: skip
            answers = yield np.concatenate([probe.points for probe in probes])
            slopes = _hard(answers, probes, problem.goals, scaling, weights, settings, problem.seed)
            hard = slopes[:, 0]
        path = _relaxed(problem, settings, points, weights, number)
        if number == 0:
            _remember_agreement(problem, settings, points, weights, path["each"], slopes)
        proposals = _proposals(settings.trust, points, hard, reach, path["path"])
        judged = _each(scaling, (yield proposals.reshape(-1, points.shape[1])), weights, proposals.shape[1])
        chosen = np.argmin(judged, axis=1)
        better = judged[np.arange(len(points)), chosen] < best
        points = np.where(better[:, None], proposals[np.arange(len(points)), chosen], points)
        best = np.minimum(best, judged.min(axis=1))
        reach = np.where(better, reach, 0.5 * reach)
        spent, number = spent + _cost(settings, number), number + 1


def starts_of(problem: Problem, settings: Settings, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points [B, D] of Sobol's sequence, and each one's weights [B, O] of the objectives.

    Half of a start's weights is the same for all, so that none forgets an objective; the first has equal ones.
    """
    count = settings.starts
    sides = len(problem.space.names), len(problem.goals.objectives)
    drawn = qmc.Sobol(sum(sides), rng=problem.seed).random_base2((count - 1).bit_length())[:count]
    fixed = problem.space.unit(problem.space.default[None])
    shares = -np.log(np.clip(drawn[:, sides[0] :], 1e-9, 1.0))
    shares[0] = 1.0
    shares /= shares.sum(axis=1, keepdims=True)
    return np.where(free, drawn[:, : sides[0]], fixed), 0.5 * shares + 0.5 / sides[1]


def loss_weights(goals: Goals, weights: np.ndarray) -> np.ndarray:
    """[B, 5] of the relaxed loss, for weights [B, O] of the objectives; each row sums to 1."""
    parts = np.array([PARTS.get(statistic.measure, Loss(0.0, 0.0, 0.0, 0.0, 0.0)) for statistic in goals.objectives])
    totals = parts.sum(axis=1, keepdims=True)
    mixed = weights @ (parts / np.maximum(totals, 1.0))
    known = mixed.sum(axis=1, keepdims=True)
    return np.where(known > 0, mixed / np.where(known > 0, known, 1.0), 1.0 / parts.shape[1])


def _cost(settings: Settings, number: int) -> int:
    """Candidates that a round has judged."""
    lines = {"surrogate": settings.steps, "hard": len(LENGTHS), "blend": settings.steps + len(LENGTHS)}
    probes = 2 * settings.es_pairs if number == 0 or settings.trust != "surrogate" else 0
    return settings.starts * (probes + lines[settings.trust])


def _each(scaling: Scaling, scores: Scores, weights: np.ndarray, count: int) -> np.ndarray:
    """[B, count] scalarised objectives of so many candidates a start."""
    return np.stack([scaling.scalarised(_part(scores, place, count), row) for place, row in enumerate(weights)])


def _part(scores: Scores, place: int, count: int) -> Scores:
    """Those of one start."""
    here = slice(place * count, (place + 1) * count)
    columns = None if scores.columns is None else {name: values[here] for name, values in scores.columns.items()}
    counted = None if scores.counted is None else scores.counted[here]
    return Scores(scores.objectives[here], scores.violation[here], columns, counted)


def _hard(scores: Scores, probes: list[Probes], goals: Goals, scaling: Scaling, weights: np.ndarray,
          settings: Settings, seed: int) -> np.ndarray:
    """[B, 1 + R, D] gradients of the hard objective with their resamples."""
    return np.stack([
        hard_slopes(_part(scores, place, len(probe.points)), goals, probe, scaling, row, settings.resamples,
                    np.random.default_rng([seed, place]))
        for place, (probe, row) in enumerate(zip(probes, weights, strict=True))
    ])  # fmt: skip


def _relaxed(problem: Problem, settings: Settings, points: np.ndarray, weights: np.ndarray,
             number: int) -> Mapping[str, np.ndarray]:
    """`path` [B, J, D]: the points after each optax step; `each` [B, S, D]: gradients at the first, by scenario."""

    def compute() -> dict[str, np.ndarray]:
        random = np.random.default_rng([problem.seed, number])
        count = min(settings.scenarios, len(problem.suite.scenarios))
        taken = np.sort(random.choice(len(problem.suite.scenarios), count, replace=False))
        scenarios = [problem.suite.scenarios[index] for index in taken]
        look = Look(Stretch(settings.stretch, settings.truncate, settings.variant), settings.stretches, settings.every)
        rows, softness = record(problem.space, points, scenarios, look), Softness(settings.temperature)
        optimiser = optax.adam(settings.learning_rate)
        at, path, first = points, [], None
        state = optimiser.init(jnp.asarray(points, jnp.float32))
        for _ in range(settings.steps):
            each = surrogate(problem.space, at, loss_weights(problem.goals, weights), rows, look, softness)[1]
            each = each + _smoothed(problem, settings, at, weights, scenarios, random)
            first = each if first is None else first
            with jax.numpy_dtype_promotion("standard"):  # optax raises numbers to whole powers
                updates, state = optimiser.update(jnp.asarray(each.mean(axis=1), jnp.float32), state)
            at = np.clip(at + np.asarray(updates, np.float64), 0.0, 1.0)
            path.append(at)
        return {"path": np.stack(path, axis=1), "each": np.asarray(first)}

    return problem.remember(f"surrogate-{number}", compute)


def _smoothed(problem: Problem, settings: Settings, points: np.ndarray, weights: np.ndarray, scenarios: list,
              random: np.random.Generator) -> np.ndarray:
    """[B, S, D] smoothed gradients in the parameters that only planning depends on; 0 in the others."""
    names = problem.space.names
    if not any(name in OF_A_PLAN for name in names):
        return np.zeros((len(points), len(scenarios), len(names)))
    return np.stack([planned_slopes(problem.space, problem.goals, point, row, scenarios, settings.es_pairs,
                                    settings.es_scale, random)
                     for point, row in zip(points, weights, strict=True)])  # fmt: skip


def planned_slopes(space: Space, goals: Goals, point: np.ndarray, weights: np.ndarray, scenarios: list, pairs: int,
                   scale: float, random: np.random.Generator) -> np.ndarray:
    """[S, D] smoothed gradient of the planned paths' loss, by scenario, at a point [D]; weights: [O]."""
    free = np.array([name in OF_A_PLAN for name in space.names])
    probes = probes_about(point, free, pairs, scale, random)
    signed = {statistic.measure: statistic.sign * float(weight)
              for statistic, weight in zip(goals.objectives, weights, strict=True)}  # fmt: skip
    return slope_of(planned_losses(planned_measures(space, probes.points, scenarios), signed).T, probes)


def _remember_agreement(problem: Problem, settings: Settings, points: np.ndarray, weights: np.ndarray,
                        each: np.ndarray, hard: np.ndarray) -> None:
    informed = np.array([driven(name) or name in OF_A_PLAN for name in problem.space.names])
    soft = np.stack([mean_slopes(one, settings.resamples, np.random.default_rng([problem.seed, place]))
                     for place, one in enumerate(each)])  # fmt: skip

    def compute() -> dict[str, np.ndarray]:
        found: list[Agreement] = [agreement(one[:, informed], other[:, informed])
                                  for one, other in zip(soft, hard, strict=True)]  # fmt: skip
        signs = np.full(points.shape, np.nan)
        signs[:, informed] = np.stack([one.sign for one in found])
        return {
            "points": points, "surrogate": soft[:, 0], "hard": hard[:, 0], "informed": informed, "weights": weights,
            "sign_agreement": signs,
            "cosine": np.array([one.cosine for one in found]), "cosine_low": np.array([one.low for one in found]),
            "cosine_high": np.array([one.high for one in found]),
        }  # fmt: skip

    problem.remember("agreement", compute)


def _proposals(trust: str, points: np.ndarray, hard: np.ndarray, reach: np.ndarray, path: np.ndarray) -> np.ndarray:
    """[B, count, D] points to judge."""
    lengths = np.linalg.norm(hard, axis=1, keepdims=True)
    direction = hard / np.where(lengths > 0, lengths, 1.0)
    line = [np.clip(points - part * reach[:, None] * direction, 0.0, 1.0) for part in LENGTHS]
    along = np.stack(line, axis=1)
    return {"surrogate": path, "hard": along, "blend": np.concatenate([path, along], axis=1)}[trust]
