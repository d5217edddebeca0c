"""Suites: many scenarios under one name, made from a recipe, kept in one file.

A suite file is an npz archive: `header` holds JSON in UTF-8 (format, version, name, names, recipe), the other arrays
are those of `scenarios.packing`.
"""

import json
import os
import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any

import jax
import numpy as np

from adwa_jax.grid import Grid
from adwa_jax.scenario import Scenario
from scenarios.errors import InputError
from scenarios.generators import barn, blocks, crowd, dynabarn, maze, on_map, paper, rooms
from scenarios.hiding import hide_all
from scenarios.packing import packed, unpacked

FORMAT = "adwa-jax suite"
VERSION = 2
"""Version of the file format; a file of another one is refused."""

_KINDS: dict[str, tuple[Callable[..., Scenario], Any]] = {
    "paper-15": (paper.generate, paper.PaperSpec(cells=15)),
    "paper-20": (paper.generate, paper.PaperSpec(cells=20)),
    "paper-25": (paper.generate, paper.PaperSpec(cells=25)),
    "blocks": (blocks.generate, blocks.BlocksSpec()),
    "rooms": (rooms.generate, rooms.RoomsSpec()),
    "maze": (maze.generate, maze.MazeSpec()),
    "barn": (barn.generate, barn.BarnSpec()),
    "crowd": (crowd.generate, crowd.CrowdSpec()),
}
SUITE_NAMES = tuple(_KINDS)
"""What `make_suite` can make."""

Progress = Callable[[int, int], None]
"""Called with (scenarios made, scenarios in all) after each."""


@dataclass(frozen=True)
class Suite:
    """Unbatched, unpadded scenarios with numpy leaves; their sizes may differ."""

    name: str
    scenarios: tuple[Scenario, ...]
    names: tuple[str, ...]  # one a scenario, all different
    recipe: dict[str, Any]  # what made it, in JSON's types: suite, generator, spec, seed, count, package; or its source

    def __post_init__(self):
        if len(self.names) != len(self.scenarios):
            raise ValueError(f"names: {len(self.names)}; must be one for each of the {len(self.scenarios)} scenarios")


def make_suite(name: str, seed: int, count: int, progress: Progress | None = None) -> Suite:
    """The suite of `SUITE_NAMES`; name, seed and count determine every bit.

    Scenario i comes from the key fold_in(key(seed), i), so that a longer suite begins with the shorter one. Raises
    InputError for an unknown name, a seed outside [0, 2³²) and a count below 1.
    """
    if name not in _KINDS:
        raise InputError(f"suite: {name!r}; must be one of {', '.join(SUITE_NAMES)}; choose one of them")
    generate, spec = _KINDS[name]
    recipe = {"generator": generate.__module__.rpartition(".")[2], "spec": asdict(spec)}
    return _series(name, seed, count, lambda key, _: generate(key, spec), recipe, progress)


def suite_on_map(name: str, grid: Grid, seed: int, count: int, squares: int = 0, movers: int = 0,
                 robot_radius: float = 0.25, progress: Progress | None = None) -> Suite:
    """Random tasks on a user's own map (`scenarios.generators.on_map`), which all scenarios share.

    grid: unpadded. Start and goal are connected for a disc of robot_radius [m] and at least a third of the map's
    diagonal apart where the map allows it; up to `squares` unknown squares and `movers` patrols. Raises InputError as
    `make_suite` does, and where the map has no two connected cells.
    """
    ground = on_map.prepare(grid, robot_radius, name)
    spec = on_map.spec_for(ground, squares, movers, robot_radius)
    recipe = {"generator": "on_map", "spec": asdict(spec)}
    return _series(name, seed, count, lambda key, _: on_map.generate(key, spec, ground), recipe, progress)


def suite_from_barn_folder(folder: str | Path) -> Suite:
    """The worlds of a folder of BARN `.world` files with their path files, as `scenarios.formats` loads them."""
    from scenarios.formats.barn_world import load_barn_folder  # only here: image and YAML readers come with it

    names, scenarios = zip(*load_barn_folder(folder), strict=True)
    recipe = {"suite": Path(folder).name, "folder": str(folder), "count": len(names), "package": _package()}
    return Suite(Path(folder).name, scenarios, names, recipe)


def suite_from_barn_grids(path: str | Path, sensed_only: bool = False) -> Suite:
    """The worlds of an archive of BARN grids with its path files (`scenarios.formats.load_barn_grids`).

    sensed_only: the robot knows nothing of the worlds beforehand, as in the benchmark (`without_maps`).
    """
    from scenarios.formats.barn_grids import load_barn_grids

    names, scenarios = zip(*load_barn_grids(path), strict=True)
    recipe = {"suite": "barn-grids", "file": str(path), "count": len(names), "package": _package()}
    suite = Suite("barn-grids", scenarios, names, recipe)
    return without_maps(suite) if sensed_only else suite


def suite_from_dynabarn(path: str | Path, seed: int, starts: int = 34, progress: Progress | None = None) -> Suite:
    """The worlds of a file of DynaBARN key frames, each from `starts` times on; its 30 worlds and 34 times make 1020.

    First comes each world from its beginning (start00), then each from a random time (start01), and so on: seed and
    starts determine every bit, and more starts begin with the fewer. Names tell world and tier: world_22-tier2-start01.
    No mover is near the start at t = 0, unless it is there when the world begins. Raises InputError as `make_suite`.
    """
    from scenarios.formats.dynabarn import load_dynabarn

    worlds, spec = load_dynabarn(path), dynabarn.DynabarnSpec()
    _check_whole("starts", starts, 1, 10**6)

    def draw(key: jax.Array, index: int) -> Scenario:
        start, tracks = index // len(worlds), worlds[index % len(worlds)][1]
        return dynabarn.generate(key, spec, tracks) if start else dynabarn.beginning_at(0.0, spec, tracks)

    recipe = {"generator": "dynabarn", "spec": asdict(spec), "file": str(path), "starts": int(starts)}
    suite = _series("dynabarn", seed, len(worlds) * starts, draw, recipe, progress)
    names = tuple(f"{name}-start{start:02d}" for start in range(starts) for name, _ in worlds)
    return replace(suite, names=names)


def suite_from_tracks(source: str | Path | Sequence[str | Path], seed: int, count: int,
                      spec: crowd.CrowdSpec | None = None, progress: Progress | None = None) -> Suite:
    """Crossings among recorded people (`crowd.from_tracks`), the recordings taken in turn.

    source: files of rows `frame id x y`, or a folder whose `.txt` files they are, in order of name. Scenario i is a
    stretch of recording i modulo their number: its name says which. People are there while they were seen, which
    begins and ends mostly at the edge of the place, where the robot too has its start and goal: only at t = 0 none is
    within `spec.mover_distance` of it. Raises InputError as `make_suite` and `scenarios.formats.load_tracks`.
    """
    from scenarios.formats.tracks import load_tracks

    spec = spec or crowd.CrowdSpec()
    paths = _recordings(source)
    recordings = [load_tracks(path) for path in paths]

    def draw(key: jax.Array, index: int) -> Scenario:
        return crowd.from_tracks(key, spec, recordings[index % len(paths)])

    recipe = {"generator": "crowd.from_tracks", "spec": asdict(spec), "files": [str(path) for path in paths]}
    suite = _series("tracks", seed, count, draw, recipe, progress)
    return replace(suite, names=tuple(f"{paths[index % len(paths)].stem}-{int(seed)}-{index:05d}"
                                      for index in range(int(count))))


def without_maps(suite: Suite) -> Suite:
    """The suite with nothing known beforehand: every occupied cell is hidden (`scenarios.hiding`); names stay."""
    name = f"{suite.name}-sensed"
    return Suite(name, hide_all(suite.scenarios), suite.names, {"suite": name, "sensed_only": True, "of": suite.recipe})


def save_suite(suite: Suite, path: str | Path) -> None:
    """Writes the suite to one file, or leaves the file that was there as it was.

    Raises InputError where the file cannot be written, and where the path is that of anything but a file: a device, a
    pipe or a link would be replaced by the suite.
    """
    path = Path(path)
    if path.is_symlink() or (path.exists() and not path.is_file()):
        raise _refusal(path, "is no regular file", "a suite replaces a file or makes one", "give another name")
    header = {"format": FORMAT, "version": VERSION, "name": suite.name, "names": suite.names, "recipe": suite.recipe}
    arrays = {"header": np.frombuffer(json.dumps(header).encode(), np.uint8), **packed(suite.scenarios)}
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with open(unfinished, "wb") as file:
            np.savez_compressed(file, **arrays)  # pyright: ignore[reportArgumentType]
        os.replace(unfinished, path)
    except OSError as error:
        raise _refusal(path, f"cannot be written ({error.strerror})", "needs a folder with room", "check it") from None
    finally:
        unfinished.unlink(missing_ok=True)


def load_suite(path: str | Path) -> Suite:
    """The suite in a file that `save_suite` wrote, equal to the saved one bit for bit. Nothing is unpickled.

    Raises InputError for a file that is missing, empty, no suite, damaged, or of another format version.
    """
    path = Path(path)
    _check_file(path)
    try:
        with open(path, "rb") as file, np.load(file, allow_pickle=False) as archive:
            header = _checked_header(path, archive)
            arrays = {name: archive[name] for name in archive.files}
        names = tuple(map(str, header["names"]))
        scenarios = tuple(unpacked(arrays, len(names)))
        return Suite(str(header["name"]), scenarios, names, dict(header["recipe"]))
    except InputError:
        raise
    except (OSError, EOFError, ValueError, KeyError, TypeError, MemoryError, RuntimeError, zlib.error,
            zipfile.BadZipFile) as error:
        raise _refusal(path, f"damaged or no suite ({_line(error)})", "must be a whole file that save_suite wrote",
                       "copy it again or make it again") from None


def _series(name: str, seed: int, count: int, draw: Callable[[jax.Array, int], Scenario], recipe: dict[str, Any],
            progress: Progress | None) -> Suite:
    """`count` scenarios, the i-th drawn with (fold_in(key(seed), i), i)."""
    _check_whole("seed", seed, 0, 2**32 - 1)
    _check_whole("count", count, 1, 10**9)
    key = jax.random.key(int(seed), impl="threefry2x32")
    scenarios = []
    for index in range(int(count)):
        scenarios.append(draw(jax.random.fold_in(key, index), index))
        if progress is not None:
            progress(index + 1, int(count))
    names = tuple(f"{name}-{int(seed)}-{index:05d}" for index in range(int(count)))
    recipe = {"suite": name, **recipe, "seed": int(seed), "count": int(count), "package": _package()}
    return Suite(name, tuple(scenarios), names, json.loads(json.dumps(recipe)))


def _check_whole(field: str, value: object, low: int, high: int) -> None:
    """Raises InputError unless the value is a whole number in [low, high]."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not low <= value <= high:
        raise InputError(f"{field}: {value!r}; must be a whole number from {low} to {high}; try {max(low, 1)}")


def _recordings(source: str | Path | Sequence[str | Path]) -> list[Path]:
    """The files that are meant; raises InputError where there are none."""
    if not isinstance(source, str | Path):
        paths = [Path(path) for path in source]
    else:
        paths = sorted(Path(source).glob("*.txt")) if Path(source).is_dir() else [Path(source)]
    if not paths:
        raise InputError(f"{source}: no .txt file; recordings are files of rows 'frame id x y'; name them")
    return paths


def _check_file(path: Path) -> None:
    """Raises InputError unless the path is that of a zip archive."""
    remedy = "give a file that save_suite wrote"
    if not path.is_file():
        raise _refusal(path, "no such file", "must be a suite file", remedy)
    if path.stat().st_size == 0:
        raise _refusal(path, "0 bytes", "must be a suite file", "make it again")
    if not zipfile.is_zipfile(path):
        raise _refusal(path, "no zip archive, or cut off", "must be a whole suite file", remedy)


def _checked_header(path: Path, archive: Any) -> dict[str, Any]:
    """The header; raises InputError for another format or version."""
    header = json.loads(archive["header"].tobytes().decode()) if "header" in archive.files else None
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise _refusal(path, "an archive without a suite's header", "must be a suite file",
                       "give a file that save_suite wrote")
    if header.get("version") != VERSION:
        recipe = header.get("recipe")
        raise _refusal(path, f"suite format version {header.get('version')!r}",
                       f"this program reads version {VERSION}", f"make it again: {_remake(recipe)}")
    return header


def _remake(recipe: Any) -> str:
    """How to make a suite anew, from whatever recipe a file holds."""
    if isinstance(recipe, dict) and recipe.get("suite") in SUITE_NAMES:
        return f"make_suite({recipe['suite']!r}, seed={recipe.get('seed')!r}, count={recipe.get('count')!r})"
    return f"its recipe is {json.dumps(recipe)}"


def _refusal(path: Path, found: str, rule: str, remedy: str) -> InputError:
    return InputError(f"{path}: {found}; {rule}; {remedy}")


def _line(error: BaseException) -> str:
    """An error in one line."""
    return " ".join(str(error).split()) or type(error).__name__


def _package() -> str:
    """Version of the package that makes the suite."""
    try:
        return metadata.version("adwa-jax")
    except metadata.PackageNotFoundError:
        return "not installed"
