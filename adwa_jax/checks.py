"""Refusal of nonsense where settings are made."""

import math
from dataclasses import fields
from typing import Any

import numpy as np


def require(holds: Any, field: str, value: object, rule: str, remedy: str) -> None:
    """Raise ValueError "field = value: rule; remedy" unless `holds`."""
    if not holds:
        raise ValueError(f"{field} = {value:g}: {rule}; {remedy}" if isinstance(value, float)
                         else f"{field} = {value!r}: {rule}; {remedy}")


def require_numbers(settings: Any, least: float) -> bool:
    """Whether every field of a dataclass is a plain number or a tuple of such; each must be finite and ≥ `least`.

    Arrays and tracers pass unseen: they were checked when they were numbers.
    """
    values = _flat({field.name: getattr(settings, field.name) for field in fields(settings)})
    for name, value in values.items():
        require(not isinstance(value, str | bool), name, value, "must be a number", "write it without quotes")
    plain = {name: value for name, value in values.items() if isinstance(value, int | float | np.floating)}
    for name, value in plain.items():
        require(math.isfinite(value) and value >= least, name, float(value), f"must be a finite number ≥ {least:g}",
                "correct it")
    return len(plain) == len(values)


def _flat(values: dict[str, Any]) -> dict[str, Any]:
    """Entries of tuples under names of their own."""
    flat = {}
    for name, value in values.items():
        entries = {f"{name}[{index}]": entry for index, entry in enumerate(value)} if isinstance(value, tuple) else {}
        flat |= entries or {name: value}
    return flat


def require_choice(field: str, value: str, choices: tuple[str, ...]) -> None:
    """Raise ValueError unless `value` is one of `choices`."""
    require(value in choices, field, value, f"must be one of {', '.join(choices)}", "choose one of them")


def require_whole(field: str, value: int, least: int) -> None:
    """Raise ValueError unless `value` is a whole number ≥ `least`."""
    whole = isinstance(value, int) and not isinstance(value, bool)
    require(whole and value >= least, field, value, f"must be a whole number ≥ {least}", "raise it")
