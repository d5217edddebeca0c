"""What may be tuned: constants by name, each with its range and scale, as points of the unit cube.

Dimension letters: C candidates; D parameters.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, get_args

import numpy as np

from adwa_jax.constants import Constants
from adwa_jax.heuristic_weight import WeightRule
from adwa_jax.presets import Preset
from adwa_jax.rules import Rules
from scenarios.errors import InputError
from tuning.weights_file import BEHAVIOUR, COUNTS, LARGEST, RULE, SCORE, in_use

Scale = Literal["linear", "log", "integer"]
EQ5_SLACK = 1e-4  # by which ω stays below 1 where dense: float32 must not round it up


@dataclass(frozen=True)
class Parameter:
    """One constant that may be tuned."""

    name: str  # of `tunable`
    low: float
    high: float
    scale: Scale = "linear"

    def __post_init__(self):
        """Refuse empty ranges and scales that do not fit them."""
        if not 0.0 <= self.low < self.high <= LARGEST:  # NaN too
            raise InputError(f"low, high: {self.low:g}, {self.high:g}; must be 0 ≤ low < high ≤ {LARGEST:g}; "
                             "correct them")  # fmt: skip
        if self.scale not in get_args(Scale):
            raise InputError(f"scale: {self.scale!r}; must be one of {', '.join(get_args(Scale))}; choose one of them")
        if self.scale == "log" and self.low == 0.0:
            raise InputError("low: 0; must be above 0 on a log scale; raise it, or take scale = \"linear\"")
        if (self.scale == "integer") != (self.name in COUNTS):
            kind = "integer" if self.name in COUNTS else "linear or log"
            raise InputError(f"scale: {self.scale!r}; the scale of {self.name} must be {kind}; correct it")
        if self.scale == "integer" and not (float(self.low).is_integer() and float(self.high).is_integer()):
            raise InputError(f"low, high: {self.low:g}, {self.high:g}; must be whole numbers; correct them")


@dataclass(frozen=True)
class Space:
    """The unit cube of D parameters about a planner that keeps all other constants."""

    parameters: tuple[Parameter, ...]  # D
    base: Preset

    def __post_init__(self):
        """Refuse parameters without effect, and ranges in which eq. 5's promise cannot be kept."""
        for parameter in self.parameters:
            _require_tunable(parameter.name, self.base.options.rules)
        _require_room(self)

    @property
    def names(self) -> tuple[str, ...]:
        """D."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def default(self) -> np.ndarray:
        """[D] the base's own values, inside their ranges or not."""
        return np.array([constant(self.base, name) for name in self.names])

    def values(self, unit: np.ndarray) -> np.ndarray:
        """[C, D] float64 constants of points [C, D] of the unit cube; moved by the least that eq. 5 asks for."""
        unit = np.clip(np.asarray(unit, np.float64), 0.0, 1.0)
        columns = [_scaled(parameter, unit[:, index]) for index, parameter in enumerate(self.parameters)]
        return np.array([self._kept(row) for row in np.stack(columns, axis=1)]).reshape(unit.shape)

    def unit(self, values: np.ndarray) -> np.ndarray:
        """[C, D] in the unit cube: the inverse of `values`; what lies beyond a range is put on its end."""
        values = np.asarray(values, np.float64)
        columns = [_unscaled(parameter, values[:, index]) for index, parameter in enumerate(self.parameters)]
        return np.stack(columns, axis=1)

    def preset(self, values: np.ndarray) -> Preset:
        """The planner with a candidate's constants, values: [D]."""
        return with_constants(self.base, dict(zip(self.names, np.asarray(values).tolist(), strict=True)))

    def _kept(self, row: np.ndarray) -> np.ndarray:
        """[D] constants that keep eq. 5's promise."""
        given = dict(zip(self.names, row.tolist(), strict=True))
        low = {parameter.name: parameter.low for parameter in self.parameters}
        rule = _rule_values(self.base.constants.weight_rule) | {name: given[name] for name in RULE if name in given}
        kept = _with_promise(rule, low)
        return np.array([kept.get(name, given[name]) for name in self.names])


def tunable(rules: Rules) -> tuple[str, ...]:
    """Names of all constants that have an effect under the rules."""
    return tuple(name for name in (*SCORE, *RULE, *BEHAVIOUR, *COUNTS) if in_use(name, rules))


def constant(config: Preset, name: str) -> float:
    """A constant's value by name."""
    for part in (config.constants.weights, config.constants.weight_rule, config.constants.behaviour,
                 config.options.dwa):  # fmt: skip
        if hasattr(part, name):
            return float(getattr(part, name))
    raise KeyError(name)


def with_constants(config: Preset, values: Mapping[str, float]) -> Preset:
    """The planner with some constants, by name, in place of its own."""
    constants, options = config.constants, config.options
    counts = {name: round(values[name]) for name in COUNTS if name in values}
    constants = Constants(
        weight_rule=replace(constants.weight_rule, **_of(values, RULE)),
        weights=replace(constants.weights, **_of(values, SCORE)),
        robot=constants.robot,
        behaviour=replace(constants.behaviour, **_of(values, BEHAVIOUR)),
    )
    return Preset(constants, replace(options, dwa=replace(options.dwa, **counts)) if counts else options)


def _of(values: Mapping[str, float], names: tuple[str, ...]) -> dict[str, Any]:
    return {name: values[name] for name in names if name in values}


def _scaled(parameter: Parameter, unit: np.ndarray) -> np.ndarray:
    low, high = parameter.low, parameter.high
    if parameter.scale == "log":
        return np.exp(np.log(low) + unit * (np.log(high) - np.log(low)))
    if parameter.scale == "integer":  # each value has an equal share of the range
        return np.minimum(np.floor(low + unit * (high - low + 1.0)), high)
    return low + unit * (high - low)


def _unscaled(parameter: Parameter, values: np.ndarray) -> np.ndarray:
    low, high = parameter.low, parameter.high
    values = np.clip(values, low, high)
    if parameter.scale == "log":
        return (np.log(values) - np.log(low)) / (np.log(high) - np.log(low))
    if parameter.scale == "integer":
        return (values - low + 0.5) / (high - low + 1.0)
    return (values - low) / (high - low)


def _rule_values(rule: WeightRule) -> dict[str, float]:
    return {field.name: float(getattr(rule, field.name)) for field in fields(rule)}


def _with_promise(rule: dict[str, float], low: Mapping[str, float]) -> dict[str, float]:
    """Constants of eq. 5 such that ω < 1 where dense: of those in `low`, the tuned ones with their lowest values,
    the gain gives way first, then the base, then the thresholds.
    """
    kept = dict(rule)
    if kept["sparse_ratio"] > kept["dense_ratio"]:
        tuned = "sparse_ratio" if "sparse_ratio" in low else "dense_ratio"
        other = "dense_ratio" if tuned == "sparse_ratio" else "sparse_ratio"
        kept[tuned] = kept[other]
    ceiling = 1.0 - EQ5_SLACK
    if "dense_gain" in low:
        most = max((ceiling - kept["dense_base"]) * kept["dense_ratio"], low["dense_gain"])
        kept["dense_gain"] = min(kept["dense_gain"], most)
    if "dense_base" in low:
        kept["dense_base"] = max(min(kept["dense_base"], ceiling - kept["dense_gain"] / kept["dense_ratio"]),
                                 low["dense_base"])  # fmt: skip
    return kept


def _require_tunable(name: str, rules: Rules) -> None:
    if name not in tunable(rules):
        raise InputError(f"{name}: cannot be tuned; what has an effect under the preset is "
                         f"{', '.join(tunable(rules))}; remove or rename it")  # fmt: skip


def _require_room(space: Space) -> None:
    """Eq. 5 must hold at the worst corner that `_with_promise` can be left with."""
    tuned = {parameter.name: parameter for parameter in space.parameters}
    rule = _rule_values(space.base.constants.weight_rule)
    worst = {name: (tuned[name].high if name in ("sparse_base", "sparse_gain", "sparse_ratio") else tuned[name].low)
             for name in RULE if name in tuned}  # fmt: skip
    try:
        if any(name in tuned for name in RULE):
            WeightRule(**_with_promise(rule | worst, {name: tuned[name].low for name in tuned}))
            if "sparse_base" in tuned:
                WeightRule(**_with_promise(rule | worst | {"sparse_base": tuned["sparse_base"].low},
                                           {name: tuned[name].low for name in tuned}))  # fmt: skip
    except ValueError as error:
        raise InputError(f"ranges of eq. 5's constants: {error}") from None
