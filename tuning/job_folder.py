"""The folder of a job: the job file as it was, its environment, a lock, a log, and what methods remember."""

import fcntl
import hashlib
import json
import os
import platform
import re
import subprocess
import time
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from importlib import metadata
from pathlib import Path
from typing import IO, Any

import numpy as np

from scenarios.errors import InputError
from tuning.engine import usable_cores
from tuning.outputs import write_whole

JOB, ENVIRONMENT, LOCK, LOG, REMEMBERED = "job.toml", "environment.json", "lock", "log.jsonl", "remembered"
TRAINING, HELD_OUT = "training.zarr", "held_out.zarr"
TRIES, MOMENT = 5, 0.1  # [s] between them: whoever only looks at a lock has it for an instant
PACKAGES = ("adwa-jax", "jax", "jaxlib", "numpy", "scipy", "pymoo", "optax", "zarr", "xarray")


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """The folder for this process alone. InputError names the process that has it."""
    with open(folder / LOCK, "a+", encoding="utf-8") as file:
        if not any(_taken(file) or time.sleep(MOMENT) for _ in range(TRIES)):
            process = holder(folder) or "another"
            raise InputError(f"{folder}: process {process} works on it; one process at a time may; wait for it, or "
                             f"end it: kill {process}")  # fmt: skip
        file.truncate(0)
        file.write(str(os.getpid()))
        file.flush()
        yield


def _taken(file: IO[str]) -> bool:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def holder(folder: Path) -> str | None:
    """The process that works on the folder; None if none does. To look takes the lock too, for an instant."""
    try:
        with open(folder / LOCK, encoding="utf-8") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return file.read().strip() or "another"
    except FileNotFoundError:
        pass
    return None


@contextmanager
def storing(folder: Path) -> Iterator[None]:
    """A full disk or a folder that cannot be written is one line: nothing that was done is lost."""
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        begun = (folder / JOB).exists()
        remedy = (f"make room or mend the permissions, then go on: adwa tune resume {folder}" if begun else
                  "make room, mend the permissions or name another folder, then run the job again")  # fmt: skip
        raise InputError(f"{folder}: {error.strerror or error}; a job keeps its results there; {remedy}") from error


def require_free(folder: Path) -> None:
    """Raises InputError if there is anything in the folder but what a start leaves that was cut short."""
    if (folder / JOB).exists():
        raise InputError(f"--out: {folder}; holds a job already; choose another folder, or go on with that one: "
                         f"adwa tune resume {folder}")  # fmt: skip
    kept = {LOCK, ENVIRONMENT, f".{ENVIRONMENT}.part", f".{JOB}.part"}
    if folder.is_dir() and any(entry.name not in kept for entry in folder.iterdir()):
        raise InputError(f"--out: {folder}; is not empty; a job has a folder to itself; name a new one")


def begin(folder: Path, job: Path, seed: int, inputs: Mapping[str, str]) -> None:
    """Write down what the job is; the job file comes last, and makes the folder a job's."""
    environment = {**environment_now(), "seed": seed, "job_file": str(job.resolve()), "inputs": dict(inputs)}
    write_whole(folder / ENVIRONMENT, json.dumps(environment, indent=1) + "\n")
    write_whole(folder / JOB, job.read_text(encoding="utf-8"))


def environment_of(folder: Path) -> dict[str, Any]:
    """That in which the job began. InputError where there is no job."""
    if not (folder / JOB).exists():
        lost = (folder / LOG).exists()  # of a job that had begun
        raise InputError(f"{folder}: {JOB} is missing; a job cannot go on without it; put the job's file back" if lost
                         else f"{folder}: no job; must be the folder of a job that has begun; name one, or begin: "
                         "adwa tune run JOB --out DIR")  # fmt: skip
    try:
        environment = json.loads((folder / ENVIRONMENT).read_text(encoding="utf-8"))
        if not isinstance(environment, dict) or not {"versions", "job_file", "inputs"} <= set(environment):
            raise ValueError(f"{ENVIRONMENT} is damaged")
        return environment
    except (OSError, ValueError) as error:
        raise InputError(f"{folder / ENVIRONMENT}: damaged or missing ({' '.join(str(error).split())}); it says what "
                         f"the job began with; restore it, or run the job anew: adwa tune run {folder / JOB} --out DIR"
                         ) from None  # fmt: skip


def home_of(environment: Mapping[str, Any]) -> Path:
    """The folder that the job file's paths are relative to."""
    return Path(environment["job_file"]).parent


def require_unchanged(folder: Path, before: Mapping[str, str], now: Mapping[str, str]) -> None:
    """Raises InputError where the job file's suites or weights are no longer what they were."""
    changed = [place for place in before if now.get(place) != before[place]]
    if changed:
        raise InputError(f"{folder}: {', '.join(changed)}; not what the job began with; a job is driven on the same "
                         "scenarios throughout; restore the file, or run the job anew")  # fmt: skip


def environment_now() -> dict[str, Any]:
    """Versions, machine and revision of this process."""
    return {"versions": {"python": platform.python_version(), **{name: _version(name) for name in PACKAGES}},
            "revision": _revision(), "platform": platform.platform(), "processors": usable_cores()}  # fmt: skip


def differing_versions(environment: Mapping[str, Any]) -> list[str]:
    """What has another version than when the job began."""
    now, before = environment_now()["versions"], environment["versions"]
    return [f"{name} {before.get(name)} → {now[name]}" for name in now if before.get(name) != now[name]]


class Log:
    """A line of JSON for each thing that happens."""

    def __init__(self, folder: Path):
        self._path = folder / LOG

    def write(self, event: str, **facts: Any) -> None:
        """Append an event."""
        line = json.dumps({"time": time.strftime("%Y-%m-%dT%H:%M:%S"), "event": event, **facts})
        with open(self._path, "a", encoding="utf-8") as file:
            file.write(line + "\n")


def events_of(folder: Path) -> list[dict[str, Any]]:
    """The log so far; a line that was cut off is left out."""
    events = []
    with suppress(FileNotFoundError):
        for line in (folder / LOG).read_text(encoding="utf-8", errors="replace").splitlines():
            with suppress(ValueError):
                events.append(json.loads(line))
    return [event for event in events if isinstance(event, dict) and "event" in event]


def remember(folder: Path, key: str, compute: Callable[[], dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Arrays kept under a key; computed and kept, whole or not at all, if there are none or they are damaged."""
    place = folder / REMEMBERED / f"{_file_name(key)}.npz"
    found = _loaded(place)
    if found is None:
        place.parent.mkdir(exist_ok=True)
        unfinished = place.with_name(f".{place.name}.part")
        with open(unfinished, "wb") as file:
            np.savez(file, **compute())  # pyright: ignore[reportArgumentType]
        os.replace(unfinished, place)
        found = _loaded(place) or {}
    return found


def remembered(folder: Path) -> dict[str, dict[str, np.ndarray]]:
    """All that is kept, by key."""
    files = sorted((folder / REMEMBERED).glob("*.npz"))
    return {file.stem: arrays for file in files if (arrays := _loaded(file)) is not None}


def _loaded(path: Path) -> dict[str, np.ndarray] | None:
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except FileNotFoundError:
        return None
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile):
        return None


def _file_name(key: str) -> str:
    """The key itself where a file may be called so."""
    return key if re.fullmatch(r"[\w-][\w.-]*", key) else hashlib.sha256(key.encode()).hexdigest()


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _revision() -> str | None:
    """Of the working copy that this file is in, marked if it was changed."""
    command = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        found = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return found.stdout.strip() or None
