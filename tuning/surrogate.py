"""The relaxed planner's loss and its gradient over many candidates and scenarios, as functions of the unit cube.

Forward mode: with a handful of parameters it costs less than going back through every predicted point.
Dimension letters: C candidates; D parameters; S scenarios; P stretches of an episode; R rows in a call.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.constants import Constants, Options
from adwa_jax.lanes import Task
from adwa_jax.plan import Plan
from adwa_jax.relaxed import Softness
from adwa_jax.relaxed_drive import Loss, OnTheWay, Stretch, recorded, stretch_loss
from adwa_jax.scenario import Scenario
from scenarios.padding import stack
from tuning.compiled import keep_compiled
from tuning.engine import Program, program_of
from tuning.plans_ahead import Pair, Planner
from tuning.space import Space
from tuning.weights_file import BEHAVIOUR, SCORE

ROWS = 32  # candidate-scenario pairs in one call, so that one program serves
PLANNED = ("clearance_margin", "route_margin")  # of the behaviour, those that only planning depends on


@dataclass(frozen=True)
class Look:
    """Where the surrogate looks."""

    stretch: Stretch
    starts: int  # P, on the way of each hard episode
    every: int  # control steps between them


class Recorded(NamedTuple):
    """Rows of one program: tasks, and states on the way of their hard episodes."""

    program: Program
    pairs: tuple[Pair, ...]  # R; the scenario by its place among those recorded
    task: Task  # [R, ...] leaves
    way: OnTheWay  # [R, P, ...]


def driven(name: str) -> bool:
    """Whether the relaxed planner has a gradient in a constant: weights and behaviour, but for what is planned by."""
    return name in SCORE or (name in BEHAVIOUR and name not in PLANNED)


def record(space: Space, unit: np.ndarray, scenarios: Sequence[Scenario], look: Look) -> list[Recorded]:
    """Drive the hard planner of every candidate, [C, D], on every scenario, and keep states on the way."""
    keep_compiled()
    candidates = [jax.tree.map(np.float32, space.preset(row).constants) for row in space.values(unit)]
    groups: dict[Program, list[Pair]] = {}
    for index, scenario in enumerate(scenarios):
        program = program_of(scenario, candidates[0], space.base.options)
        groups.setdefault(program, []).extend(Pair(candidate, index) for candidate in range(len(candidates)))
    return [_recorded(program, pairs[at : at + ROWS], scenarios, candidates, look)
            for program, pairs in groups.items() for at in range(0, len(pairs), ROWS)]  # fmt: skip


def surrogate(space: Space, unit: np.ndarray, weights: np.ndarray, rows: Sequence[Recorded], look: Look,
              softness: Softness) -> tuple[np.ndarray, np.ndarray]:
    """Losses [C, S] and their gradients [C, S, D] in the unit cube, the mean over an episode's stretches.

    unit: [C, D]; weights: [C, 5] of `Loss`. A gradient longer than 1 is cut to that for each stretch, or few unstable
    stretches would say it all; it is 0 in parameters that are not `driven`.
    """
    scenarios = 1 + max(pair.scenario for part in rows for pair in part.pairs)
    losses = np.zeros((len(unit), scenarios))
    slopes = np.zeros((len(unit), scenarios, len(space.names)))
    columns = [index for index, name in enumerate(space.names) if driven(name)]
    axes = tuple(_Axis(space.names[index], space.parameters[index].scale == "log") for index in columns)
    bounds = np.array([[space.parameters[index].low, space.parameters[index].high] for index in columns], np.float32)
    softness = Softness(*(jnp.float32(value) for value in softness))
    for part in rows:
        at = np.array([pair.candidate for pair in part.pairs])
        filled = np.concatenate([at, np.repeat(at[-1:], ROWS - len(at))])
        points = np.asarray(unit, np.float32)[filled][:, columns]
        each = _slopes(points, bounds.reshape(-1, 2), part.task, part.way, softness,
                       Loss(*np.asarray(weights, np.float32)[filled].T), axes, part.program.options, look.stretch)
        loss, gradient = (np.asarray(values, np.float64)[: len(at)] for values in each)
        here = at, np.array([pair.scenario for pair in part.pairs])
        losses[here] = loss
        slopes[(*here, slice(None))] = _spread(gradient, columns, len(space.names))
    return losses, slopes


class _Axis(NamedTuple):
    """Static: a parameter's name, and whether its scale is logarithmic."""

    name: str
    log: bool


def _recorded(program: Program, pairs: list[Pair], scenarios: Sequence[Scenario], candidates: list[Constants],
              look: Look) -> Recorded:
    planner = Planner(scenarios, candidates, program.options, program.shape, pairs)
    planned = [planner.planned(pair) for pair in pairs]
    planned += planned[-1:] * (ROWS - len(pairs))
    at = [pair.candidate for pair in pairs] + [pairs[-1].candidate] * (ROWS - len(pairs))
    constants: Any = jax.tree.map(lambda *leaves: np.stack(leaves), *(candidates[index] for index in at))
    plans: Plan = jax.tree.map(lambda *leaves: np.stack(leaves), *(one.plan for one in planned))
    task = Task(stack([one.scenario for one in planned]), plans, constants)
    return Recorded(program, tuple(pairs), task, _record(task, program.options, look.every, look.starts))


@partial(jax.jit, static_argnames=("options", "every", "count"))
def _record(task: Task, options: Options, every: int, count: int) -> OnTheWay:
    return recorded(task, options, every, count)


@partial(jax.jit, static_argnames=("axes", "options", "stretch"))
def _slopes(points: jax.Array, bounds: jax.Array, task: Task, way: OnTheWay, softness: Softness, weights: Loss,
            axes: tuple[_Axis, ...], options: Options, stretch: Stretch) -> tuple[jax.Array, jax.Array]:
    """[R] losses and [R, D'] gradients. points: [R, D']; bounds: [D', 2]; weights: [R] each."""

    def row(point: jax.Array, task: Task, way: OnTheWay, weights: Loss) -> tuple[jax.Array, jax.Array]:
        def loss(point: jax.Array, start: OnTheWay) -> tuple[jax.Array, jax.Array]:
            constants = _constants(point, bounds, axes, task.constants)
            value = stretch_loss(start, task.scenario, task.plan, constants, softness, weights, options, stretch)[0]
            return value, value

        slopes, losses = jax.vmap(jax.jacfwd(loss, has_aux=True), (None, 0))(point, way)
        return jnp.mean(losses), jnp.mean(_cut(slopes), axis=0)

    return jax.vmap(row)(points, task, way, weights)


def _constants(point: jax.Array, bounds: jax.Array, axes: tuple[_Axis, ...], constants: Constants) -> Constants:
    """The constants with those of a point [D'] of the unit cube, as `Space.values` but for eq. 5."""
    values = {}
    for index, axis in enumerate(axes):
        low, high = bounds[index, 0], bounds[index, 1]
        straight = low + point[index] * (high - low)
        values[axis.name] = low * jnp.exp(point[index] * jnp.log(high / low)) if axis.log else straight
    return replace(
        constants,
        weights=replace(constants.weights, **{name: value for name, value in values.items() if name in SCORE}),
        behaviour=replace(constants.behaviour, **{name: value for name, value in values.items() if name in BEHAVIOUR}),
    )


def _cut(slopes: jax.Array) -> jax.Array:
    """[P, D'] no longer than 1 each."""
    squared = jnp.sum(slopes * slopes, axis=1, keepdims=True)
    return slopes / jnp.sqrt(jnp.maximum(squared, 1.0))


def _spread(gradient: np.ndarray, columns: list[int], size: int) -> np.ndarray:
    """[R, D] with 0 in the other parameters."""
    whole = np.zeros((len(gradient), size))
    whole[:, columns] = gradient
    return whole
