"""A small tuning job's evaluations and findings, written down rather than driven."""

from types import SimpleNamespace

import numpy as np

from adwa_jax.episode import Outcome
from tuning.evaluations import Evaluations
from tuning.findings import Choice, Comparison, Findings, HypervolumeCurve, Interval, Judgement, Member
from tuning.objectives import DEFAULT_OBJECTIVES, Goals, estimate

PARAMETERS = ("clearance", "local_heading", "progress")
GOALS = Goals(DEFAULT_OBJECTIVES)
SCENARIOS = 40
# The default; a sweep of the first parameter; three others, of which the first is the recommended one.
VALUES = np.array([[0.1, 0.5, 0.6], [0.0, 0.5, 0.6], [0.2, 0.5, 0.6], [0.3, 0.5, 0.6],
                   [0.3125, 0.4375, 0.8125], [0.4, 0.2, 0.9], [0.05, 0.9, 0.3], [0.6, 0.1, 0.2]])  # fmt: skip


def evaluations(seed=0, values=VALUES, last_half_done=True):
    """Success falls and length rises with clearance, danger points fall; the last candidate was dropped half way."""
    noise = np.random.default_rng(seed)
    clearance = values[:, :1]
    reached = noise.random((len(values), SCENARIOS)) < 0.98 - 0.3 * clearance
    columns = {
        "outcome": np.where(reached, Outcome.REACHED, Outcome.HIT_MOVER).astype(np.int32),
        "length_ratio": 0.9 + 0.1 * clearance + 0.02 * noise.random(reached.shape),
        "breaking_points": noise.poisson(8 - 2 * clearance, reached.shape).astype(np.float64),
        "danger_points": noise.poisson(5 * np.exp(-3 * clearance), reached.shape).astype(np.float64),
        "hit_while_stopped": np.zeros(reached.shape),
    }
    done = np.ones(reached.shape, bool)
    if last_half_done:
        done[-1, SCENARIOS // 2 :] = False
    return Evaluations(PARAMETERS, values, np.array([0, 1, 1, 1, 2, 2, 2, 2][: len(values)], np.int32), columns, done)


def judged(found, row):
    one = found.rows(np.array([row]))
    values = [float(estimate(statistic, one.columns, one.done)[0]) for statistic in GOALS.objectives]
    spread = [0.04, 0.002, 0.4, 0.3]
    intervals = tuple(Interval(value, value - half, min(value + half, 1.0) if index == 0 else value + half)
                      for index, (value, half) in enumerate(zip(values, spread, strict=True)))  # fmt: skip
    return Judgement(SCENARIOS, intervals[0], intervals, True)


def findings(held_out=True):
    """A front of rows 4, 5, 6; row 4 is recommended."""
    training, unseen = evaluations(), evaluations(seed=1)
    members = [Member(row, VALUES[row], judged(training, row), judged(unseen, row) if held_out else None, share)
               for row, share in ((0, 0.4), (4, 0.9), (5, 0.8), (6, 0.3))]  # fmt: skip
    differences = (Interval(-0.01, -0.05, 0.03), Interval(0.02, 0.018, 0.022), Interval(-0.2, -0.9, 0.5),
                   Interval(-1.9, -2.4, -1.4))  # fmt: skip
    compared = Comparison(differences[0], differences, False, "No member of the front has fewer danger points and a "
                          "shorter way at once.") if held_out else None  # fmt: skip
    picked = np.array([[0.7, 0.2, 0.1], [0.25, 0.35, 0.3]])
    choices = (Choice("knee", 0, picked[0], "Nearest to the best of every objective at once."),
               Choice("constraint", 1, picked[1], "The best length_ratio of those with success 95.0% or more."))
    importance = np.array([[0.5, 0.8, 0.1, 0.9], [0.1, 0.05, 0.2, 0.0], [0.2, 0.1, 0.05, 0.02]])
    curve = HypervolumeCurve(np.array([40, 160, 300]), np.array([0.1, 0.25, 0.4]), np.array([0.0, 1.2, 12.0, 8.0]))
    return Findings(PARAMETERS, GOALS, members[0], tuple(members[1:]), choices, 0, curve, importance, compared)


def agreement(starts=3):
    """Of the gradient method."""
    cosine = np.linspace(0.2, 0.8, starts)
    return {"surrogate": np.ones((starts, 3)), "hard": np.ones((starts, 3)), "cosine": cosine,
            "cosine_low": cosine - 0.3, "cosine_high": cosine + 0.15, "sign_agreement": np.full(starts, 2 / 3)}


def job(name="office", **changes):
    """Stands for the job file's model: what a report reads of it."""
    fields = {
        "name": name, "seed": 7,
        "planner": {"preset": "extended", "robot": "disc"},
        "training": {"suites": [{"suite": "paper-20", "count": 40, "seed": 1}]},
        "held_out": {"suites": [{"suite": "paper-20", "count": 40, "seed": 2}]},
        "method": {"name": "nsga3", "episodes": 300, "racing": True},
    } | changes  # fmt: skip
    return SimpleNamespace(**fields, model_dump=lambda **_: fields)
