"""What a job file means, and what of it cannot be: planner, space, goals, suites; checks across its tables."""

import hashlib
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np

from adwa_jax.presets import Preset
from adwa_jax.scenario import Scenario
from scenarios.errors import InputError
from scenarios.hiding import hide
from scenarios.suite import SUITE_NAMES, Suite
from tuning.choice import mistakes as choice_mistakes
from tuning.job_file import ConstraintTable, Job, ObjectiveTable, PlannerTable, SuiteTable, nearest, placed, refused
from tuning.objectives import DEFAULT_OBJECTIVES, Constraint, Goals, Statistic
from tuning.options import Vehicle, configured, reach_of
from tuning.plans_only import PLANNED, known_of_plans
from tuning.robot_file import SUFFIX
from tuning.sources import read_suite
from tuning.space import Parameter, Space, tunable
from tuning.store import FIGURES, TILE_WIDTH
from tuning.suite_files import DEFAULT_COUNT
from tuning.weights_file import COUNTS, OF_A_PLAN

MOST = {"success": 1.0, "collision": 1.0, "hit_while_stopped": 1.0, "spl": 1.0, "barn_score": 0.5}
"""Measures that have an upper bound."""
SIGNED = ("least_clearance", "mean_clearance")  # all others are 0 at least
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Setup:
    """All that a job runs with."""

    job: Job
    space: Space
    goals: Goals
    training: Suite
    held_out: Suite
    y_down: bool  # whether all maps have their y axis downwards in pictures
    inputs: dict[str, str]  # place in the file -> checksum of what was read there

    @property
    def plans_only(self) -> bool:
        """Whether nothing is driven."""
        return known_of_plans(self.goals)

    @property
    def figures(self) -> tuple[str, ...]:
        """What is kept of every candidate on every scenario."""
        return (*PLANNED, "outcome") if self.plans_only else tuple(FIGURES)


def mistakes_of(job: Job, folder: Path, wrong: Collection[int | str] = ()) -> list[str]:
    """Mistakes that no table shows by itself, "dotted path: value; rule; remedy" each.

    wrong: tables that the job lacks for their own mistakes; what depends on them is not looked at.
    """
    checks: tuple[tuple[set[str], Iterable[str]], ...] = (
        ({"objectives"}, _repeated_objectives(job)),
        ({"constraints"}, _impossible_constraints(job)),
        ({"training"}, _missing_files(job, folder, "training")),
        ({"held_out"}, _missing_files(job, folder, "held_out")),
        ({"training", "held_out"}, _overlaps(job, folder)),
        ({"training", "method"}, _racing_mistakes(job)),
        ({"planner"}, _parameter_mistakes(job, folder)),
        ({"objectives", "choice"}, _choice_mistakes(job)),
        ({"training", "method"}, _budget_mistakes(job)),
    )
    return [mistake for tables, found in checks if tables.isdisjoint(wrong) for mistake in found]


def remarks_of(space: Space) -> list[str]:
    """What is no mistake, but may not be meant: default constants outside their ranges."""
    low, high = (np.array([getattr(parameter, end) for parameter in space.parameters]) for end in ("low", "high"))
    inside = np.clip(space.default, low, high)
    return [f"parameters.{name}: the default, {default:g}, is outside its range; the default candidate is judged with "
            f"it all the same, and where a method begins at the default it begins at {nearest_in:g}"
            for name, default, nearest_in in zip(space.names, space.default, inside, strict=True)
            if np.float32(default) != np.float32(nearest_in)]  # fmt: skip


def planner_of(table: PlannerTable, folder: Path) -> Preset:
    """The planner with its constants as they are before tuning."""
    weights = None if table.weights is None else folder / table.weights
    robot = str(folder / table.robot) if table.robot and table.robot.endswith(SUFFIX) else table.robot
    return configured(table.preset, Vehicle(robot, table.v_max, table.sensor_range), weights)


def space_of(job: Job, config: Preset) -> Space:
    """What is tuned."""
    return Space(tuple(Parameter(name, table.low, table.high, table.scale) for name, table in job.parameters.items()),
                 config)  # fmt: skip


def goals_of(job: Job) -> Goals:
    """What matters; objectives that are left out are those of §3.4."""
    objectives = DEFAULT_OBJECTIVES if job.objectives is None else tuple(map(_objective, job.objectives))
    return Goals(objectives, tuple(map(_constraint, job.constraints)))


def set_up(job: Job, path: Path, folder: Path, quiet: bool, progress: Progress | None = None) -> Setup:
    """Read the suites. folder: that paths are relative to; path: of the file, for errors.

    InputError for a suite that cannot be had, for scenarios that are in both, and for a budget below all of training
    twice.
    """
    config = planner_of(job.planner, folder)
    places = [(f"{table}.suites.{index}", entry) for table in ("training", "held_out")
              for index, entry in enumerate(getattr(job, table).suites)]  # fmt: skip
    parts, mistakes = [], []
    for place, entry in places:
        try:
            parts.append(_part(place, entry, folder, config, quiet, progress))
        except InputError as error:
            mistakes.append(placed(place, error))
    if mistakes:
        raise refused(path, mistakes)
    training = joined([part.suite for part in parts if part.place.startswith("training")])
    held_out = joined([part.suite for part in parts if part.place.startswith("held_out")])
    mistakes = list(_shared(training, held_out))
    if job.method.episodes < 2 * len(training.scenarios):
        mistakes.append(_too_few(job.method.episodes, len(training.scenarios)))
    if mistakes:
        raise refused(path, mistakes)
    inputs = {part.place: _checksum(part.suite) for part in parts}
    inputs["job"] = hashlib.sha256(job.model_dump_json().encode()).hexdigest()
    inputs["planner"] = hashlib.sha256(repr(config).encode()).hexdigest()
    y_down = all(part.y_down for part in parts)
    return Setup(job, space_of(job, config), goals_of(job), training, held_out, y_down, inputs)


def joined(suites: list[Suite]) -> Suite:
    """Suites one after another; names stay different."""
    if len(suites) == 1:
        return suites[0]
    names = [name for suite in suites for name in suite.names]
    if len(set(names)) < len(names):
        names = [f"{index}-{name}" for index, suite in enumerate(suites) for name in suite.names]
    scenarios = tuple(scenario for suite in suites for scenario in suite.scenarios)
    title = " + ".join(suite.name for suite in suites)
    return Suite(title, scenarios, tuple(names), {"suites": [suite.recipe for suite in suites]})


@dataclass(frozen=True)
class _Part:
    place: str
    suite: Suite
    y_down: bool


def _part(place: str, entry: SuiteTable, folder: Path, config: Preset, quiet: bool,
          progress: Progress | None) -> _Part:
    work = read_suite(entry.source(folder), reach_of(config.constants.robot), quiet, progress)
    return _Part(place, work.suite, work.y_down)


def _objective(table: ObjectiveTable) -> Statistic:
    return Statistic(table.measure, table.direction, table.worst_share)


def _constraint(table: ConstraintTable) -> Constraint:
    if table.at_least is not None:
        return Constraint(Statistic(table.measure, "max", table.worst_share), table.at_least)
    return Constraint(Statistic(table.measure, "min", table.worst_share), float(table.at_most or 0.0))


def _repeated_objectives(job: Job) -> Iterator[str]:
    labels = [_objective(entry).label for entry in job.objectives or []]
    for index, label in enumerate(labels):
        if label in labels[:index]:
            yield f"objectives.{index}: {label}; is there already; remove it"


def _impossible_constraints(job: Job) -> Iterator[str]:
    """Those that nothing can hold, by themselves or beside another: no worst share changes that."""
    entries = [(f"constraints.{index}", entry) for index, entry in enumerate(job.constraints)]
    upper = [(place, entry.measure, entry.at_most) for place, entry in entries if entry.at_most is not None]
    lower = [(place, entry.measure, entry.at_least) for place, entry in entries if entry.at_least is not None]
    for place, measure, bound in upper:
        if bound < 0.0 and measure not in SIGNED:
            yield f"{place}.at_most: {bound:g}; {measure} is never below 0; raise it"
    for place, measure, bound in lower:
        if bound > MOST.get(measure, bound):
            yield f"{place}.at_least: {bound:g}; {measure} is never above {MOST[measure]:g}; lower it"
        for other, same, most in upper:
            if same == measure and bound > most:
                yield (f"{place}.at_least: {bound:g}; {measure} cannot be so and at most {most:g}, as {other}.at_most "
                       "asks for; lower it, raise the other, or remove one")  # fmt: skip


def _missing_files(job: Job, folder: Path, table: str) -> Iterator[str]:
    """Suites that are not there: told beside all else, before any is read."""
    for index, entry in enumerate(getattr(job, table).suites):
        place = f"{table}.suites.{index}"
        for key in ("map", "suite_file"):
            name = getattr(entry, key)
            if name is not None and not (folder / name).exists():
                yield f"{place}.{key}: {name}; no such file; check the name and the path"
        if entry.suite is not None and entry.suite not in SUITE_NAMES and not Path(entry.suite).exists():
            yield (f"{place}.suite: {entry.suite!r}; must be one of {', '.join(SUITE_NAMES)}; "
                   f"{nearest(entry.suite, SUITE_NAMES)}")  # fmt: skip


def _choice_mistakes(job: Job) -> Iterator[str]:
    yield from choice_mistakes(job.choice, goals_of(job))


def _parameter_mistakes(job: Job, folder: Path) -> Iterator[str]:
    apart = (job.planner.model_copy(update={"weights": None}), job.planner.model_copy(update={"robot": None}))
    found = [mistake for table in apart
             for mistake in _failing("planner", lambda table=table: planner_of(table, folder))]  # fmt: skip
    found = list(dict.fromkeys(found)) or list(_failing("planner", lambda: planner_of(job.planner, folder)))
    yield from found
    alone: dict[str, None] = dict.fromkeys(["robot", "v_max", "sensor_range", "weights"])
    config = planner_of(job.planner.model_copy(update=alone) if found else job.planner, folder)
    single = list(_single_mistakes(job, config))
    yield from single
    if not found and not single:
        yield from _failing("parameters", lambda: space_of(job, config))


def _single_mistakes(job: Job, config: Preset) -> Iterator[str]:
    """Of each parameter by itself."""
    names, where = tunable(config.options.rules), f"under preset {job.planner.preset}"
    if known_of_plans(goals_of(job)):
        names, where = tuple(name for name in names if name in OF_A_PLAN), "where all that matters is known of a plan"
    for name, table in job.parameters.items():
        place = f"parameters.{name}"
        if name not in names:
            yield f"{place}: has no effect {where}; must be one of {', '.join(names)}; {nearest(name, names)}"
            continue
        yield from _failing(place, lambda name=name, table=table: Parameter(name, table.low, table.high, table.scale))
        low, high = COUNTS.get(name, (0, table.high))
        if name in COUNTS and not low <= table.low <= table.high <= high:
            yield f"{place}: {table.low:g} to {table.high:g}; must be within {low} to {high}; correct it"


def _racing_mistakes(job: Job) -> Iterator[str]:
    counts = [_counted(entry) for entry in job.training.suites]
    if job.method.racing and None not in counts and sum(filter(None, counts)) <= TILE_WIDTH:
        yield (f"method.racing: true; a race begins on {TILE_WIDTH} training scenarios, there must be more; raise "
               "their count, or leave racing out")  # fmt: skip


def _budget_mistakes(job: Job) -> Iterator[str]:
    """As far as the counts are known before any suite is read."""
    counts = [_counted(entry) for entry in job.training.suites]
    scenarios = sum(filter(None, counts))
    if None not in counts and job.method.episodes < 2 * scenarios:
        yield _too_few(job.method.episodes, scenarios)


def _counted(entry: SuiteTable) -> int | None:
    return entry.count or (None if entry.suite_file or entry.suite not in (None, *SUITE_NAMES) else DEFAULT_COUNT)


def _too_few(episodes: int, scenarios: int) -> str:
    return (f"method.episodes: {episodes}; the default constants and one more candidate on {scenarios} training "
            f"scenarios take {2 * scenarios}; raise it, or drive fewer scenarios")  # fmt: skip


def _overlaps(job: Job, folder: Path) -> Iterator[str]:
    """Suites of one recipe and seed, in training and held out; or twice in one of them."""
    seen: dict[tuple, str] = {}
    for table in ("training", "held_out"):
        for index, entry in enumerate(getattr(job, table).suites):
            place = f"{table}.suites.{index}"
            where = entry.suite or str((folder / str(entry.suite_file or entry.map)).resolve())
            first = seen.setdefault((where, entry.seed), place)
            if first != place:
                yield (f"{place}: {entry.label}, seed {entry.seed}; overlaps {first}, whose scenarios are the same as "
                       "far as both go; give it another seed, or another map or file")  # fmt: skip


def _shared(training: Suite, held_out: Suite) -> Iterator[str]:
    known = {_world(scenario): name for scenario, name in zip(training.scenarios, training.names, strict=True)}
    same = [(name, known[world]) for scenario, name in zip(held_out.scenarios, held_out.names, strict=True)
            if (world := _world(scenario)) in known]  # fmt: skip
    if same:
        yield (f"held_out: {len(same)} of {len(held_out.names)} scenarios are training scenarios too ({same[0][0]} is "
               f"{same[0][1]}); none may be; choose other seeds, maps or files")  # fmt: skip


def _world(scenario: Scenario) -> bytes:
    """A checksum of map and task, whatever the robot knows of them beforehand."""
    return _content(hide(scenario))


def _content(scenario: Scenario) -> bytes:
    """A checksum of all that a scenario is."""
    digest = hashlib.sha256()
    for leaf in jax.tree.leaves(scenario):
        array = np.asarray(leaf)
        digest.update(f"{array.dtype.str}{array.shape}".encode() + array.tobytes())
    return digest.digest()


def _checksum(suite: Suite) -> str:
    return hashlib.sha256(b"".join(map(_content, suite.scenarios)) + "\n".join(suite.names).encode()).hexdigest()


def _failing(place: str, make: Callable[[], object]) -> Iterator[str]:
    """The mistake for which something cannot be made."""
    try:
        make()
    except InputError as error:
        yield placed(place, error)
