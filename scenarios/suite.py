"""Suites: many scenarios under one name, made from a recipe, kept in one file.

A suite file is an npz archive: `header` holds JSON in UTF-8 (format, version, name, names, recipe), the other arrays
are those of `scenarios.packing`.
"""

import json
import os
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import jax
import numpy as np

from adwa_jax.grid import Grid
from adwa_jax.scenario import Scenario
from scenarios.errors import InputError
from scenarios.generators import barn, blocks, crowd, maze, on_map, paper, rooms
from scenarios.packing import packed, unpacked

FORMAT = "adwa-jax suite"
VERSION = 1
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
    return _series(name, seed, count, lambda key: generate(key, spec), recipe, progress)


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
    return _series(name, seed, count, lambda key: on_map.generate(key, spec, ground), recipe, progress)


def suite_from_barn_folder(folder: str | Path) -> Suite:
    """The worlds of a folder of BARN `.world` files with their path files, as `scenarios.formats` loads them."""
    from scenarios.formats.barn_world import load_barn_folder  # only here: image and YAML readers come with it

    names, scenarios = zip(*load_barn_folder(folder), strict=True)
    recipe = {"suite": Path(folder).name, "folder": str(folder), "count": len(names), "package": _package()}
    return Suite(Path(folder).name, scenarios, names, recipe)


def save_suite(suite: Suite, path: str | Path) -> None:
    """Writes the suite to one file, or leaves the file that was there as it was.

    Raises InputError where the file cannot be written.
    """
    path = Path(path)
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


def _series(name: str, seed: int, count: int, draw: Callable[[jax.Array], Scenario], recipe: dict[str, Any],
            progress: Progress | None) -> Suite:
    """`count` scenarios, the i-th drawn with fold_in(key(seed), i)."""
    for field, value, low, high in (("seed", seed, 0, 2**32 - 1), ("count", count, 1, 10**9)):
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or not low <= value <= high:
            raise InputError(f"{field}: {value!r}; must be a whole number from {low} to {high}; try {max(low, 1)}")
    key = jax.random.key(int(seed), impl="threefry2x32")
    scenarios = []
    for index in range(int(count)):
        scenarios.append(draw(jax.random.fold_in(key, index)))
        if progress is not None:
            progress(index + 1, int(count))
    names = tuple(f"{name}-{int(seed)}-{index:05d}" for index in range(int(count)))
    recipe = {"suite": name, **recipe, "seed": int(seed), "count": int(count), "package": _package()}
    return Suite(name, tuple(scenarios), names, json.loads(json.dumps(recipe)))


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
