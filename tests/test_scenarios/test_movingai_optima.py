"""Search against the listed optima of the MovingAI benchmark."""

from pathlib import Path

import numpy as np
import pytest

from adwa_jax.astar import Status
from adwa_jax.constants import PlanOptions
from scenarios.formats import MapFile, ScenEntry, load_map, load_scen
from tuning.planning import plan_paths, planner_constants

FLOAT32 = 1e-7  # relative: lengths are reported in float32
LARGEST = 64  # larger maps, of which most compile a program of their own, only with --every-query


def scen_files(folder: Path) -> list[tuple[Path, Path]]:
    """Every .scen with its map, all families but wc3 (whose ends may be blocked)."""
    pairs = []
    for scen in sorted(folder.rglob("*.scen")):
        maps = [file for file in scen.parent.glob("*.map") if scen.name.startswith(file.stem)]
        if maps and "wc3" not in scen.parent.name:
            pairs.append((max(maps, key=lambda file: len(file.stem)), scen))
    return pairs


@pytest.mark.realdata
def test_lengths_equal_the_listed_optima(data_folder, every_query):
    checked = 0
    for map_path, scen_path in scen_files(data_folder / "movingai"):
        map_file, entries = load_map(map_path), load_scen(scen_path)
        side = max(map_file.occupied.shape)
        if side > LARGEST and not every_query and map_path.stem != "lak203d":  # which lists unreachable goals
            continue
        most = 20 if not every_query else 50 if side > 256 else len(entries)
        chosen = [entries[place] for place in np.linspace(0, len(entries) - 1, min(most, len(entries))).astype(int)]
        check(map_file, chosen)
        checked += len(chosen)
    assert checked > 400  # the folder was read


def check(map_file: MapFile, entries: list[ScenEntry]) -> None:
    queries = np.array([[entry.start_point, entry.goal_point] for entry in entries])
    answers = plan_paths(map_file.grid(), queries, planner_constants(), PlanOptions(scope="one"))
    for entry, answer in zip(entries, answers, strict=True):
        where = f"{map_file.name}, line {entry.line} of its .scen"
        if entry.expected_unreachable:
            assert answer.status == Status.UNREACHABLE, where
        else:
            assert answer.status == Status.FOUND, where
            assert abs(answer.length - entry.expected) <= entry.tolerance + FLOAT32 * entry.expected, where
