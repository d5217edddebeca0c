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

from adwa_jax.constants import Constants
from adwa_jax.heuristic_weight import WeightRule
from adwa_jax.score import ScoreWeights
from scenarios.errors import InputError

SCORE = tuple(field.name for field in fields(ScoreWeights))
RULE = tuple(field.name for field in fields(WeightRule))
OPTIONAL = ("dense_ratio", "sparse_ratio")
Kind = TypeVar("Kind")


def load_weights(path: Path, constants: Constants) -> Constants:
    """`constants` with the file's values in place of theirs. InputError names the file, the key and the remedy."""
    values = _read(path)
    for key in values:
        if key not in SCORE + RULE:
            raise InputError(f"{path}: {key}: unknown key; the keys are {', '.join(SCORE + RULE)}; remove or rename it")
    _require(path, values, SCORE)
    constants = replace(constants, weights=_made(path, ScoreWeights, {key: values[key] for key in SCORE}))
    if any(key in values for key in RULE):
        _require(path, values, tuple(key for key in RULE if key not in OPTIONAL))
        rule = _made(path, WeightRule, {key: values[key] for key in RULE if key in values})
        constants = replace(constants, weight_rule=rule)
    return constants


def parse_weight_rule(text: str) -> WeightRule:
    """The rule of "a,b,c,d": α, β, γ, δ of eq. 5. InputError on anything else."""
    parts = text.split(",")
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        numbers = []
    if len(numbers) != 4:
        raise InputError(f"--weight-rule: {text!r}; must be four numbers a,b,c,d of eq. 5; write for instance 0.5,0.5,1.2,0.6")
    try:
        return WeightRule(*numbers)
    except ValueError as error:
        raise InputError(f"--weight-rule: {error}") from None


def _read(path: Path) -> dict[str, object]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); name an existing TOML file of weights") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not TOML ({error}); write lines such as: clearance = 0.4") from None


def _require(path: Path, values: dict[str, object], keys: tuple[str, ...]) -> None:
    missing = [key for key in keys if key not in values]
    if missing:
        raise InputError(f"{path}: {', '.join(missing)}: missing; {', '.join(keys)} belong together; add "
                         f"{'them' if len(missing) > 1 else 'it'}")


def _made(path: Path, kind: type[Kind], values: dict) -> Kind:
    try:
        return kind(**values)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
