"""Where a command's work comes from: queries on a map, and suites from their options."""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from adwa_jax.grid import Grid
from scenarios.errors import InputError
from scenarios.formats import MapFile, load_map, load_scen
from scenarios.formats.reading import LARGEST, bad_input, shown
from scenarios.suite import SUITE_NAMES, Suite, make_suite, suite_on_map, without_maps
from tuning.console import note
from tuning.suite_files import DEFAULT_COUNT, suite_in

OBSTACLES, MOST_OBSTACLES = 5, 10_000  # of each kind in a scenario on a user's map: by default, and at most
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Queries:
    """Q starts and goals on one map."""

    points: np.ndarray  # [Q, 2, 2] float64, start and goal, (x, y) [m], world frame
    expected: list[float | None]  # Q, lengths that a .scen lists
    listed: bool  # whether they come from a .scen


@dataclass(frozen=True)
class Source:
    """The options that say which scenarios to drive."""

    suite: str | None
    suite_file: Path | None
    map: Path | None
    count: int | None  # None: all of a file, DEFAULT_COUNT of what is made
    seed: int
    unknown: str = "occupied"
    resolution: float = 1.0
    squares: int | None = None  # on a map; None: OBSTACLES
    movers: int | None = None
    sensed_only: bool = False
    index: int | None = None  # of the one scenario that is wanted; the count then follows


@dataclass(frozen=True)
class Work:
    """A suite, and whether its maps have their y axis downwards in pictures."""

    suite: Suite
    y_down: bool = False


def read_grid(map_file: MapFile, unknown: str, quiet: bool) -> Grid:
    """The map under the user's policy for its unknown cells, which is told where there are any."""
    if not quiet and map_file.unknown.any():
        note(f"{map_file.unknown_share:.1%} of {map_file.name} is unknown and counts as {unknown} (--unknown)")
    return map_file.grid(unknown)


def read_queries(map_file: MapFile, start: str | None, goal: str | None, scen: Path | None, limit: int | None,
                 quiet: bool) -> Queries:
    """The queries of `adwa plan`. InputError names the option, or the file and line."""
    if limit is not None and limit < 1:
        raise InputError(f"--limit: {limit}; must be ≥ 1; leave it out for all queries")
    if scen is not None:
        if start is not None or goal is not None:
            raise InputError(f"--scen: {scen}; cannot go with --start or --goal; leave out one or the other")
        return _listed_queries(map_file, scen, limit, quiet)
    for option, text in (("--start", start), ("--goal", goal)):
        if text is None:
            raise InputError(f"{option}: not given; a plan needs --start and --goal, or --scen; add it")
    return Queries(np.array([[_point("--start", start), _point("--goal", goal)]]), [None], listed=False)


def read_suite(source: Source, robot_radius: float, quiet: bool, progress: Progress | None = None) -> Work:
    """The one suite that the options name. InputError where they name none, or several, or it cannot be had.

    robot_radius [m]: tasks on a user's map start and end where such a robot fits.
    """
    given = [option for option in (source.suite, source.suite_file, source.map) if option is not None]
    if len(given) != 1:
        raise InputError(f"--suite, --suite-file, --map: {len(given)} given; exactly one says what to drive; give one")
    for option, value in _obstacles(source).items():
        if value is not None and source.map is None:
            raise InputError(f"{option}: {value}; without effect on {source.suite or source.suite_file}; only "
                             "scenarios on a map are made with it; leave it out, or give --map")  # fmt: skip
    count = "--count" if source.index is None else "--index"
    with options_named(suite="--suite", seed="--seed", count=count, resolution="--resolution"):
        work = _read(source, robot_radius, quiet, progress)
    suite = _cut(work.suite, source)
    return replace(work, suite=without_maps(suite) if source.sensed_only else suite)


@contextmanager
def options_named(**options: str) -> Iterator[None]:
    """Errors that begin with the name of a field begin with that of its option instead."""
    try:
        yield
    except InputError as error:
        field, colon, rest = str(error).partition(":")
        if field not in options:
            raise
        raise InputError(options[field] + colon + rest) from None


def _read(source: Source, robot_radius: float, quiet: bool, progress: Progress | None) -> Work:
    """At least as many scenarios as are wanted, where there are so many."""
    if source.map is not None:
        return _suite_on(source.map, source, robot_radius, quiet, progress)
    path = source.suite_file
    if path is None and source.suite not in SUITE_NAMES and Path(str(source.suite)).exists():
        path = Path(str(source.suite))
    if path is not None:
        return Work(suite_in(path, source.seed, _wanted(source), progress))
    return Work(make_suite(str(source.suite), source.seed, _count(source), progress))


def _obstacles(source: Source) -> dict[str, int | None]:
    return {"--unknown-obstacles": source.squares, "--movers": source.movers}


def _wanted(source: Source) -> int | None:
    return source.count if source.index is None else source.index + 1


def _count(source: Source) -> int:
    wanted = _wanted(source)
    return DEFAULT_COUNT if wanted is None else wanted


def _cut(suite: Suite, source: Source) -> Suite:
    """The first scenarios, as many as the options say; all where they say nothing."""
    there = len(suite.scenarios)
    if there == 0:
        raise InputError(f"{suite.name}: 0 scenarios; must hold at least one; make it again")
    if source.index is not None:
        if source.index >= there:
            raise InputError(f"--index: {source.index}; {suite.name} has {there} scenarios; choose a lower one")
        return suite
    if source.count is None:
        return suite
    if not 1 <= source.count <= there:
        raise InputError(f"--count: {source.count}; {suite.name} has {there} scenarios; choose from 1 to {there}")
    return replace(suite, scenarios=suite.scenarios[: source.count], names=suite.names[: source.count])


def _suite_on(path: Path, source: Source, robot_radius: float, quiet: bool, progress: Progress | None) -> Work:
    counts = {option: OBSTACLES if value is None else value for option, value in _obstacles(source).items()}
    for option, value in counts.items():
        if not 0 <= value <= MOST_OBSTACLES:
            raise InputError(f"{option}: {value}; must be from 0 to {MOST_OBSTACLES}; correct it")
    map_file = load_map(path, source.resolution)
    grid = read_grid(map_file, source.unknown, quiet)
    suite = suite_on_map(path.name, grid, source.seed, _count(source), counts["--unknown-obstacles"],
                         counts["--movers"], robot_radius, progress)
    if not quiet:
        _tell_of_fewer(suite, counts)
    return Work(suite, map_file.y_down)


def _tell_of_fewer(suite: Suite, counts: Mapping[str, int]) -> None:
    """Obstacles that found no place: where there are no movers, nothing can be learnt about movers."""
    kinds = [(scenario.squares.valid, scenario.movers.valid) for scenario in suite.scenarios]
    for (option, count), placed in zip(counts.items(), zip(*kinds, strict=True), strict=True):
        found = np.array([np.sum(valid) for valid in placed])
        if (found < count).any():
            note(f"{suite.name}: {option} {count} found no place in {np.mean(found < count):.0%} of scenarios; on "
                 f"average {found.mean():.1f} are there")  # fmt: skip


def _listed_queries(map_file: MapFile, scen: Path, limit: int | None, quiet: bool) -> Queries:
    entries = load_scen(scen)[:limit]
    height, width = map_file.occupied.shape
    for entry in entries:
        if (entry.height, entry.width) != (height, width):
            raise bad_input(f"{scen}:{entry.line}", f"width x height {entry.width} x {entry.height}",
                            f"{map_file.name} has {width} x {height}", "name the map this file was made for")
    names = {entry.map_name for entry in entries}
    if not quiet and names != {Path(map_file.name).name}:
        note(f"{scen} was made for {', '.join(sorted(names))}; taken as queries on {map_file.name}")
    points = np.array([[entry.start_point, entry.goal_point] for entry in entries], np.float64)
    return Queries(points, [entry.expected for entry in entries], listed=True)


def _point(option: str, text: str | None) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in (text or "").split(","))
    except ValueError:
        x = y = math.nan
    if not (abs(x) <= LARGEST and abs(y) <= LARGEST):
        raise bad_input(option, shown(text), "must be two numbers X,Y in metres",
                        f"write for instance {option} 1.5,2.5")
    return x, y
