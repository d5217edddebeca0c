"""The independent C++ program and the Python peers of the neighbouring folder, where they are."""

import importlib.util
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import numpy as np

from tests.benchmarks.inputs import Arrays
from tuning.engine import usable_cores

PEERS = Path(__file__).resolve().parents[3] / "shared" / "peers"
CODES = {"uint8": b"u1", "int32": b"i4", "float32": b"f4", "float64": b"f8"}


class Yardstick:
    """The program, built for this processor."""

    def __init__(self) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="yardstick-"))
        self._program = self._folder / "adwa_ref"
        subprocess.run(["g++", "-O3", "-march=native", "-std=c++17", "-o", self._program, PEERS / "adwa_ref.cpp"],
                       check=True, capture_output=True)  # fmt: skip

    def rate(self, command: str, arrays: Arrays, *options: str) -> float:
        """Items a second of as many processes as there are cores, each with its share of the items."""
        count, cores = len(arrays["maps"]), min(usable_cores(), len(arrays["maps"]))
        edges = np.linspace(0, count, cores + 1).astype(int)
        source = self._written(arrays)
        running = [self._started(command, source, *options, "--first", str(first), "--n", str(last - first))
                   for first, last in pairwise(edges)]  # fmt: skip
        return sum(json.loads(process.communicate()[0])["per_s_median"] for process in running)

    def items(self, command: str, arrays: Arrays, *options: str) -> list[dict]:
        """One record an item."""
        records = self._folder / "items.json"
        process = self._started(command, self._written(arrays), *options, "--items", str(records))
        process.communicate()
        return [json.loads(line) for line in records.read_text().splitlines()]

    def _started(self, command: str, source: Path, *options: str) -> subprocess.Popen:
        return subprocess.Popen([self._program, command, source, *options], stdout=subprocess.PIPE, text=True)

    def _written(self, arrays: Arrays) -> Path:
        path = self._folder / "input.bin"
        with path.open("wb") as file:
            file.write(b"ADWABIN1" + struct.pack("<I", len(arrays)))
            for name, array in arrays.items():
                file.write(struct.pack("<I", len(name)) + name.encode() + CODES[array.dtype.name])
                file.write(struct.pack(f"<I{array.ndim}Q", array.ndim, *array.shape) + array.tobytes())
        return path


def yardstick() -> Yardstick | None:
    """None where the program or a compiler is absent."""
    return Yardstick() if (PEERS / "adwa_ref.cpp").is_file() and shutil.which("g++") else None


def peer(name: str) -> ModuleType | None:
    """A Python peer by its file's name; None where it, or what it imports, is absent."""
    path = PEERS / f"{name}.py"
    if not path.is_file() or importlib.util.find_spec("numba") is None:
        return None
    os.environ.setdefault("NUMBA_CACHE_DIR", tempfile.mkdtemp(prefix="numba-"))
    writes, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sys.dont_write_bytecode = writes
    return module


def doubled(rates: Sequence[float]) -> float:
    """What as many processes as cores would reach, by one that keeps one core busy."""
    return usable_cores() * float(np.median(rates))
