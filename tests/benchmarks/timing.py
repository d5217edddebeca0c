"""Timing of contestants one after another, round after round, so that all see the same machine."""

import statistics
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from typing import Any

ROUNDS = 5


@dataclass
class Figure:
    """What a contestant reached."""

    task: str
    who: str
    unit: str  # what is counted
    rates: list[float] = field(default_factory=list)  # items a second on all cores, one a round
    first_s: float | None = None  # the first call, compiling included [s]
    note: str = ""

    @property
    def rate(self) -> float:
        """The median."""
        return statistics.median(self.rates)

    def record(self, baseline: float | None) -> dict[str, Any]:
        """The JSON form; baseline: a rate that it is compared with."""
        return asdict(self) | {"rate": self.rate, "ratio": self.rate / baseline if baseline else None}


def contest(task: str, unit: str, contestants: dict[str, Callable[[], float]], rounds: int = ROUNDS) -> list[Figure]:
    """Each contestant is called once to warm up, then in turn; it returns its items a second."""
    figures = [Figure(task, who, unit) for who in contestants]
    for figure, call in zip(figures, contestants.values(), strict=True):
        begin = time.perf_counter()
        call()
        figure.first_s = time.perf_counter() - begin
    for _ in range(rounds):
        for figure, call in zip(figures, contestants.values(), strict=True):
            figure.rates.append(call())
    return figures


def rate_of(items: int, work: Callable[[], Any]) -> float:
    """Items a second of one call."""
    begin = time.perf_counter()
    work()
    return items / (time.perf_counter() - begin)


def in_threads(parts: Iterable[Callable[[], Any]]) -> list[Any]:
    """The parts at once, a thread each."""
    parts = list(parts)
    with ThreadPoolExecutor(len(parts)) as pool:
        return [future.result() for future in [pool.submit(part) for part in parts]]
