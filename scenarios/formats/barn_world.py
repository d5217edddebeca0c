"""Worlds of the BARN benchmark (Benchmark Autonomous Robot Navigation): Gazebo files of unit cylinders.

Dimension letters: H = 64 rows along y, W = 30 columns along x, n cylinders, P path cells. The cell (row k,
column r) has its centre at x = -4.425 + 0.15 r, y = 0.075 + 0.15 k. Rows 0 to 33 are the entry corridor, rows
34 to 63 the obstacles.
"""

import gzip
import math
import re
import zlib
from io import BytesIO
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from adwa_jax.grid import Grid
from adwa_jax.scenario import Scenario
from scenarios.errors import InputError
from scenarios.formats.leaves import leaf, no_movers, no_squares, none_hidden, numpy_grid
from scenarios.formats.map_file import MapFile
from scenarios.formats.reading import bad_input, read_bytes, shown

ROWS, COLUMNS = 64, 30
RESOLUTION = 0.15  # [m]
ORIGIN = (-4.5, 0.0)  # [m]
CYLINDER_RADIUS = 0.075  # [m]
START = (-2.25, 3.0, math.pi / 2)  # x, y [m], heading [rad]
GOAL = (-2.25, 13.0)  # [m]
GOAL_TOLERANCE = 1.0  # [m]
TIME_LIMIT = 100.0  # [s]
TASK_ROWS = 96  # of a scenario's map: 14.4 m, so that the goal and the disc around it lie on the map

# The benchmark's own conversion of path cells to metres, by which it measures its reference lengths. It lies
# a column to the left of the cylinders' lattice.
_PATH_ORIGIN = (-4.575, 5.075)  # [m]

_LATTICE_SLACK = 0.01  # [m]
_OWN_MODEL = re.compile(r"ground_plane|sun")
_KIND = "a BARN world"


def load_barn_world(path: str | Path) -> MapFile:
    """Read a `.world` or `.world.gz` as its map of 64 × 30 cells of 0.15 m.

    Enclosed cells are filled (`fill_enclosed`). Raises InputError for a file that is no Gazebo world, for
    models other than the ground and BARN's cylinders (their collisions would be missed in silence), and for
    cylinders off the lattice.
    """
    occupied = fill_enclosed(lattice(_cylinders(path), str(path)))
    return MapFile(name=str(path), occupied=occupied, unknown=np.zeros_like(occupied), resolution=RESOLUTION,
                   origin=ORIGIN)


def load_barn_scenario(world_path: str | Path, path_file: str | Path | None = None) -> Scenario:
    """The benchmark's task in one of its worlds (`barn_task`).

    path_file: the world's `path_<i>.npy`, which gives `reference_length` (`reference_length`); None leaves
    that at 0, for the A*-optimal length.
    """
    world = load_barn_world(world_path)
    return barn_task(world.occupied, 0.0 if path_file is None else reference_length(path_file))


def barn_task(occupied: np.ndarray, length: float) -> Scenario:
    """The benchmark's task in a world [64, 30] bool: numpy leaves, nothing hidden, no unknown squares, no movers.

    From (-2.25, 3.0), heading +y, to within 1 m of (-2.25, 13.0) in 100 s, on `task_grid`. length: that of the
    reference path [m], or 0.
    """
    return Scenario(
        grid=task_grid(occupied), hidden=none_hidden(),
        start=leaf(START, np.float32), heading_given=leaf(True, np.bool_), goal=leaf(GOAL, np.float32),
        goal_tolerance=leaf(GOAL_TOLERANCE, np.float32), time_limit=leaf(TIME_LIMIT, np.float32),
        reference_length=leaf(length, np.float32), squares=no_squares(), movers=no_movers())


def task_grid(occupied: np.ndarray) -> Grid:
    """The map of the task, from a world's [64, 30] bool: with the ground on which the goal lies.

    That is beyond the last cylinder (y = 9.6 m), where Gazebo's ground is open: the map goes on for 32 rows with the
    columns of the two side walls occupied and all between them free, to y = 14.4 m.
    """
    beyond = np.zeros((TASK_ROWS - ROWS, COLUMNS), np.bool_)
    beyond[:, [0, -1]] = True
    return numpy_grid(np.concatenate([occupied, beyond]), RESOLUTION, ORIGIN)


def load_barn_folder(folder: str | Path) -> list[tuple[str, Scenario]]:
    """Every `*.world` and `*.world.gz` of a folder as (name, Scenario), world_2 before world_10.

    The path file of `world_7.world` is `path_7.npy`, beside it, in a folder `path_files` inside, or in one
    next to the folder. Raises InputError where there is no world, no path file for one, or two files of one
    world.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise bad_input(folder, "no such folder", "a folder of BARN worlds is expected", "check the name")
    worlds = [path for path in folder.iterdir() if path.name.endswith((".world", ".world.gz"))]
    if not worlds:
        raise bad_input(folder, "no .world or .world.gz file", "a BARN suite holds at least one",
                        "name the folder that holds the worlds")
    worlds.sort(key=_natural)
    names = [_world_name(path) for path in worlds]
    for name, path in zip(names, worlds, strict=True):
        if names.count(name) > 1:
            raise bad_input(path, f"world {name} is there twice", "one file for each world", "remove one")
    path_files = [path_file_of(path, _number(path), path.parent) for path in worlds]
    scenarios = map(load_barn_scenario, worlds, path_files)
    return list(zip(names, scenarios, strict=True))


def lattice(centres: np.ndarray, where: str) -> np.ndarray:
    """[64, 30] bool: the cells that hold a cylinder.

    centres: [n, 2], x, y [m]; where: their file, for errors. Raises InputError for a centre farther than 1 cm
    from a cell's, or outside the lattice.
    """
    offset = np.asarray(centres, np.float64).reshape(-1, 2) - np.asarray(ORIGIN)
    cells = np.rint(offset / RESOLUTION - 0.5)
    on_lattice = (np.abs(offset - (cells + 0.5) * RESOLUTION) <= _LATTICE_SLACK).all(axis=1)
    inside = ((cells >= 0) & (cells < (COLUMNS, ROWS))).all(axis=1)
    if not (on_lattice & inside).all():
        x, y = np.asarray(centres).reshape(-1, 2)[np.flatnonzero(~(on_lattice & inside))[0]]
        raise bad_input(where, f"cylinder at ({x:g}, {y:g})",
                        "BARN's cylinders stand at the centres of 64 x 30 cells of 0.15 m from (-4.5, 0)",
                        "move it onto a centre, or give the world as an image map")
    occupied = np.zeros((ROWS, COLUMNS), np.bool_)
    column, row = cells.astype(np.int64).T
    occupied[row, column] = True
    return occupied


def fill_enclosed(cylinders: np.ndarray) -> np.ndarray:
    """[64, 30] bool: the cylinders and the cells they enclose, where the benchmark leaves cylinders out.

    Enclosed is what cannot be reached by steps across the sides of free cells from the open ground past the
    last row, nor from the start's cell.
    """
    free = np.pad(~cylinders, ((0, 1), (0, 0)), constant_values=True)
    start_row, start_column = (int((START[axis] - ORIGIN[axis]) / RESOLUTION) for axis in (1, 0))
    reached = np.zeros_like(free)
    reached[-1] = True
    reached[start_row, start_column] = free[start_row, start_column]
    while True:
        grown = reached.copy()
        grown[1:] |= reached[:-1]
        grown[:-1] |= reached[1:]
        grown[:, 1:] |= reached[:, :-1]
        grown[:, :-1] |= reached[:, 1:]
        grown &= free
        if (grown == reached).all():
            return ~reached[:-1]
        reached = grown


def reference_length(path_file: str | Path) -> float:
    """Length [m] of the reference path from start to goal, as the benchmark's run script measures it.

    The polyline from the start (-2.25, 3.0) through the file's points to the goal (-2.25, 13.0), the lattice
    cell (r, c) taken at x = -4.575 + 0.15 r, y = 5.075 + 0.15 c. Raises InputError for anything but a [P, 2]
    array of finite numbers.
    """
    content = read_bytes(path_file, "a BARN path file")
    try:
        cells = np.asarray(np.load(BytesIO(content), allow_pickle=False), np.float64)
    except Exception as error:  # numpy's reader of headers raises anything from ValueError to TokenError
        raise bad_input(path_file, f"cannot be read ({error})", "a BARN path file is an .npy array [P, 2]",
                        "fetch the file again") from None
    if cells.ndim != 2 or cells.shape[1] != 2 or len(cells) == 0 or not np.isfinite(cells).all():
        raise bad_input(path_file, f"array of shape {cells.shape}",
                        "a BARN path file is an array [P, 2] of finite numbers, P at least 1",
                        "fetch the file again")
    points = np.concatenate([[START[:2]], cells * RESOLUTION + np.asarray(_PATH_ORIGIN), [GOAL]])
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


def path_file_of(where: object, number: int, folder: Path) -> Path:
    """The `path_<number>.npy` in `folder`, or in a folder `path_files` inside or next to it.

    where: the world, for the error. Raises InputError where there is none.
    """
    name = f"path_{number}.npy"
    for place in (folder, folder / "path_files", folder.resolve().parent / "path_files"):
        if (place / name).is_file():
            return place / name
    raise bad_input(where, f"no path file {name}",
                    "it lies beside the world, or in a folder path_files inside or next to that folder",
                    f"put {name} there")


def _cylinders(path: str | Path) -> np.ndarray:
    """[n, 2] float64 centres x, y [m] of a world's cylinders."""
    world = _parse(path).find("world")
    if world is None:
        raise bad_input(path, "no <world> element", f"{_KIND} is a Gazebo world (SDF)",
                        "check that this is such a file")
    for include in world.findall("include"):
        uri = (include.findtext("uri") or "").strip()
        if not _OWN_MODEL.fullmatch(uri.rpartition("/")[2]):
            raise _foreign(path, f"include {shown(uri)}")
    models = [model for model in world.findall("model") if not _OWN_MODEL.fullmatch(model.get("name", ""))]
    if not models:
        raise bad_input(path, "no model", f"{_KIND} holds cylinders of radius {CYLINDER_RADIUS} m",
                        "check that this is such a world")
    return np.array([_centre(path, model) for model in models])


def _centre(path: str | Path, model: ElementTree.Element) -> tuple[float, float]:
    """x, y [m] of a model, which must be one of BARN's cylinders."""
    name = f"model {shown(model.get('name'))}"
    shapes = [shape for geometry in model.findall("link/collision/geometry") for shape in geometry]
    if len(shapes) != 1 or shapes[0].tag != "cylinder":
        tags = " and ".join(shape.tag for shape in shapes)
        raise _foreign(path, f"{name} of {tags or 'no collision shape'}")
    radius, = _numbers(path, name, shapes[0].findtext("radius"), 1)
    if abs(radius - CYLINDER_RADIUS) > 1e-6:
        raise _foreign(path, f"{name} of radius {radius:g} m")
    x, y = _numbers(path, name, model.findtext("pose"), 6)[:2]
    return x, y


def _numbers(path: str | Path, name: str, text: str | None, count: int) -> list[float]:
    try:
        values = [float(word) for word in (text or "").split()]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise bad_input(path, f"{name} with pose or radius {shown(text)}",
                        "a pose is six finite numbers, a radius is one", "mend the element")
    return values


def _parse(path: str | Path) -> ElementTree.Element:
    content = read_bytes(path, _KIND)
    try:
        if str(path).lower().endswith(".gz"):
            content = gzip.decompress(content)
        return ElementTree.fromstring(content)
    except (OSError, EOFError, zlib.error) as error:
        raise bad_input(path, f"cannot be unpacked ({error})", "a .gz file is packed by gzip",
                        "fetch it again, or drop .gz from the name of an unpacked one") from None
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        line, _ = getattr(error, "position", (1, 0))
        raise bad_input(f"{path}:{line}", f"is not XML ({error})",
                        f"{_KIND} is a Gazebo world (SDF)", "check that this is such a file, complete") from None


def _foreign(path: str | Path, found: str) -> InputError:
    return bad_input(path, found, f"{_KIND} holds the ground and cylinders of radius {CYLINDER_RADIUS} m",
                     "remove it, or give the world as an image map")


def _world_name(path: Path) -> str:
    return path.name.removesuffix(".gz").removesuffix(".world")


def _natural(path: Path) -> list[tuple[int, str]]:
    """Sort key in which world_2 comes before world_10."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"([0-9]+)", path.name)]


def _number(world: Path) -> int:
    numbers = re.findall(r"[0-9]+", _world_name(world))
    if not numbers:
        raise bad_input(world, "no number in the name",
                        "path files are found by number: path_7.npy for world_7.world", "rename the world")
    return int(numbers[-1])
