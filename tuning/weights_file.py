"""Tuned constants as a TOML file: the score weights of eq. 9, the ω constants of eq. 5, and those of the rules in use.

    local_heading = 0.4        # α, eq. 9; under the paper's method these four together
    clearance = 0.4            # β
    velocity = 0.6             # γ
    global_heading = 0.1       # δ
    dense_base = 0.5           # α, eq. 5; these four together or not at all
    dense_gain = 0.5           # β
    sparse_base = 1.2          # γ
    sparse_gain = 0.6          # δ
    dense_ratio = 1.5          # may be left out
    sparse_ratio = 0.5         # may be left out
    clearance_cap = 0.5        # [m]; this and what follows may be left out
    contact_time = 1.5         # only with the rule that uses it
    horizon_steps = 20         # static counts of the DWA, whole numbers; another value compiles anew

A key that the preset's rules leave without effect is refused.
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import TypeVar

import jax
import numpy as np

from adwa_jax.constants import Behaviour
from adwa_jax.heuristic_weight import WeightRule
from adwa_jax.presets import Preset, paper
from adwa_jax.rules import Rules
from adwa_jax.score import ScoreWeights
from scenarios.errors import InputError
from scenarios.formats.reading import bad_input, read_toml, shown

SCORE = tuple(field.name for field in fields(ScoreWeights))
RULE = tuple(field.name for field in fields(WeightRule))
OF_A_PLAN = (*RULE, "clearance_margin")  # what a plan depends on
BEHAVIOUR = ("clearance_cap", "clearance_margin", "static_margin", "mover_margin", "mover_growth", "mover_cap",
             "lookahead", "route_margin")  # fmt: skip
# Counts of `DwaOptions`, each with its range: another value compiles anew, and a decision's cost grows with all three.
COUNTS = {"v_samples": (2, 101), "yaw_rate_samples": (2, 101), "horizon_steps": (1, 200)}
OPTIONAL = ("dense_ratio", "sparse_ratio")
REPLACED = ("velocity", "global_heading")  # by progress
# What has an effect only with a rule.
NEEDS = {
    "progress": "progress", "on_route": "progress", "contact_time": "mover_terms", "mover_clearance": "mover_terms",
    "forward": "reverse", "static_margin": "stopping", "mover_margin": "mover_margin", "mover_growth": "mover_margin",
    "mover_cap": "mover_terms", "lookahead": "carrot", "route_margin": "replan",
}  # fmt: skip
LARGEST = 1e6  # beyond it sums of weighted terms may leave float32
UNITS = {name: "m/s" if name == "mover_growth" else "m" for name in BEHAVIOUR}  # of the constants; the others have none
MEANINGS = {  # of every key; weights are of normalised terms
    "local_heading": "weight α of eq. 9: facing the local target",
    "clearance": "weight β of eq. 9: distance to obstacles",
    "velocity": "weight γ of eq. 9: speed",
    "global_heading": "weight δ of eq. 9: facing the goal",
    "progress": "weight: way made along the route",
    "on_route": "weight: staying near the route",
    "contact_time": "weight: time until a mover would be touched",
    "mover_clearance": "weight: distance to movers",
    "forward": "weight: not driving in reverse",
    "dense_base": "α of eq. 5, where obstacles are dense",
    "dense_gain": "β of eq. 5, where obstacles are dense",
    "sparse_base": "γ of eq. 5, where obstacles are sparse",
    "sparse_gain": "δ of eq. 5, where obstacles are sparse",
    "dense_ratio": "dense is from this P/Q on",
    "sparse_ratio": "sparse is below this P/Q",
    "clearance_cap": "distance to obstacles counts no further",
    "clearance_margin": "key-point segments keep more than this from occupied cells",
    "static_margin": "kept from obstacles that stand, by a braking robot",
    "mover_margin": "kept from movers, by a braking robot",
    "mover_growth": "growth of mover_margin with the time predicted",
    "mover_cap": "distance to movers counts no further",
    "lookahead": "to the local target, along the route",
    "route_margin": "a route's cells keep this much more than the radius from squares",
    "v_samples": "count: speeds in the window",
    "yaw_rate_samples": "count: yaw rates in the window",
    "horizon_steps": "count: steps predicted",
}
Kind = TypeVar("Kind", ScoreWeights, WeightRule, Behaviour)


def load_weights(path: Path, config: Preset) -> Preset:
    """`config` with the file's values in place of its own. InputError names the file, the key and the remedy."""
    constants, options = config
    rules, numbers = options.rules, _numbers(path)
    for key in numbers:
        _require_effect(path, key, rules)
    if not rules.progress:
        _require(path, numbers, tuple(key for key in SCORE if in_use(key, rules) and key not in NEEDS))
    made = replace(
        constants,
        weights=_replaced(path, constants.weights, numbers, SCORE),
        weight_rule=_rule(path, constants.weight_rule, numbers),
        behaviour=_replaced(path, constants.behaviour, numbers, BEHAVIOUR),
    )
    _require_a_weight(path, made.weights, rules)
    counts = {key: round(numbers[key]) for key in COUNTS if key in numbers}
    return Preset(made, replace(options, dwa=replace(options.dwa, **counts)))


def load_weight_rule(path: Path) -> WeightRule:
    """The constants of eq. 5 in a file of weights of any preset. InputError if it has none."""
    numbers = _numbers(path)
    if not any(key in RULE for key in numbers):
        raise bad_input(path, "no constant of eq. 5", f"planning depends on {', '.join(RULE)}", "add them")
    return _rule(path, paper().constants.weight_rule, numbers)


def weights_text(config: Preset) -> str:
    """The TOML of every constant that has an effect, counts included, each with its meaning, which `load_weights` reads
    back to the same values.
    """
    constants, options = config
    parts = ((constants.weights, SCORE), (constants.weight_rule, RULE), (constants.behaviour, BEHAVIOUR))
    values = {key: _decimal(getattr(part, key)) for part, keys in parts for key in keys if in_use(key, options.rules)}
    values |= {key: str(getattr(options.dwa, key)) for key in COUNTS}
    units = {key: f" [{UNITS[key]}]" if key in UNITS else "" for key in values}
    return "".join(f"{f'{key} = {value}':<28}# {MEANINGS[key]}{units[key]}\n" for key, value in values.items())


def in_use(key: str, rules: Rules) -> bool:
    """Whether a constant has an effect under the rules."""
    if key in REPLACED:
        return not rules.progress
    return key not in NEEDS or getattr(rules, NEEDS[key])


def parse_weight_rule(text: str) -> WeightRule:
    """The rule of "a,b,c,d": α, β, γ, δ of eq. 5. InputError on anything else."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 4 or not all(0.0 <= number <= LARGEST for number in numbers):
        raise bad_input("--weight-rule", shown(text), f"must be four numbers a,b,c,d of eq. 5, from 0 to {LARGEST:g}",
                        "write for instance 0.5,0.5,1.2,0.6")
    return _made("--weight-rule", WeightRule, dict(zip(RULE, numbers, strict=False)))


def _numbers(path: Path) -> dict[str, float]:
    read = read_toml(path, "a file of weights (TOML)", "write lines such as: clearance = 0.4")
    return {key: _number(path, key, value) for key, value in read.items()}


def _number(path: Path, key: str, value: object) -> float:
    known = (*SCORE, *RULE, *BEHAVIOUR, *COUNTS)
    if key not in known:
        raise bad_input(path, f"{key}: unknown key", f"the keys are {', '.join(known)}", "remove or rename it")
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise bad_input(path, f"{key} = {shown(value)}", "must be a number", "write it without quotes or brackets")
    if key in COUNTS:
        low, high = COUNTS[key]
        if not (isinstance(value, int) and low <= value <= high):
            raise bad_input(path, f"{key} = {shown(value)}", f"must be a whole number from {low} to {high}",
                            "correct it")
    elif not 0.0 <= value <= LARGEST:  # NaN too
        raise bad_input(path, f"{key} = {shown(value)}", f"must be a finite number from 0 to {LARGEST:g}", "correct it")
    return float(value)


def _require_effect(path: Path, key: str, rules: Rules) -> None:
    if in_use(key, rules):
        return
    if key in REPLACED:
        raise bad_input(path, f"{key}: without effect", "the preset's rule 'progress' stands in its place",
                        "remove it, or choose --preset paper")
    raise bad_input(path, f"{key}: without effect", f"the preset's rule '{NEEDS[key]}' is off",
                    "remove it, or choose --preset extended")


def _rule(path: Path, rule: WeightRule, numbers: dict[str, float]) -> WeightRule:
    if any(key in RULE for key in numbers):
        _require(path, numbers, tuple(key for key in RULE if key not in OPTIONAL))
    return _replaced(path, rule, numbers, RULE)


def _require(path: Path, values: Mapping[str, float], keys: tuple[str, ...]) -> None:
    missing = [key for key in keys if key not in values]
    if missing:
        raise bad_input(path, f"{', '.join(missing)}: missing", f"{', '.join(keys)} belong together",
                        f"add {'them' if len(missing) > 1 else 'it'}")


def _require_a_weight(path: Path, weights: ScoreWeights, rules: Rules) -> None:
    """All candidates would score alike."""
    keys = [key for key in SCORE if in_use(key, rules)]
    if not any(float(getattr(weights, key)) > 0.0 for key in keys):
        raise bad_input(path, f"{', '.join(keys)}: all 0", "at least one weight must be above 0", "raise one")


def _replaced(path: Path, part: Kind, numbers: dict[str, float], keys: tuple[str, ...]) -> Kind:
    """The part with those of its fields that the file gives."""
    values = {field.name: getattr(part, field.name) for field in fields(part)}
    given = {key: numbers[key] for key in keys if key in numbers}
    return _made(str(path), type(part), values | given) if given else part


def _decimal(value: object) -> str:
    """The shortest decimal that is the same number in float32."""
    return repr(float(str(np.float32(value))))  # pyright: ignore[reportArgumentType]


def _made(where: str, kind: type[Kind], values: dict[str, float]) -> Kind:
    """The constants; refused as well if only rounding to float32, in which they are used, breaks their rule."""
    try:
        made = kind(**values)
        jax.tree.map(np.float32, made)
        return made
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None
