"""A job that is done, to be looked at: its findings, and each of its members by the number that the tables give it.

Number 0 is the default constants, 1 the first member of the front. Dimension letters: H rows driven on held-out
scenarios.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from adwa_jax.presets import Preset
from scenarios.errors import InputError
from tuning.analysis import analyse, chosen_by_hand, chosen_rows, front_rows
from tuning.evaluations import Evaluations
from tuning.findings import Findings, Member
from tuning.job_checks import Setup
from tuning.job_folder import HELD_OUT, TRAINING
from tuning.results import Results
from tuning.store import as_evaluations

SHOWN = 32  # members of the front that are driven on held-out scenarios


@dataclass(frozen=True)
class FinishedJob:
    """What a job was, what it drove, and what that comes to."""

    setup: Setup
    training: Evaluations
    held_out: Evaluations | None  # None: not driven, or not that of this front
    held_out_rows: np.ndarray  # [H] the row of `training` that each candidate of `held_out` is
    findings: Findings

    def member(self, number: int) -> Member:
        """InputError for a number that no table has."""
        most = len(self.findings.front)
        if not isinstance(number, int | np.integer) or not 0 <= number <= most:
            raise InputError(f"member: {number!r}; must be from 1 to {most}, or 0 for the default; choose one of them")
        return self.findings.front[number - 1] if number else self.findings.default

    def choosing(self, number: int) -> Findings:
        """The findings with that member of the front, from 1, chosen in the place of the recommended one."""
        if number == 0:
            raise InputError("member: 0; the default is compared with itself; choose a member of the front, from 1")
        self.member(number)
        return chosen_by_hand(self.findings, number - 1, self.held_out, self.held_out_rows, self.setup.job.seed)

    def preset(self, number: int) -> Preset:
        """The planner with the member's constants."""
        return self.setup.space.preset(self.member(number).values)

    def held_out_results(self, number: int) -> Results:
        """What the member did on the held-out scenarios, in the form of an evaluation."""
        from tuning.failures import results_of  # brings the drawing with it

        places = np.flatnonzero(self.held_out_rows == self.member(number).row)
        if self.held_out is None or not places.size:
            raise InputError(f"member: {number}; was not driven on the held-out scenarios; choose another, or go on "
                             "with the job: adwa tune resume FOLDER")  # fmt: skip
        return results_of(self.held_out, int(places[0]), self.setup.held_out)


def finished(folder: Path, setup: Setup) -> FinishedJob:
    """Analyse what the folder's stores hold; nothing is driven or written. InputError before the default is judged."""
    training = as_evaluations(folder / TRAINING)
    if not training.done.any() or not training.complete[0]:
        raise InputError(f"{folder}: the default constants are not judged yet; a report compares with them; go on: "
                         f"adwa tune resume {folder}")  # fmt: skip
    held_out, rows = _held_out(folder, training, setup)
    findings = analyse(training, held_out, rows, setup.goals, setup.space, setup.job.choice, setup.job.seed)
    return FinishedJob(setup, training, held_out, rows, findings)


def held_out_rows(training: Evaluations, setup: Setup) -> np.ndarray:
    """[H] training rows that the held-out suite is driven with, ascending: the default, the front, every choice."""
    return np.unique(np.concatenate([[0], front_rows(training, setup.goals, SHOWN),
                                     chosen_rows(training, setup.goals, setup.job.choice)]))  # fmt: skip


def _held_out(folder: Path, training: Evaluations, setup: Setup) -> tuple[Evaluations | None, np.ndarray]:
    """The held-out evaluations with their training rows; none unless they are those of the training's front."""
    nothing = None, np.zeros(0, np.int64)
    if not (folder / HELD_OUT).exists():
        return nothing
    found, rows = as_evaluations(folder / HELD_OUT), held_out_rows(training, setup)
    same = found.complete.all() and np.array_equal(found.values, training.values[rows])
    return (found, rows) if same else nothing
