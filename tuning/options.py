"""The options that several commands share, and the planner they make."""

from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from adwa_jax.constants import Constants
from adwa_jax.presets import PRESETS, ROBOTS, Preset, on_robot
from adwa_jax.window import RobotLimits
from scenarios.errors import InputError
from scenarios.suite import SUITE_NAMES
from tuning.robot_file import FARTHEST, FASTEST, SUFFIX, load_robot
from tuning.sources import OBSTACLES
from tuning.suite_files import KINDS
from tuning.weights_file import load_weights


class UnknownPolicy(StrEnum):
    """What a map's unknown cells count as."""

    free = "free"
    occupied = "occupied"


MAP_HELP = "MovingAI .map, ROS .yaml, BARN .world(.gz) or an image."
MapOption = Annotated[Path | None, typer.Option("--map", help=MAP_HELP)]
SuiteOption = Annotated[str | None, typer.Option("--suite", help=f"One of {', '.join(SUITE_NAMES)}.")]
SuiteFileOption = Annotated[Path | None, typer.Option(help=f"{KINDS[0].upper()}{KINDS[1:]}.")]
CountOption = Annotated[int | None, typer.Option("--count", help="How many scenarios; default: 100, or all of a file.")]
SeedOption = Annotated[int, typer.Option(help="Seed of scenarios that are made.")]
SensedOnlyOption = Annotated[bool, typer.Option("--sensed-only", help="The robot has no map, only its senses.")]
PresetOption = Annotated[str, typer.Option(help=f"One of {', '.join(PRESETS)}.")]
WeightsOption = Annotated[Path | None, typer.Option(help="TOML of constants that stand in for the preset's.")]
ROBOT_HELP = f"One of {', '.join(ROBOTS)}, or a TOML file of limits; default: the preset's."
RobotOption = Annotated[str | None, typer.Option(help=ROBOT_HELP)]
SpeedOption = Annotated[float | None, typer.Option("--v-max", help="The robot's top speed, in m/s.")]
RangeOption = Annotated[float | None, typer.Option("--sensor-range", help="How far the robot senses, in metres.")]
JsonOption = Annotated[Path | None, typer.Option("--json", help="Write the results as JSON to this file, or print: -")]
UnknownOption = Annotated[UnknownPolicy, typer.Option(help="What a map's unknown cells count as.")]
ResolutionOption = Annotated[float, typer.Option(help="Side of a pixel of a plain image, in metres.")]
SquaresOption = Annotated[int | None, typer.Option(help=f"With --map: unknown static obstacles; default: {OBSTACLES}.")]
MoversOption = Annotated[int | None, typer.Option(help=f"With --map: movers; default: {OBSTACLES}.")]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


@dataclass(frozen=True)
class Vehicle:
    """The options that say with which robot; None: as the preset has it."""

    robot: str | None = None  # a name of ROBOTS, or a .toml file of limits
    v_max: float | None = None  # [m/s]
    sensor_range: float | None = None  # [m]

    def __post_init__(self):
        """Refuse what no robot can have."""
        if self.robot is not None and self.robot not in ROBOTS and not self.robot.endswith(SUFFIX):
            raise InputError(f"--robot: {self.robot!r}; the robots are {', '.join(ROBOTS)}; choose one of them, or a "
                             f"{SUFFIX} file of limits")  # fmt: skip
        if self.v_max is not None and not 0.0 < self.v_max <= FASTEST:
            raise InputError(f"--v-max: {self.v_max:g}; must be above 0 and at most {FASTEST:g} m/s; correct it")
        if self.sensor_range is not None and not 0.0 < self.sensor_range <= FARTHEST:
            raise InputError(f"--sensor-range: {self.sensor_range:g}; must be above 0 and at most {FARTHEST:g} m; "
                             "correct it")  # fmt: skip

    def driving(self, config: Preset) -> Preset:
        """The planner on this robot."""
        if self.robot is not None or self.v_max is not None:
            config = on_robot(config, self._limits(config.constants))
        if self.sensor_range is None:
            return config
        behaviour = replace(config.constants.behaviour, sensor_range=self.sensor_range)
        return config._replace(constants=replace(config.constants, behaviour=behaviour))

    def _limits(self, constants: Constants) -> RobotLimits:
        if self.robot in ROBOTS:
            limits = ROBOTS[self.robot]()
        else:
            limits = constants.robot if self.robot is None else load_robot(Path(self.robot), constants.robot)
        return limits if self.v_max is None else replace(limits, v_max=self.v_max)


def configured(preset: str, vehicle: Vehicle, weights: Path | None = None) -> Preset:
    """The preset on the robot, the file's constants in place of its own."""
    if preset not in PRESETS:
        raise InputError(f"--preset: {preset!r}; the presets are {', '.join(PRESETS)}; choose one of them")
    config = vehicle.driving(PRESETS[preset]())
    return config if weights is None else load_weights(weights, config)


def require_one_disc(option: str, config: Preset) -> None:
    """Raises InputError for a robot of several discs."""
    discs = len(config.constants.robot.disc_offsets)
    if discs != 1:
        raise InputError(f"{option}: the robot has {discs} discs; it must be one disc; choose --robot disc, or leave "
                         f"{option} out")


def reach_of(robot: RobotLimits) -> float:
    """Radius [m] of the disc about the robot's centre that holds it whichever way it turns."""
    return float(robot.radius) + max(abs(float(offset)) for offset in robot.disc_offsets)
