"""Jobs from begin to end.

Everything is determined by the job file. A job that goes on after a kill is the same job begun anew, in which what is
done need not be done again.
"""

import os
import time
from pathlib import Path

from tuning.conclude_job import conclude, drive_held_out
from tuning.console import note, progress_bar
from tuning.findings import Findings
from tuning.finished_job import FinishedJob, finished
from tuning.job_checks import Setup, set_up
from tuning.job_file import load_job
from tuning.job_folder import (
    HELD_OUT,
    JOB,
    TRAINING,
    Log,
    begin,
    differing_versions,
    environment_of,
    home_of,
    locked,
    require_free,
    require_unchanged,
    storing,
)
from tuning.search_job import begun, search
from tuning.store import damaged_tiles


def run_job(file: Path, folder: Path, quiet: bool = False) -> Findings:
    """Run the job of a file in a folder of its own: search, held-out scenarios, analysis, report.

    InputError, before anything runs, for a job that has mistakes and a folder that is in use; later where there is no
    room. On that, and on KeyboardInterrupt, what is done is kept, for `resume_job`.
    """
    require_free(folder)
    setup = read_setup(file, file.resolve().parent, quiet)
    with storing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with locked(folder):
            require_free(folder)
            begin(folder, file, setup.job.seed, setup.inputs)
            return _work(folder, setup, quiet)


def resume_job(folder: Path, quiet: bool = False) -> Findings:
    """Go on with a job that was ended in any way; the findings are the same as if it had not been."""
    environment = environment_of(folder)
    with storing(folder), locked(folder):
        setup = _reread(folder, quiet)
        for difference in differing_versions(environment):
            note(f"adwa: {difference} since the job began; last bits of new figures may differ")
            Log(folder).write("version", difference=difference)
        return _work(folder, setup, quiet)


def report_job(folder: Path, quiet: bool = False) -> Findings:
    """Analyse and report anew what is done."""
    setup = _reread(folder, quiet)
    with storing(folder), locked(folder):
        findings = conclude(folder, setup, environment_of(folder))
        damaged = sum(damaged_tiles(folder / name) for name in (TRAINING, HELD_OUT) if (folder / name).exists())
        if damaged:
            note(f"adwa: {damaged} damaged tiles are left out; to drive them anew: adwa tune resume {folder}")
        return findings


def open_job(folder: str | Path) -> FinishedJob:
    """The job in a folder, to be looked at; nothing is driven or written. InputError where there is none."""
    return finished(Path(folder), _reread(Path(folder), quiet=True))


def read_setup(file: Path, home: Path, quiet: bool = False) -> Setup:
    """A job file and its suites, whole; home: the folder that its paths are relative to.

    InputError for all that would be refused when it runs.
    """
    job = load_job(file, home)
    with progress_bar("making scenarios", quiet) as progress:
        setup = set_up(job, file, home, quiet, progress)
    begun(setup, file)
    return setup


def _reread(folder: Path, quiet: bool) -> Setup:
    """The setup of a job that has begun; InputError if its files have changed since."""
    environment = environment_of(folder)
    setup = read_setup(folder / JOB, home_of(environment), quiet)
    require_unchanged(folder, environment["inputs"], setup.inputs)
    return setup


def _work(folder: Path, setup: Setup, quiet: bool) -> Findings:
    log, began = Log(folder), time.perf_counter()
    log.write("begin", pid=os.getpid(), scenarios=len(setup.training.scenarios), budget=setup.job.method.episodes)
    search(folder, setup, log, quiet)
    drive_held_out(folder, setup, log, quiet)
    findings = conclude(folder, setup, environment_of(folder))
    log.write("end", seconds=round(time.perf_counter() - began, 3))
    return findings
