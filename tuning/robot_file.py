"""A robot's size and limits as a TOML file. What is left out is as the robot has it that it is read for.

    radius = 0.2               # of each disc [m]
    v_min = 0.0                # [m/s]; negative: may reverse, under a preset that does
    v_max = 0.6                # [m/s]
    yaw_rate_max = 1.5         # [rad/s], both ways
    acceleration = 1.0         # [m/s²], and so on: the fields of `adwa_jax.window.RobotLimits`
    disc_offsets = [0.0]       # centres of the discs, ahead of the robot's own [m]
"""

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from adwa_jax.window import RobotLimits
from scenarios.errors import InputError
from scenarios.formats.reading import bad_input, read_toml, shown

SUFFIX = ".toml"  # tells a file from a robot's name
FASTEST = 10.0  # [m/s]
FARTHEST = 1e4  # [m]
OFFSETS = "disc_offsets"
KEYS = tuple(field.name for field in fields(RobotLimits))


def load_robot(path: Path, robot: RobotLimits) -> RobotLimits:
    """`robot` with the file's values in place of its own. InputError names the file, the key and the remedy."""
    content = read_toml(path, "a file of robot limits (TOML)", "write lines such as: radius = 0.2")
    for key, value in content.items():
        _require_known(path, key)
        for number in _listed(path, value) if key == OFFSETS else [value]:
            _require_number(path, key, number)
    lists: dict[str, Any] = {key: tuple(_listed(path, content[key])) for key in (OFFSETS,) if key in content}
    try:
        return replace(robot, **(content | lists))
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None


def _require_known(path: Path, key: str) -> None:
    if key not in KEYS:
        raise bad_input(path, f"{key}: unknown key", f"the keys are {', '.join(KEYS)}", "remove or rename it")


def _listed(path: Path, value: object) -> list[object]:
    if not isinstance(value, list) or not value:
        raise bad_input(path, f"{OFFSETS} = {shown(value)}", "must be a list of one number or more",
                        "write them in brackets")
    return value


def _require_number(path: Path, key: str, value: object) -> None:
    most = FASTEST if key in ("v_min", "v_max") else FARTHEST
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= most:  # NaN too
        raise bad_input(path, f"{key} = {shown(value)}", f"must be a number, at most {most:g}", "correct it")
