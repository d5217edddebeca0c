"""Suites from a user's files and folders, told apart by what is in them."""

import zipfile
from collections.abc import Callable
from math import ceil
from pathlib import Path

from scenarios.errors import InputError
from scenarios.formats.reading import bad_input
from scenarios.suite import (
    Suite,
    load_suite,
    suite_from_barn_folder,
    suite_from_barn_grids,
    suite_from_dynabarn,
    suite_from_tracks,
)
from tuning.starts import with_more_starts

KINDS = ("a saved suite, a folder of BARN .world files, BARN's grids.npz, DynaBARN's keyframes.csv, or pedestrian "
         "tracks: a .txt or a folder of them")  # fmt: skip
DEFAULT_COUNT = 100  # of what is made
LARGEST_SEED = 2**32 - 1
Progress = Callable[[int, int], None]


def suite_in(path: Path, seed: int = 0, count: int | None = None, progress: Progress | None = None) -> Suite:
    """The suite that a file or folder holds; InputError for anything else.

    count: of a saved suite all is returned, whatever the count. BARN's worlds are as many as there are, or, if more
    are asked for, driven from more starts; DynaBARN's likewise from more times on. Of tracks there are as many
    crossings as asked for. Those are determined by the seed, and a longer suite begins with the shorter one.
    """
    _check(seed, count)
    kind = _kind(path)
    if kind == "tracks":
        return suite_from_tracks(path, seed, DEFAULT_COUNT if count is None else count, progress=progress)
    if kind == "dynabarn":
        return _dynabarn(path, seed, count, progress)
    if kind == "saved":
        return load_suite(path)
    worlds = suite_from_barn_grids(path) if kind == "barn grids" else suite_from_barn_folder(path)
    return worlds if count is None else with_more_starts(worlds, seed, max(count, len(worlds.scenarios)))


def _kind(path: Path) -> str:
    if path.is_dir():
        return _kind_of_folder(path)
    if not path.exists():
        raise bad_input(path, "no such file or folder", f"it must be {KINDS}", "check the name")
    by_suffix = {".csv": "dynabarn", ".txt": "tracks"}.get(path.suffix.lower())
    return by_suffix or ("barn grids" if _holds_grids(path) else "saved")


def _kind_of_folder(path: Path) -> str:
    names = [entry.name for entry in path.iterdir()]
    if any(name.endswith((".world", ".world.gz")) for name in names):
        return "barn folder"
    if any(name.endswith(".txt") for name in names):
        return "tracks"
    raise bad_input(path, "no .world, .world.gz or .txt file", f"it must be {KINDS}",
                    "name the folder that holds the worlds or tracks")


def _holds_grids(path: Path) -> bool:
    """Whether a file is an archive of BARN's arrays rather than of a suite's."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = set(archive.namelist())
    except (OSError, zipfile.BadZipFile):
        return False
    return {"world.npy", "full.npy"} <= names and "header.npy" not in names


def _dynabarn(path: Path, seed: int, count: int | None, progress: Progress | None) -> Suite:
    """Whole rounds, enough for the count."""
    once = suite_from_dynabarn(path, seed, starts=1)
    rounds = 1 if count is None else ceil(count / len(once.scenarios))
    return once if rounds <= 1 else suite_from_dynabarn(path, seed, rounds, progress)


def _check(seed: int, count: int | None) -> None:
    if not 0 <= seed <= LARGEST_SEED:
        raise InputError(f"seed: {seed}; must be a whole number from 0 to {LARGEST_SEED}; try 1")
    if count is not None and count < 1:
        raise InputError(f"count: {count}; must be ≥ 1; try 1")
