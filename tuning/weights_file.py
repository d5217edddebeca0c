"""Tuned constants as a TOML file: the score weights of eq. 9 and, if given, the ω constants of eq. 5.

    local_heading = 0.4        # α, eq. 9
    clearance = 0.4            # β
    velocity = 0.6             # γ
    global_heading = 0.1       # δ
    dense_base = 0.5           # α, eq. 5; these four together or not at all
    dense_gain = 0.5           # β
    sparse_base = 1.2          # γ
    sparse_gain = 0.6          # δ
    dense_ratio = 1.5          # may be left out
    sparse_ratio = 0.5         # may be left out
"""

import tomllib
from dataclasses import fields, replace
from pathlib import Path
from typing import TypeVar

import jax
import numpy as np

from adwa_jax.constants import Constants
from adwa_jax.heuristic_weight import WeightRule
from adwa_jax.score import ScoreWeights
from scenarios.errors import InputError
from scenarios.formats.reading import bad_input, shown

SCORE = tuple(field.name for field in fields(ScoreWeights))
RULE = tuple(field.name for field in fields(WeightRule))
OPTIONAL = ("dense_ratio", "sparse_ratio")
LARGEST = 1e6  # beyond it sums of weighted terms may leave float32
Kind = TypeVar("Kind", ScoreWeights, WeightRule)


def load_weights(path: Path, constants: Constants) -> Constants:
    """`constants` with the file's values in place of theirs. InputError names the file, the key and the remedy."""
    values = _read(path)
    numbers = {key: _number(path, key, value) for key, value in values.items()}
    _require(path, numbers, SCORE)
    score = {key: numbers[key] for key in SCORE}
    constants = replace(constants, weights=_made(str(path), ScoreWeights, score))
    rule = {key: numbers[key] for key in RULE if key in numbers}
    if rule:
        _require(path, numbers, tuple(key for key in RULE if key not in OPTIONAL))
        constants = replace(constants, weight_rule=_made(str(path), WeightRule, rule))
    return constants


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


def _read(path: Path) -> dict[str, object]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise bad_input(path, f"cannot be read ({error.strerror})", "weights are a TOML file",
                        "name an existing one") from None
    except (ValueError, RecursionError) as error:
        raise bad_input(path, f"not TOML ({error})", "weights are a TOML file",
                        "write lines such as: clearance = 0.4") from None


def _number(path: Path, key: str, value: object) -> float:
    if key not in SCORE + RULE:
        raise bad_input(path, f"{key}: unknown key", f"the keys are {', '.join(SCORE + RULE)}", "remove or rename it")
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise bad_input(path, f"{key} = {shown(value)}", "must be a number", "write it without quotes or brackets")
    if not 0.0 <= value <= LARGEST:  # NaN too
        raise bad_input(path, f"{key} = {shown(value)}", f"must be a finite number from 0 to {LARGEST:g}", "correct it")
    return float(value)


def _require(path: Path, values: dict[str, float], keys: tuple[str, ...]) -> None:
    missing = [key for key in keys if key not in values]
    if missing:
        raise bad_input(path, f"{', '.join(missing)}: missing", f"{', '.join(keys)} belong together",
                        f"add {'them' if len(missing) > 1 else 'it'}")


def _made(where: str, kind: type[Kind], values: dict[str, float]) -> Kind:
    """The constants; refused as well if only rounding to float32, in which they are used, breaks their rule."""
    try:
        made = kind(**values)
        jax.tree.map(np.float32, made)
        return made
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None
