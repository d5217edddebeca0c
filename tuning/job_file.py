"""The job file: what to tune, on which scenarios, for what, and how. TOML, read whole before anything runs.

Paths in it are relative to its folder. Every mistake is told, a line each: file: dotted path: value; rule; remedy.
"""

import re
from collections.abc import Collection, Iterable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, model_validator

from adwa_jax.presets import PRESETS, ROBOTS
from scenarios.errors import InputError
from scenarios.formats.reading import read_toml, shown
from tuning.choice import ChoiceSettings
from tuning.methods import METHODS, settings_of
from tuning.objectives import measures_of
from tuning.robot_file import FARTHEST, FASTEST, SUFFIX
from tuning.sources import MOST_OBSTACLES, Source
from tuning.store import FIGURES
from tuning.suite_files import LARGEST_SEED

MOST_EPISODES = 10**9
OF_TYPE = {  # pydantic's kind of a mistake -> rule, remedy
    "model_type": ("a table", "write its keys in { }, or beneath a line with its name in [ ]"),
    "dict_type": ("a table", "write its keys in { }, or beneath a line with its name in [ ]"),
    "list_type": ("a list", "write it in [ ], or each entry beneath a line with its name in [[ ]]"),
    "string_type": ("text", "write it in quotes"),
    "string_too_short": ("text of one character at least", "name it"),
    "int_type": ("a whole number", "write it without quotes or decimals"),
    "float_type": ("a number", "write it without quotes"),
    "bool_type": ("true or false", "write one of them, without quotes"),
    "too_short": ("one entry at least", "add one"),
}
ON_MAP = ("unknown", "resolution", "unknown_obstacles", "movers")  # what only a suite on one's own map is made with
Share = Annotated[float, Field(gt=0.0, le=1.0)]
Seed = Annotated[int, Field(ge=0, le=LARGEST_SEED)]
Name = Annotated[str, Field(min_length=1, max_length=1024, pattern=r"^[^\x00]*$")]  # of a suite or a file


def one_of(names: Collection[str], suffix: str | None = None) -> AfterValidator:
    """Refuses every other name, with the nearest of them; but for a file's with the suffix."""

    def checked(value: str) -> str:
        if value not in names and not (suffix and value.endswith(suffix)):
            raise ValueError(f"{shown(value)}; must be one of {', '.join(names)}; "
                             f"{nearest(value, names, 'choose one of them')}")  # fmt: skip
        return value

    return AfterValidator(checked)


def nearest(value: str, names: Collection[str], otherwise: str = "remove or rename it") -> str:
    """The remedy for a misspelt name."""
    near = get_close_matches(value, names, n=1)
    return f"did you mean {near[0]}?" if near else otherwise


Measure = Annotated[str, one_of(measures_of(tuple(FIGURES)))]


class Table(BaseModel):
    """A table of the file: nothing but what is named here, and of no other type."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class PlannerTable(Table):
    """The planner whose constants are tuned; what is not tuned stays as it is here."""

    preset: Annotated[str, one_of(PRESETS)] = "extended"
    robot: Annotated[Name, one_of(ROBOTS, SUFFIX)] | None = None  # or a file of limits
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
    unknown_obstacles: int | None = Field(None, ge=0, le=MOST_OBSTACLES)
    movers: int | None = Field(None, ge=0, le=MOST_OBSTACLES)

    @model_validator(mode="after")
    def _one_kind_and_its_keys(self) -> "SuiteTable":
        given = [name for name in ("suite", "suite_file", "map") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"{', '.join(given) or 'none'} given; exactly one of suite, suite_file and map says what "
                             "to drive; give one")  # fmt: skip
        unused = [name for name in ON_MAP if name in self.model_fields_set]
        if unused and self.map is None:
            raise ValueError(f"{', '.join(unused)}: without effect on {self.label}; only suites on a map are made with "
                             f"{'them' if len(unused) > 1 else 'it'}; leave out, or name a map")  # fmt: skip
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

    measure: Measure
    direction: Literal["min", "max"]
    worst_share: Share = 1.0


class ConstraintTable(Table):
    """What must hold."""

    measure: Measure
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

    name: Annotated[str, one_of(METHODS)]
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

    content = read_toml(path, "a job file (TOML)", "mend the line")
    try:
        job, wrong, mistakes = Job.model_validate(content), set(), []
    except ValidationError as error:
        job, wrong = _without(content, [found["loc"] for found in error.errors()])
        mistakes = _told(error)
    mistakes += [*_wrong_settings(content.get("method")),
                 *mistakes_of(job, folder or path.resolve().parent, wrong)]  # fmt: skip
    if mistakes:
        raise refused(path, mistakes)
    return job


def refused(path: Path, mistakes: Iterable[str]) -> InputError:
    """The error that lists mistakes, "dotted path: value; rule; remedy" each."""
    return InputError("\n".join(f"{path}: {' '.join(mistake.split())}" for mistake in mistakes))


def placed(place: str, mistake: object) -> str:
    """A mistake at a place, or at the key there that its text begins with; options of commands are keys here."""
    text = re.sub(r"(?:^|(?<=[ (]))--([a-z][a-z-]*)", lambda option: option[1].replace("-", "_"), str(mistake))
    key, _, rest = text.partition(": ")
    return f"{place}.{key}: {rest}" if key.isidentifier() else f"{place}: {text}"


def _without(content: Mapping[str, Any], places: Collection[tuple[int | str, ...]]) -> tuple[Job, set[int | str]]:
    """The job without the tables, and without the single parameters, in which there are mistakes; and those tables."""
    wrong = {place[0] for place in places if place[0] != "parameters"}
    names = {place[1] for place in places if place[0] == "parameters" and len(place) > 1}
    parameters = content.get("parameters")
    parameters = parameters if isinstance(parameters, dict) else {}
    kept = {**content, "parameters": {name: table for name, table in parameters.items() if name not in names}}
    tables = {name: TypeAdapter(field.annotation).validate_python(kept[name])  # pyright: ignore[reportArgumentType]
              for name, field in Job.model_fields.items() if name in kept and name not in wrong}  # fmt: skip
    return Job.model_construct(**tables), wrong


def _wrong_settings(method: object) -> list[str]:
    """Mistakes in the method's own settings."""
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
        return f"{where}: unknown key; the keys are {', '.join(names)}; {nearest(str(found['loc'][-1]), names)}"
    if kind == "value_error":  # ours
        return placed(where, found["ctx"]["error"])
    rule, remedy = OF_TYPE.get(kind, (_rule_of(found["msg"]), "correct it"))
    return f"{where}: {value}; must be {rule[:1].lower()}{rule[1:]}; {remedy}"


def _rule_of(message: str) -> str:
    """What pydantic asks for, to follow "must"."""
    return message.removeprefix("Input should be ").replace("String should have", "a text of")


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
