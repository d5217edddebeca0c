"""Candidates judged on a suite so that a kill costs seconds: by blocks of whole tiles, each kept once it is driven."""

import time
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from adwa_jax.constants import Options
from adwa_jax.presets import Preset
from scenarios.suite import Suite
from tuning.engine import Judged, Progress, judge_pairs
from tuning.job_folder import Log
from tuning.plans_only import judge_plans
from tuning.racing import Judge
from tuning.space import Space
from tuning.store import Store

BLOCK_SECONDS = 15.0  # of work that a kill may cost
FIRST_BLOCK, SMALLEST_BLOCK, LARGEST_BLOCK = 512, 128, 16384  # episodes


class Block(NamedTuple):
    """What one call of the engine drives: places of candidates, all of the same options, and consecutive tiles."""

    places: np.ndarray  # [c]
    tiles: slice


class TiledJudge:
    """Judges the generations of a job on one suite."""

    def __init__(self, store: Store, suite: Suite, space: Space, log: Log, total: int, progress: Progress,
                 plans_only: bool = False):
        """total: episodes there may be in all, for the progress; plans_only: nothing is driven."""
        self._judge_pairs = judge_plans if plans_only else judge_pairs
        self.driven, self.read, self.engine_seconds = 0, 0, 0.0  # episodes; by this process, and found done
        self._total = total
        self._store, self._suite, self._space, self._log = store, suite, space, log
        self._progress = progress
        self._size = FIRST_BLOCK  # episodes of the next block

    def admitted(self, first: int, values: np.ndarray, generation: np.ndarray) -> Judge:
        """Judges candidates that have the constants values [C, D], of generations [C], in the store's rows from first.

        It drives what is not in the store, in whole tiles. Raises KeyboardInterrupt, with what is done kept.
        """
        done = self._store.admit(first, values, generation).copy()
        presets = [self._space.preset(row) for row in values]

        def judge(which: np.ndarray, start: int, stop: int) -> dict[str, np.ndarray]:
            tiles = self._tiles(start, stop)
            needed = np.zeros_like(done)
            needed[which, tiles] = ~done[which, tiles]
            self.read += len(which) * (stop - start) - int((needed * np.array(self._widths())).sum())
            while (block := next(blocks(needed, presets, self._widths(), self._size), None)) is not None:
                self._drive(block, first, values, presets)
                needed[block.places, block.tiles] = False
                done[block.places, block.tiles] = True
            return self._store.read(first + which, tiles)

        return judge

    def _widths(self) -> list[int]:
        return [part.stop - part.start for part in self._store.tiles]

    def _tiles(self, start: int, stop: int) -> slice:
        """Those of a range of scenarios that begins and ends with a tile."""
        first, last = (index for index in (start // self._store.width, -(-stop // self._store.width)))
        assert self._store.tiles[first].start == start
        assert self._store.tiles[last - 1].stop == stop
        return slice(first, last)

    def _drive(self, block: Block, first: int, values: np.ndarray, presets: Sequence[Preset]) -> None:
        start, stop = self._store.tiles[block.tiles.start].start, self._store.tiles[block.tiles.stop - 1].stop
        candidates = [presets[place].constants for place in block.places]
        began = time.perf_counter()
        judged = self._judge_pairs(self._suite.scenarios[start:stop], candidates, presets[block.places[0]].options,
                             progress=lambda done, _: self._progress(self.read + self.driven + done, self._total))
        seconds = time.perf_counter() - began
        self._keep(judged, block, first, values)
        episodes = int(judged.done.sum())
        event = "block" if judged.done.all() else "block cut short"  # of which whole tiles are kept
        self._log.write(event, suite=self._store.path.stem, rows=[int(first + place) for place in block.places],
                        scenarios=[start, stop], episodes=episodes, seconds=round(seconds, 3))  # fmt: skip
        self.driven, self.engine_seconds = self.driven + episodes, self.engine_seconds + seconds
        if not judged.done.all():
            raise KeyboardInterrupt
        self._size = int(np.clip(BLOCK_SECONDS * episodes / seconds, SMALLEST_BLOCK, LARGEST_BLOCK))

    def _keep(self, judged: Judged, block: Block, first: int, values: np.ndarray) -> None:
        """Write the tiles that are done: all together if all are."""
        rows, offset = first + block.places, self._store.tiles[block.tiles.start].start
        if judged.done.all():
            self._store.write(rows, block.tiles, values[block.places], judged.columns)
            return
        for tile in range(block.tiles.start, block.tiles.stop):
            part = slice(self._store.tiles[tile].start - offset, self._store.tiles[tile].stop - offset)
            whole = np.flatnonzero(judged.done[:, part].all(axis=1))
            if len(whole):
                columns = {name: column[whole, part] for name, column in judged.columns.items()}
                self._store.write(rows[whole], slice(tile, tile + 1), values[block.places[whole]], columns)


def blocks(needed: np.ndarray, presets: Sequence[Preset], widths: Sequence[int], size: int) -> Iterator[Block]:
    """Cut the tiles that are needed, [C, T] bool, into blocks of about `size` episodes; widths: T, scenarios a tile.

    Candidates of other options are another program's. As many candidates as can be go together: they share plans.
    """
    for places in _by_options(presets):
        columns = [tuple(places[needed[places, tile]].tolist()) for tile in range(needed.shape[1])]
        for members, tiles in groupby(range(len(columns)), key=columns.__getitem__):
            if members:
                yield from _cut(np.array(members), list(tiles), widths, size)


def _by_options(presets: Sequence[Preset]) -> list[np.ndarray]:
    groups: dict[Options, list[int]] = {}
    for place, preset in enumerate(presets):
        groups.setdefault(preset.options, []).append(place)
    return [np.array(places) for places in groups.values()]


def _cut(members: np.ndarray, tiles: list[int], widths: Sequence[int], size: int) -> Iterator[Block]:
    widest = max(widths[tile] for tile in tiles)
    together = max(1, size // widest)  # candidates
    for start in range(0, len(members), together):
        some = members[start : start + together]
        run = max(1, size // (widest * len(some)))  # tiles
        for first in range(0, len(tiles), run):
            last = min(first + run, len(tiles)) - 1
            yield Block(some, slice(tiles[first], tiles[last] + 1))
