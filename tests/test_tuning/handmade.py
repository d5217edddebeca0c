"""Evaluations made by hand, without driving anything."""

import numpy as np

from adwa_jax.episode import Outcome
from adwa_jax.presets import paper
from tuning.evaluations import Evaluations
from tuning.objectives import Goals, Statistic
from tuning.space import Parameter, Space

TWO_GOALS = Goals((Statistic("success", "max"), Statistic("length_ratio", "min")))
SPACE = Space((Parameter("clearance", 0.0, 1.0), Parameter("velocity", 0.0, 1.0)), paper())


def evaluations(reached, length_ratio, values=None, generation=None, done=None, **columns):
    """W candidates from rows of who reached the goal, [W, S], and lengths, [W, S] or [W]."""
    reached = np.asarray(reached, np.bool_)
    outcome = np.where(reached, int(Outcome.REACHED), int(Outcome.STUCK)).astype(np.int32)
    lengths = np.asarray(length_ratio, np.float32)
    lengths = np.broadcast_to(lengths[:, None] if lengths.ndim == 1 else lengths, reached.shape)
    count = len(reached)
    return Evaluations(
        parameters=SPACE.names,
        values=np.linspace([0.3, 0.8], [0.6, 0.2], count) if values is None else np.asarray(values, np.float64),
        generation=np.arange(count, dtype=np.int32) if generation is None else np.asarray(generation, np.int32),
        columns={"outcome": outcome, "length_ratio": lengths, **columns},
        done=np.ones(reached.shape, np.bool_) if done is None else np.asarray(done, np.bool_),
    )


def solved(counts, scenarios):
    """[W, S]: each candidate reaches the goal on its first `count` scenarios."""
    return np.arange(scenarios)[None, :] < np.asarray(counts)[:, None]
