"""Plans for the engine, in batches, in the order in which they will be asked for: each once, and none kept for long.

A plan depends on the map and on few of a candidate's constants; what it depends on of the map and the robot's size
alone, the survey, is shared by the plans of all candidates.
"""

from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from functools import partial
from itertools import islice
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.constants import Constants, Options
from adwa_jax.plan import Plan, Survey, plan_lanes, survey_lanes
from adwa_jax.scenario import Scenario
from scenarios.padding import PaddedShape, pad, stack

AT_ONCE = ((64, 16), (128, 4))  # side of the map [cells] up to which so many tasks are planned by one call
FEWEST_AT_ONCE = 1


class Pair(NamedTuple):
    """Indices."""

    candidate: int
    scenario: int


class Planned(NamedTuple):
    """A task on the host: padded, and planned as far as driving needs it."""

    scenario: Scenario
    plan: Plan  # without the search's path and order
    figures: dict[str, np.ndarray]  # of the planned path, [] each


class Planner:
    """Plans for pairs that are asked for in a known order, in which those of one plan stand side by side."""

    def __init__(self, scenarios: Sequence[Scenario], candidates: Sequence[Constants], options: Options,
                 shape: PaddedShape, pairs: Sequence[Pair]):
        self._scenarios, self._candidates, self._options, self._shape = scenarios, candidates, options, shape
        self._radius = [float(constants.robot.radius) for constants in candidates]
        self._constants = [planned_by(constants) for constants in candidates]
        side = max(shape.rows, shape.columns)
        batch = next((count for limit, count in AT_ONCE if side <= limit), FEWEST_AT_ONCE)
        self._surveys = _Ahead(_distinct(pairs, self._survey_key), self._make_surveys, batch)
        self._plans = _Ahead(_distinct(pairs, self._plan_key), self._make_plans, batch)

    @property
    def plans_made(self) -> int:
        """So far."""
        return self._plans.made

    def planned(self, pair: Pair) -> Planned:
        """The pair's task."""
        plan, figures = self._plans.get(self._plan_key(pair))
        return Planned(self._surveys.get(self._survey_key(pair))[0], plan, figures)

    def _survey_key(self, pair: Pair) -> tuple:
        return pair.scenario, self._radius[pair.candidate]

    def _plan_key(self, pair: Pair) -> tuple:
        return pair.scenario, self._constants[pair.candidate]

    def _make_surveys(self, pairs: list[Pair]) -> list[tuple[Scenario, Survey]]:
        padded = [pad(self._scenarios[pair.scenario], self._shape) for pair in pairs]
        with _on_processor():
            surveys = _surveys(stack(padded), self._stacked(pairs), self._options)
        return list(zip(padded, _rows(jax.device_get(surveys), len(pairs)), strict=True))

    def _make_plans(self, pairs: list[Pair]) -> list[tuple[Plan, dict[str, np.ndarray]]]:
        surveyed = [self._surveys.get(self._survey_key(pair)) for pair in pairs]
        scenarios, surveys = (_stacked(column) for column in zip(*surveyed, strict=True))
        with _on_processor():
            made = _plans(scenarios, surveys, self._stacked(pairs), self._options)
        return _rows(jax.device_get(made), len(pairs))

    def _stacked(self, pairs: list[Pair]) -> Constants:
        return _stacked([self._candidates[pair.candidate] for pair in pairs])


def planned_by(constants: Constants) -> tuple[float, ...]:
    """The constants that a plan depends on; the radius, which a survey depends on, first."""
    depends = constants.robot.radius, constants.weight_rule, constants.behaviour.clearance_margin
    return tuple(float(value) for value in jax.tree.leaves(depends))


def planned_columns(planned: Plan) -> dict[str, jax.Array]:
    """The planned path's figures, named apart from the driven path's."""
    return {
        "optimal_length": planned.optimal_length,
        "planned_length": planned.length,
        "planned_length_ratio": planned.length / jnp.where(planned.optimal_length > 0, planned.optimal_length, 1.0),
        "key_point_length": planned.key_point_length,
        "key_point_count": planned.key_point_count,
        "expansions": planned.search.expansions,
        **{f"planned_{name}": value for name, value in planned.measures._asdict().items()},
    }


def for_driving(planned: Plan) -> Plan:
    """The plan without the search's path and order, which no robot needs."""
    search = planned.search._replace(path=jnp.zeros((0, 2), jnp.int32), expanded_at=jnp.zeros((0, 0), jnp.int32))
    return planned._replace(search=search)


class _Ahead:
    """Values made in batches, in the order of their keys; the batches before the last two are forgotten."""

    def __init__(self, keys: dict[Any, Pair], make: Callable[[list[Pair]], list], batch: int):
        self.made = 0
        self._waiting, self._make, self._batch = iter(keys.items()), make, batch
        self._kept: list[dict[Any, Any]] = [{}, {}]

    def get(self, key: Any) -> Any:
        """The key's value, made with those that follow it if it is new."""
        while not any(key in batch for batch in self._kept):
            keys, pairs = zip(*islice(self._waiting, self._batch), strict=True)
            # A call always has as many, so that one program serves: the last repeats.
            values = self._make([*pairs, *pairs[-1:] * (self._batch - len(pairs))])
            self.made += len(pairs)
            self._kept = [self._kept[1], dict(zip(keys, values, strict=False))]
        return next(batch[key] for batch in self._kept if key in batch)


def _distinct(pairs: Iterable[Pair], key: Callable[[Pair], tuple]) -> dict[tuple, Pair]:
    """The first pair of each key, in order."""
    found: dict[tuple, Pair] = {}
    for pair in pairs:
        found.setdefault(key(pair), pair)
    return found


@partial(jax.jit, static_argnames="options")
def _surveys(tasks: Scenario, constants: Constants, options: Options) -> Survey:
    return survey_lanes(tasks.grid, tasks.start[:, :2], tasks.goal, constants, options.plan)


@partial(jax.jit, static_argnames="options")
def _plans(tasks: Scenario, surveys: Survey, constants: Constants, options: Options) -> tuple[Plan, dict]:
    planned = plan_lanes(tasks.grid, tasks.start[:, :2], tasks.goal, constants, options.plan, surveys)
    return jax.vmap(for_driving)(planned), planned_columns(planned)


def _on_processor() -> AbstractContextManager:
    """Even where robots drive on an accelerator: a search, cell after cell, is no work for one."""
    return jax.default_device(jax.local_devices(backend="cpu")[0])


def _stacked(rows: Sequence[Any]) -> Any:
    return jax.tree.map(lambda *leaves: np.stack(leaves), *rows)


def _rows(batch: Any, count: int) -> list[Any]:
    """The rows of every leaf."""
    return [jax.tree.map(lambda leaf, place=place: leaf[place], batch) for place in range(count)]
