"""The worlds of the BARN benchmark in one archive of grids, as its own planners' training data holds them.

Dimension letters: n worlds; 30 columns along x, 64 rows along y (`scenarios.formats.barn_world`).
"""

import zipfile
import zlib
from io import BytesIO
from pathlib import Path

import numpy as np

from adwa_jax.scenario import Scenario
from scenarios.errors import InputError
from scenarios.formats.barn_world import COLUMNS, ROWS, barn_task, path_file_of, reference_length
from scenarios.formats.reading import bad_input, read_bytes

_KIND = "an archive of BARN grids"


def load_barn_grids(path: str | Path) -> list[tuple[str, Scenario]]:
    """Every world of an npz archive as (name, Scenario), `world_2` by name, in the archive's order.

    The archive holds `world` [n], whole numbers, and `full` [n, 30, 64] of 0 and 1, axis 1 along x, enclosed cells
    filled; each world's `path_<i>.npy` (`path_file_of`) gives its reference length. Raises InputError for another
    archive, a world that is there twice and a missing path file.
    """
    worlds, full = _arrays(path)
    folder = Path(path).parent
    scenarios = []
    for number, cells in zip(worlds, full, strict=True):
        length = reference_length(path_file_of(f"{path}, world {number}", number, folder))
        scenarios.append((f"world_{number}", barn_task(cells.T, length)))
    return scenarios


def _arrays(path: str | Path) -> tuple[list[int], np.ndarray]:
    """World numbers, n ≥ 1, and grids [n, 30, 64] bool."""
    worlds, full = _read(path)
    if worlds.ndim != 1 or not len(worlds) or not np.issubdtype(worlds.dtype, np.integer):
        raise _other(path, f"array 'world' is {worlds.dtype} of shape {worlds.shape}")
    if full.shape != (len(worlds), COLUMNS, ROWS) or full.dtype.kind not in "biu" or not np.isin(full, (0, 1)).all():
        raise _other(path, f"array 'full' is {full.dtype} of shape {full.shape}, or holds other values than 0 and 1")
    numbers = worlds.tolist()
    for number in numbers:
        if numbers.count(number) > 1:
            raise bad_input(path, f"world {number} is there twice", "one grid for each world", "remove one")
    return numbers, full.astype(np.bool_)


def _read(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    content = read_bytes(path, _KIND)
    try:
        with np.load(BytesIO(content), allow_pickle=False) as archive:
            return archive["world"], archive["full"]
    except (OSError, EOFError, ValueError, KeyError, TypeError, AttributeError, zlib.error,
            zipfile.BadZipFile) as error:
        raise _other(path, f"cannot be read ({error})") from None


def _other(path: str | Path, found: str) -> InputError:
    return bad_input(path, found, f"{_KIND} is an .npz of 'world' [n], whole numbers, and 'full' "
                     f"[n, {COLUMNS}, {ROWS}] of 0 and 1", "fetch the file again, or give a folder of .world files")
