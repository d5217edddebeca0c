"""What an evaluation found: one row a scenario, outcomes counted, rates and means with their intervals."""

import csv
import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from adwa_jax.episode import Outcome
from scenarios.feasibility import Feasibility
from tuning.intervals import wilson

# Their means are over all scenarios: success is part of the first two, the last never comes with it, and who plans
# anew succeeds more or less often for it.
OVER_ALL = ("spl", "barn_score", "replans", "hit_while_stopped")
QUANTILES = {"least": 0.0, "5 %": 0.05, "median": 0.5}


@dataclass(frozen=True)
class Results:
    """One value a scenario in every column; N scenarios, in the suite's order."""

    suite: str
    names: tuple[str, ...]  # N
    outcome: np.ndarray  # [N] int32, an `Outcome`
    measures: dict[str, np.ndarray]  # name -> [N]; planned path first, then driven path (units: metrics)
    feasibility: np.ndarray | None = None  # [N] int32, a `Feasibility`; None: not asked

    @property
    def count(self) -> int:
        """How many scenarios."""
        return len(self.names)

    @property
    def reached(self) -> np.ndarray:
        """[N] bool."""
        return self.outcome == Outcome.REACHED

    def outcomes(self) -> dict[str, int]:
        """Scenarios by outcome, every outcome named."""
        counted = Counter(self.outcome.tolist())
        return {outcome.name: counted.get(int(outcome), 0) for outcome in Outcome}

    def standing_hits(self) -> int:
        """In how many scenarios a mover ran into the standing robot."""
        return int(self.measures["hit_while_stopped"].sum())

    def means(self) -> dict[str, float | None]:
        """Mean of every measure over the successes (of `OVER_ALL` over all scenarios); None where there is none."""
        return {name: self._mean(name, values) for name, values in self.measures.items()}

    def _mean(self, name: str, values: np.ndarray) -> float | None:
        taken = values if name in OVER_ALL else values[self.reached]
        return float(np.mean(taken, dtype=np.float64)) if taken.size else None

    def success_among(self, kept: np.ndarray) -> dict[str, Any]:
        """Success among some scenarios, kept [N] bool: how many they are, the rate (None of none), its interval."""
        successes, count = int((self.reached & kept).sum()), int(kept.sum())
        return {"count": count, "success_rate": successes / count if count else None,
                "success_ci": list(wilson(successes, count))}  # fmt: skip

    def closest_approach(self) -> dict[str, float | None]:
        """Quantiles of the least clearance [m] over all scenarios that were driven, failures included."""
        driven = self.measures["least_clearance"][self.outcome != Outcome.NO_PATH]
        return {name: float(np.quantile(driven, share)) if driven.size else None for name, share in QUANTILES.items()}

    def feasible(self) -> dict[str, Any] | None:
        """Scenarios by what is proven of them, and the success among those that are not proven impossible; or None."""
        if self.feasibility is None:
            return None
        return {
            **{kind.name: int((self.feasibility == kind).sum()) for kind in Feasibility},
            "not_impossible": self.success_among(self.feasibility != Feasibility.IMPOSSIBLE),
            "possible": self.success_among(self.feasibility == Feasibility.POSSIBLE),
        }

    def summary(self) -> dict[str, Any]:
        """The JSON form: count, outcomes, success_rate, success_ci, means and a list of scenarios."""
        successes = int(self.reached.sum())
        return {
            "suite": self.suite,
            "count": self.count,
            "outcomes": self.outcomes(),
            **self.success_among(np.ones(self.count, np.bool_)),
            "feasible": self.feasible(),
            "closest_approach": self.closest_approach(),
            "means_over": f"successes ({successes}); {', '.join(OVER_ALL)}: all scenarios",
            "means": self.means(),
            "scenarios": [self.scenario(index) for index in range(self.count)],
        }

    def scenario(self, index: int) -> dict[str, Any]:
        """One scenario's row."""
        row = {name: values[index].item() for name, values in self.measures.items()}
        if self.feasibility is not None:
            row["feasibility"] = Feasibility(int(self.feasibility[index])).name
        return {"name": self.names[index], "outcome": Outcome(int(self.outcome[index])).name, **row}

    def write(self, folder: Path) -> list[Path]:
        """Write results.json and results.csv into a folder, made if need be; returns their paths."""
        folder.mkdir(parents=True, exist_ok=True)
        summary = self.summary()
        (folder / "results.json").write_text(json.dumps(summary, indent=1) + "\n")
        with (folder / "results.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, fieldnames=list(summary["scenarios"][0]))
            writer.writeheader()
            writer.writerows(summary["scenarios"])
        return [folder / "results.json", folder / "results.csv"]
