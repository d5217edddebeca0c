"""What each rule does: taken from the extended planner, and added alone to the paper's, on common scenarios."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from adwa_jax.presets import Preset, preset
from adwa_jax.rules import EVERY_RULE, RULE_NAMES, Rules
from scenarios.suite import Suite
from tuning.evaluate import evaluate
from tuning.intervals import paired_difference, small_sample_interval, wilson
from tuning.results import Results

PAPER, EXTENDED = "paper", "extended"
COMPARED = ("time", "length_ratio")  # means over the scenarios that both reach
TIMED, REPEATS = 64, 3  # scenarios whose evaluation is timed, and how often
Progress = Callable[[int, int], None]  # (scenarios driven, of how many)


@dataclass(frozen=True)
class Configuration:
    """One planner of the comparison."""

    name: str
    rules: Rules
    base: str | None = None  # the configuration that it is compared with
    rule: str | None = None  # in which alone they differ


@dataclass(frozen=True)
class Row:
    """What one configuration did, beside its base."""

    configuration: Configuration
    results: Results
    base: Results | None
    seconds: float  # processor time of evaluating the scenarios that are timed, compilation left out
    control_steps: int  # driven in that time

    def difference(self) -> tuple[float, float, float] | None:
        """Success rate minus the base's, with its 95 % interval; None without a base."""
        if self.base is None:
            return None
        here, there = self.results.reached, self.base.reached
        return paired_difference(*(int(np.sum(both)) for both in (here & there, here & ~there, ~here & there,
                                                                  ~here & ~there)))  # fmt: skip

    def mean_difference(self, measure: str) -> tuple[float, float, float] | None:
        """Mean of the paired differences over the scenarios that both reach, with its interval; None without any."""
        if self.base is None or not (self.results.reached & self.base.reached).any():
            return None
        both = self.results.reached & self.base.reached
        here, there = (results.measures[measure][both].astype(np.float64) for results in (self.results, self.base))
        return small_sample_interval((here - there).tolist())

    def record(self) -> dict[str, Any]:
        """The JSON form."""
        results, configuration = self.results, self.configuration
        successes = int(results.reached.sum())
        found: dict[str, Any] = {
            "configuration": configuration.name, "base": configuration.base, "rule": configuration.rule,
            "count": results.count, "success_rate": successes / results.count,
            "success_ci": list(wilson(successes, results.count)),
            **_named("difference", self.difference()),
            "other_outcome": None if self.base is None else int(np.sum(results.outcome != self.base.outcome)),
            **results.outcomes(), "hit_while_stopped": results.standing_hits(),
            "both_reached": None if self.base is None else int(np.sum(results.reached & self.base.reached)),
        }  # fmt: skip
        for measure in COMPARED:
            found[measure] = results.means()[measure]
            found |= _named(f"{measure}_difference", self.mean_difference(measure))
        return found | {"control_steps": self.control_steps, "seconds": self.seconds,
                        "microseconds_a_step": self.microseconds_a_step(), "outcome": results.outcome.tolist()}

    def microseconds_a_step(self) -> float | None:
        """Processor time of the evaluation over the control steps driven: what a step costs, planning included."""
        return 1e6 * self.seconds / self.control_steps if self.control_steps else None


def ablate(suite: Suite, rules: Sequence[str] = RULE_NAMES, driving: Callable[[Preset], Preset] = lambda config: config,
           progress: Progress | None = None, repeats: int = REPEATS) -> Iterator[Row]:
    """The rows of `configurations`, each as soon as it is evaluated on all scenarios of the suite.

    driving: puts each planner on the robot that is meant. progress: over the scenarios of all configurations. Each
    configuration is compiled anew, which is left out of its cost. repeats: runs of which the cost is the least; 0: it
    is not measured.
    """
    bases: dict[str, Results] = {}
    for place, configuration in enumerate(configurations(rules)):
        config = driving(preset(configuration.rules))
        results = evaluate(suite, config, progress=_overall(progress, place, suite, rules))
        seconds, steps = _cost(suite, config, repeats) if repeats else (0.0, 0)
        base = bases.get(configuration.base) if configuration.base else None
        if configuration.rule is None:
            bases[configuration.name] = results
        yield Row(configuration, results, base, seconds, steps)


def configurations(rules: Sequence[str] = RULE_NAMES) -> list[Configuration]:
    """The paper's planner, the extended one, and for each rule the extended one without it and the paper's with it."""
    both = [Configuration(PAPER, Rules()), Configuration(EXTENDED, EVERY_RULE, PAPER)]
    for rule in rules:
        both += [Configuration(f"{EXTENDED} without {rule}", EVERY_RULE.without(rule), EXTENDED, rule),
                 Configuration(f"{PAPER} with {rule}", Rules().only(rule), PAPER, rule)]  # fmt: skip
    return both


def _overall(progress: Progress | None, place: int, suite: Suite, rules: Sequence[str]) -> Progress | None:
    """What counts a configuration's scenarios on top of those of the configurations before it."""
    if progress is None:
        return None
    count = len(suite.scenarios)
    return lambda done, _: progress(place * count + done, len(configurations(rules)) * count)


def _cost(suite: Suite, config: Preset, repeats: int) -> tuple[float, int]:
    """Processor time [s] and control steps of the suite's first `TIMED` scenarios: the least of so many runs."""
    sample = Suite(suite.name, suite.scenarios[:TIMED], suite.names[:TIMED], suite.recipe)
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        results = evaluate(sample, config)
        times.append(time.process_time() - begin)
    return min(times), int(np.sum(np.rint(results.measures["time"] / np.float32(config.constants.behaviour.dt))))


def _named(name: str, interval: tuple[float, float, float] | None) -> dict[str, Any]:
    if interval is None:
        return {name: None, f"{name}_ci": None}
    return {name: interval[0], f"{name}_ci": list(interval[1:])}
