"""Cheap problems for search methods: functions of the unit cube in place of episodes."""

from collections.abc import Callable

import numpy as np

from adwa_jax.presets import extended
from scenarios.suite import Suite
from tuning.methods.method import Method, Problem
from tuning.objectives import Goals, Scores, Statistic
from tuning.space import Parameter, Space

NAMES = ("local_heading", "clearance", "progress", "on_route", "contact_time", "mover_clearance", "lookahead",
         "mover_margin")  # fmt: skip
NO_SUITE = Suite("none", (), (), {})
Judge = Callable[[np.ndarray], Scores]


def cube(dimensions: int) -> Space:
    """Linear parameters from 0 to 2."""
    return Space(tuple(Parameter(name, 0.0, 2.0) for name in NAMES[:dimensions]), extended())


def problem(dimensions: int, objectives: int, candidates: int, seed: int = 0, **settings) -> Problem:
    goals = Goals(tuple(Statistic("length_ratio", "min") for _ in range(objectives)))
    return Problem(cube(dimensions), goals, seed, candidates, NO_SUITE, settings)


def searched(method: Method, of: Problem, judge: Judge) -> list[np.ndarray]:
    """All generations that the method asks for."""
    search = method(of)
    asked = [next(search)]
    while True:
        try:
            asked.append(search.send(judge(asked[-1])))
        except StopIteration:
            return asked


def dtlz2(points: np.ndarray) -> Scores:
    """Deb, Thiele, Laumanns and Zitzler 2002, four objectives: the front is a quarter sphere of radius 1, where all
    parameters beyond the third are ½.
    """
    radius = 1.0 + np.sum((points[:, 3:] - 0.5) ** 2, axis=1)
    a, b, c = (points[:, :3] * np.pi / 2).T
    flat = np.cos(a) * np.cos(b)
    on_sphere = np.stack([flat * np.cos(c), flat * np.sin(c), np.cos(a) * np.sin(b), np.sin(a)], axis=1)
    return free(radius[:, None] * on_sphere)


def sphere(centre: float) -> Judge:
    """One objective, 0 where all parameters are `centre`."""
    return lambda points: free(np.sum((points - centre) ** 2, axis=1, keepdims=True))


def walled_sphere(points: np.ndarray) -> Scores:
    """The sphere about ½, allowed only where the first parameter is 0.7 at least: least there, 0.2² = 0.04."""
    return Scores(sphere(0.5)(points).objectives, np.maximum(0.7 - points[:, 0], 0.0))


def nothing_allowed(points: np.ndarray) -> Scores:
    return Scores(dtlz2(points).objectives, np.ones(len(points)))


def free(objectives: np.ndarray) -> Scores:
    return Scores(objectives, np.zeros(len(objectives)))
