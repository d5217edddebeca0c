"""The job file: what to tune, on which scenarios, for what, and how. TOML, read whole before anything runs.

Paths in it are relative to its folder. Every mistake is told, a line each: file: dotted path: value; rule; remedy.
"""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from adwa_jax.presets import PRESETS, ROBOTS
from scenarios.errors import InputError
from scenarios.formats.reading import shown
from tuning.choice import ChoiceSettings
from tuning.methods import METHODS, settings_of
from tuning.robot_file import FARTHEST, FASTEST, SUFFIX
from tuning.sources import MOST_OBSTACLES, Source
from tuning.suite_files import LARGEST_SEED
from tuning.toml_file import read_toml

MOST_EPISODES = 10**9
Share = Annotated[float, Field(gt=0.0, le=1.0)]
Seed = Annotated[int, Field(ge=0, le=LARGEST_SEED)]
Name = Annotated[str, Field(min_length=1, max_length=1024, pattern=r"^[^\x00]*$")]  # of a suite or a file


class Table(BaseModel):
    """A table of the file: nothing but what is named here, and of no other type."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class PlannerTable(Table):
    """The planner whose constants are tuned; what is not tuned stays as it is here."""

    preset: str = "extended"
    robot: Name | None = None  # one of ROBOTS, or a .toml file of limits
    v_max: float | None = Field(default=None, gt=0.0, le=FASTEST)  # [m/s]
    sensor_range: float | None = Field(default=None, gt=0.0, le=FARTHEST)  # [m]
    weights: Name | None = None  # a file of constants to start from


class SuiteTable(Table):
    """Some scenarios, as by the options of `adwa evaluate`."""

    suite: Name | None = None
    suite_file: Name | None = None
    map: Name | None = None
    count: int | None = Field(None, ge=1, le=10**6)
    seed: Seed = 0
    sensed_only: bool = False
    unknown: Literal["free", "occupied"] = "occupied"
    resolution: float = Field(1.0, gt=0.0)  # [m]
    unknown_obstacles: int = Field(5, ge=0, le=MOST_OBSTACLES)
    movers: int = Field(5, ge=0, le=MOST_OBSTACLES)

    @model_validator(mode="after")
    def _one_kind(self) -> "SuiteTable":
        given = [name for name in ("suite", "suite_file", "map") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"{', '.join(given) or 'none'} given; exactly one of suite, suite_file and map says what "
                             "to drive; give one")  # fmt: skip
        return self

    @property
    def label(self) -> str:
        """What it is called in the file."""
        return str(self.suite or self.suite_file or self.map)

    def source(self, folder: Path) -> Source:
        """For `read_suite`; folder: the job file's."""
        file, on_map = (None if text is None else folder / text for text in (self.suite_file, self.map))
        return Source(self.suite, file, on_map, self.count, self.seed, self.unknown, self.resolution,
                      self.unknown_obstacles, self.movers, self.sensed_only)  # fmt: skip


class SuitesTable(Table):
    """Suites that are taken together."""

    suites: list[SuiteTable] = Field(min_length=1)


class ParameterTable(Table):
    """Range and scale of a constant."""

    low: float
    high: float
    scale: Literal["linear", "log", "integer"] = "linear"


class ObjectiveTable(Table):
    """What is to be small or large."""

    measure: str
    direction: Literal["min", "max"]
    worst_share: Share = 1.0


class ConstraintTable(Table):
    """What must hold."""

    measure: str
    at_least: float | None = None
    at_most: float | None = None
    worst_share: Share = 1.0

    @model_validator(mode="after")
    def _one_bound(self) -> "ConstraintTable":
        if (self.at_least is None) == (self.at_most is None):
            given = "none" if self.at_least is None else "both"
            raise ValueError(f"{given} of at_least and at_most given; a constraint has one bound; give one of them")
        return self


class MethodTable(BaseModel):
    """How to search, and for how long; what else is here are the method's own settings."""

    model_config = Table.model_config | ConfigDict(extra="allow")

    name: str
    episodes: int = Field(ge=2, le=MOST_EPISODES)  # on training scenarios, those of the default constants included
    racing: bool = False

    @property
    def settings(self) -> dict[str, Any]:
        """Of the method itself."""
        return dict(self.model_extra or {})


class Job(Table):
    """The whole file."""

    name: str = Field(min_length=1, max_length=100)
    seed: Seed = 0
    planner: PlannerTable = Field(default_factory=PlannerTable)
    training: SuitesTable
    held_out: SuitesTable
    parameters: dict[str, ParameterTable] = Field(min_length=1)
    objectives: list[ObjectiveTable] | None = Field(None, min_length=1)
    constraints: list[ConstraintTable] = []
    method: MethodTable
    choice: ChoiceSettings = Field(default_factory=lambda: ChoiceSettings.model_validate({}))


def load_job(path: Path, folder: Path | None = None) -> Job:
    """The job in a file. folder: that its paths are relative to, if not its own. InputError lists all mistakes."""
    from tuning.job_checks import mistakes_of  # builds on this module

    content: dict[str, Any] = read_toml(path, "a job is a TOML file", "mend the line")
    mistakes = _unknown_names(content)
    try:
        job = Job.model_validate(content)
    except ValidationError as error:
        raise refused(path, _told(error) + mistakes) from None
    mistakes = mistakes or mistakes_of(job, folder or path.resolve().parent)
    if mistakes:
        raise refused(path, mistakes)
    return job


def refused(path: Path, mistakes: Iterable[str]) -> InputError:
    """The error that lists mistakes, "dotted path: value; rule; remedy" each."""
    return InputError("\n".join(f"{path}: {' '.join(mistake.split())}" for mistake in mistakes))


def _unknown_names(content: Mapping[str, Any]) -> list[str]:
    """Mistakes in names from lists that other modules keep, and in the method's own settings."""
    choices = {("planner", "preset"): PRESETS, ("planner", "robot"): ROBOTS, ("method", "name"): METHODS}
    found = []
    for (table, key), names in choices.items():
        value = content[table].get(key) if isinstance(content.get(table), dict) else None
        is_file = key == "robot" and isinstance(value, str) and value.endswith(SUFFIX)
        if isinstance(value, str) and value not in names and not is_file:
            found.append(f"{table}.{key}: {shown(value)}; must be one of {', '.join(names)}; "
                         f"{_remedy(value, names, 'choose one of them')}")  # fmt: skip
    return found + _wrong_settings(content.get("method"))


def _wrong_settings(method: object) -> list[str]:
    """Of the method's own settings."""
    if not isinstance(method, dict) or method.get("name") not in METHODS:
        return []
    model = settings_of(method["name"])
    try:
        model.model_validate({key: value for key, value in method.items() if key not in MethodTable.model_fields})
    except ValidationError as error:
        return _told(error, ("method",), (*MethodTable.model_fields, *model.model_fields))
    return []


def _told(error: ValidationError, place: tuple[str, ...] = (), known: Iterable[str] = ()) -> list[str]:
    """One line for every mistake that pydantic found."""
    return [_sentence(found, place, tuple(known)) for found in error.errors(include_url=False)]


def _sentence(found: Mapping[str, Any], place: tuple[str, ...], known: tuple[str, ...]) -> str:
    where = ".".join(map(str, (*place, *found["loc"])))
    kind, value = found["type"], shown(found["input"])
    if kind == "missing":
        return f"{where}: missing; it has no default; add it"
    if kind == "extra_forbidden":
        names = known or _names_at(found["loc"][:-1])
        return f"{where}: unknown key; the keys are {', '.join(names)}; {_remedy(str(found['loc'][-1]), names)}"
    if kind == "value_error":  # ours
        return f"{where}: {found['ctx']['error']}"
    rule = found["msg"].removeprefix("Input should be ").removeprefix("Value error, ")
    rule = rule if rule.startswith("must") else f"must be {rule[:1].lower()}{rule[1:]}"
    return f"{where}: {value}; {rule}; correct it"


def _names_at(place: tuple[str | int, ...]) -> tuple[str, ...]:
    """Keys of the table at a place in the file."""
    model: type[BaseModel] = Job
    for part in place:
        if part in model.model_fields:  # else the place in a list, or the name of an entry
            model = _model_in(model.model_fields[str(part)].annotation)
    return tuple(model.model_fields)


def _model_in(annotation: Any) -> type[BaseModel]:
    """The table of an annotation such as list[SuiteTable] | None."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(_model_in(part) for part in get_args(annotation) if part not in (str, type(None)))


def _remedy(value: str, names: Iterable[str], otherwise: str = "remove or rename it") -> str:
    near = get_close_matches(value, list(names), n=1)
    return f"did you mean {near[0]}?" if near else otherwise
