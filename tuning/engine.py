"""The one way to run episodes: every pair of a candidate and a scenario, on lanes never idle while work is left.

Each of a few threads keeps a fixed number of lanes; between short compiled blocks of control steps the lanes whose
episodes have ended hand in their results and get the next pairs of the queue. What a pair's answer is depends on that
pair only: the same bits come out whatever the lanes, threads, order or company. Memory is that of the lanes, of a few
plans, and some 170 bytes a pair for the queue and the table of results.

Dimension letters: W candidates; S scenarios; B lanes.
"""

import os
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from math import ceil
from typing import Any, NamedTuple

import jax
import numpy as np

from adwa_jax.constants import Constants, Options
from adwa_jax.episode import RUNNING, Episode
from adwa_jax.lanes import Lanes, Task, advanced, filled, idle_lanes, results
from adwa_jax.scenario import Scenario
from scenarios.padding import PaddedShape, padded_shape
from tuning.compiled import keep_compiled
from tuning.plans_ahead import Pair, Planner, planned_by

FINEST_SPACING = 0.1  # [m]; the distance field is no finer, however many lattice steps a cell the options ask for
# Side of the map [cells] up to which a worker has so many lanes: enough for whole vectors, few because what they hold
# should stay in the cache, and because lanes without work, as there are at the end, cost as much as those with it.
LANES = ((128, 32), (256, 16), (512, 8))
FEWEST_LANES = 4
ON_ACCELERATOR = 128  # times as many lanes, of one worker
FILLED_AT_ONCE = 4  # lanes that one call fills, of so few; of more lanes an eighth, as some end in every block
LOOK = 0.2  # [s] between two looks at how far the work is
BLOCK_STEPS = 32  # control steps between two looks at which lanes have ended; an episode has hundreds

Progress = Callable[[int, int], None]  # (pairs done, of how many)


@dataclass(frozen=True)
class Program:
    """What one compiled program serves. All of it follows from each scenario by itself."""

    shape: PaddedShape
    options: Options


class Judged(NamedTuple):
    """What came of W × S pairs."""

    columns: dict[str, np.ndarray]  # every figure by name, [W, S] each; `outcome` is among them
    done: np.ndarray  # [W, S] bool; False: the run was interrupted before
    plans: int  # made for it


def judge_pairs(scenarios: Sequence[Scenario], candidates: Sequence[Constants], options: Options,
                lanes: int | None = None, workers: int | None = None, progress: Progress | None = None) -> Judged:
    """Plan and drive every scenario with every candidate's constants.

    Nothing is compiled anew for other constants, scenarios of the same padded shape, or counts. lanes: of each worker,
    by default as many as suit the map; workers: threads, by default one a core, or one for an accelerator. `progress`
    is called from time to time. On KeyboardInterrupt the blocks in progress are ended and what is done is returned:
    `done` says what that is.
    """
    keep_compiled()
    candidates = [jax.tree.map(np.float32, candidate) for candidate in candidates]
    table = Table(len(candidates), len(scenarios), progress)
    count = _workers() if workers is None else workers
    for program, pairs in pairs_by_program(scenarios, candidates, options).items():
        if table.stop:
            break
        planner = Planner(scenarios, candidates, program.options, program.shape, pairs)
        queue = _Queue(planner, candidates, pairs, table)
        width = lanes_of(program) if lanes is None else lanes
        in_threads(partial(_work, queue, program.options, width, table), min(count, len(pairs)), table)
        table.count(planner.plans_made)
    return table.judged()


def usable_cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _workers() -> int:
    return usable_cores() if jax.default_backend() == "cpu" else 1


def program_of(scenario: Scenario, constants: Constants, options: Options) -> Program:
    """The compiled program a scenario belongs to."""
    shape = padded_shape(scenario)
    resolution = float(scenario.grid.resolution)
    subdivision = min(options.plan.subdivision, max(1, ceil(resolution / FINEST_SPACING - 1e-6)))
    reach = max(options.contact_reach, ceil(float(constants.robot.radius) / resolution) + 1)
    return Program(shape, replace(options, plan=replace(options.plan, subdivision=subdivision), contact_reach=reach))


def lanes_of(program: Program) -> int:
    """How many lanes a worker gets if nothing else is said; the same for any number of pairs."""
    side = max(program.shape.rows, program.shape.columns)
    lanes = next((lanes for limit, lanes in LANES if side <= limit), FEWEST_LANES)
    return lanes if jax.default_backend() == "cpu" else lanes * ON_ACCELERATOR


def pairs_by_program(scenarios: Sequence[Scenario], candidates: Sequence[Constants],
                     options: Options) -> dict[Program, list[Pair]]:
    """Pairs of one program together: scenario after scenario, those with one plan side by side, so that plans are
    needed one after another and none for long.
    """
    in_order = sorted(range(len(candidates)), key=lambda index: planned_by(candidates[index]))
    by_radius: dict[float, list[int]] = {}
    for candidate in in_order:
        by_radius.setdefault(float(candidates[candidate].robot.radius), []).append(candidate)
    members: dict[Program, list[Pair]] = {}
    for index, scenario in enumerate(scenarios):
        for same_size in by_radius.values():
            program = program_of(scenario, candidates[same_size[0]], options)
            members.setdefault(program, []).extend(Pair(candidate, index) for candidate in same_size)
    return members


class Table:
    """Results as they come in; safe to use from several threads."""

    def __init__(self, candidates: int, scenarios: int, progress: Progress | None):
        self.columns: dict[str, np.ndarray] = {}
        self.done = np.zeros((candidates, scenarios), np.bool_)
        self.stop = False  # set once, to end the run after the blocks in progress
        self._plans = 0
        self._progress, self._reported = progress, -1
        self._lock = threading.Lock()

    def write(self, pairs: Sequence[Pair], rows: dict[str, np.ndarray]) -> None:
        """What came of some pairs. rows: name -> [len(pairs)]."""
        at = tuple(np.array(pairs, np.int64).T)
        with self._lock:
            for name, values in rows.items():
                if name not in self.columns:
                    self.columns[name] = np.zeros(self.done.shape, values.dtype)
                self.columns[name][at] = values
            self.done[at] = True

    def count(self, plans: int) -> None:
        """So many plans more were made."""
        with self._lock:
            self._plans += plans

    def judged(self) -> Judged:
        """All that has come in."""
        return Judged(self.columns, self.done, self._plans)

    def report(self) -> None:
        """Tell how far the work is, if it is farther than last time."""
        done = int(self.done.sum())
        if self._progress and done != self._reported:
            self._reported = done
            self._progress(done, self.done.size)


def in_threads(work: Callable[[], None], count: int, table: Table) -> None:
    """Run `count` workers to their end, or, once the user interrupts, to the end of their blocks."""
    failed: list[BaseException] = []

    def run() -> None:
        try:
            work()
        except BaseException as error:
            failed.append(error)
            table.stop = True

    threads = [threading.Thread(target=run, daemon=True) for _ in range(count)]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        try:
            for thread in threads:
                thread.join(LOOK / len(threads))
            table.report()
        except KeyboardInterrupt:
            table.stop = True
    if failed:
        raise failed[0]


class _Held(NamedTuple):
    """The pair in a lane."""

    pair: Pair
    figures: dict[str, np.ndarray]


class _Queue:
    """The pairs of one program in order, handed out with their plans; safe to use from several threads."""

    def __init__(self, planner: Planner, candidates: Sequence[Constants], pairs: Sequence[Pair], table: Table):
        self._planner, self._candidates, self._table = planner, candidates, table
        self._waiting = iter(pairs)
        self._lock = threading.Lock()

    def take(self, count: int) -> list[tuple[_Held, Task]]:
        """The next pairs, `count` at most; none once the run is to end."""
        with self._lock:
            if self._table.stop:
                return []
            return [self._taken(pair) for pair in islice(self._waiting, count)]

    def _taken(self, pair: Pair) -> tuple[_Held, Task]:
        planned = self._planner.planned(pair)
        return _Held(pair, planned.figures), Task(planned.scenario, planned.plan, self._candidates[pair.candidate])


def _work(queue: _Queue, options: Options, width: int, table: Table) -> None:
    """One worker: keep `width` lanes busy until the queue is empty and the last of them has ended."""
    lanes: Lanes | None = None
    held: dict[int, _Held] = {}  # by lane
    at_once = max(FILLED_AT_ONCE, width // 8)
    while True:
        free = [lane for lane in range(width) if lane not in held]
        for start in range(0, len(free), at_once):
            places = free[start : start + at_once]
            taken = queue.take(len(places))
            if not taken:
                break
            lanes = _with(lanes, [task for _, task in taken], places[: len(taken)], options, width, at_once)
            held |= dict(zip(places, (pair for pair, _ in taken), strict=False))
        if lanes is None or not held:
            return
        moved: Lanes = _block(lanes, options)
        _hand_in(moved, held, table)
        lanes = moved


def _with(lanes: Lanes | None, tasks: list[Task], places: list[int], options: Options, width: int,
          at_once: int) -> Lanes:
    """The lanes with new episodes; idle ones are made first if there are none yet. at_once: rows that a call takes."""
    lanes = _idle(tasks[0], options, width) if lanes is None else lanes
    missing = at_once - len(tasks)
    rows = jax.tree.map(lambda *leaves: np.stack(leaves), *tasks, *tasks[:1] * missing)
    return _fill(lanes, rows, np.array(places + [0] * missing, np.int32), np.int32(len(tasks)))


def _hand_in(lanes: Lanes, held: dict[int, _Held], table: Table) -> None:
    """Write down the episodes that have ended, and let go of their lanes."""
    outcome = np.asarray(lanes.state.outcome)
    ended = [lane for lane in held if outcome[lane] != RUNNING]
    if ended:
        episodes = jax.device_get(_results(lanes))
        planned = [held[lane].figures for lane in ended]
        rows = {name: np.stack([figures[name] for figures in planned]) for name in planned[0]}
        rows |= {name: values[ended] for name, values in driven_columns(episodes).items()}
        table.write([held.pop(lane).pair for lane in ended], rows)


def driven_columns(episodes: Episode) -> dict[str, Any]:
    """The driven path's figures by name."""
    return {"outcome": episodes.outcome, "hit_while_stopped": episodes.hit_while_stopped,
            "brakings": episodes.brakings, "replans": episodes.replans, **episodes.measures._asdict()}  # fmt: skip


@partial(jax.jit, static_argnames=("options", "width"))
def _idle(task: Task, options: Options, width: int) -> Lanes:
    return idle_lanes(task, options, width)


@partial(jax.jit, donate_argnames="lanes")
def _fill(lanes: Lanes, tasks: Task, places: jax.Array, count: jax.Array) -> Lanes:
    """The first `count` tasks of a few are put in their places."""

    def body_fun(index: jax.Array, lanes: Lanes) -> Lanes:
        return filled(lanes, jax.tree.map(lambda leaf: leaf[index], tasks), places[index])

    return jax.lax.fori_loop(0, count, body_fun, lanes)


@partial(jax.jit, static_argnames="options", donate_argnames="lanes")
def _block(lanes: Lanes, options: Options) -> Lanes:
    return advanced(lanes, options, BLOCK_STEPS)


@jax.jit
def _results(lanes: Lanes) -> Episode:
    return results(lanes)
