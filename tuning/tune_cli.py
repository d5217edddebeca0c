"""The commands `adwa tune`: check, run, resume, status, report."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tuning.console import note, progress_bar
from tuning.job_folder import (
    JOB,
    Log,
    begin,
    differing_versions,
    environment_of,
    events_of,
    holder,
    locked,
    require_free,
    require_unchanged,
    storing,
)
from tuning.options import QuietOption
from tuning.outputs import check_folder

if TYPE_CHECKING:  # brings much with it that other commands do not need
    from tuning.job_checks import Setup

tune_app = typer.Typer(help="Tune constants: jobs that go on after a kill and end in a report.")
JobArgument = Annotated[Path, typer.Argument(metavar="JOB", help="The job file, TOML.")]
FolderArgument = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a job.")]
RECENT = 20  # blocks of episodes, by which speed is told


@tune_app.command("check")
def check_command(job: JobArgument, quiet: QuietOption = False) -> None:
    """Check a job file whole, its suites included, and run nothing."""
    setup = _read(job, job.resolve().parent, quiet)
    if not quiet:
        counts = {"training scenarios": setup.training.scenarios, "held-out scenarios": setup.held_out.scenarios,
                  "parameters": setup.space.parameters, "objectives": setup.goals.objectives}  # fmt: skip
        print(f"{job}: {', '.join(f'{len(things)} {name}' for name, things in counts.items())}")


@tune_app.command("run")
def run_command(
    job: JobArgument,
    out: Annotated[Path, typer.Option(help="Folder for all that the job keeps and finds; a new one.")],
    quiet: QuietOption = False,
) -> None:
    """Run a job to its end."""
    check_folder("--out", out)
    require_free(out)
    setup = _read(job, job.resolve().parent, quiet)
    with storing(out):
        out.mkdir(parents=True, exist_ok=True)
        with locked(out):
            require_free(out)
            begin(out, job, setup.job.seed, setup.inputs)
            _work(out, setup, quiet)


@tune_app.command("resume")
def resume_command(folder: FolderArgument, quiet: QuietOption = False) -> None:
    """Go on with a job that was ended; what is done is not done again."""
    environment_of(folder)
    with storing(folder), locked(folder):
        setup = _reread(folder, quiet)
        for difference in differing_versions(environment_of(folder)):
            note(f"adwa: {difference} since the job began; last bits of new figures may differ")
            Log(folder).write("version", difference=difference)
        _work(folder, setup, quiet)


@tune_app.command("status")
def status_command(folder: FolderArgument) -> None:
    """How far a job is, the best so far, and the time left."""
    from tuning.job_file import load_job

    job = load_job(folder / JOB, _home(environment_of(folder)))
    print("\n".join(status_lines(job.name, job.method.episodes, events_of(folder), holder(folder))))


@tune_app.command("report")
def report_command(folder: FolderArgument, quiet: QuietOption = False) -> None:
    """Write the report anew, of what is done."""
    from tuning.run_job import write_findings

    setup = _reread(folder, quiet)
    with storing(folder):
        finished = write_findings(folder, setup, environment_of(folder))
    if not quiet:
        print(f"wrote {finished.report} and {finished.recommended}")


def status_lines(name: str, budget: int, events: list[dict[str, Any]], process: str | None) -> list[str]:
    """What the log of a job tells, for people."""
    generations = [event for event in events if event["event"] == "generation"]
    spent = generations[-1]["spent"] if generations else 0
    ended = bool(events) and events[-1]["event"] == "end"
    state = "finished" if ended else f"process {process} works on it" if process else "stopped"
    lines = [f"{name}: {state}; generation {generations[-1]['generation'] if generations else '–'}, "
             f"{spent} of at most {budget} episodes ({spent / budget:.0%})"]  # fmt: skip
    if generations and generations[-1]["best"]:
        best = generations[-1]["best"]
        shown = [f"{label} {value:.4g}" for label, value in best["objectives"].items()]
        violated = f" (violates constraints by {best['violation']:.3g})" if best["violation"] else ""
        lines.append(f"best first objective: {', '.join(shown)}{violated}")
        lines.append("by " + ", ".join(f"{key} = {value:.4g}" for key, value in best["constants"].items()))
    blocks = [event for event in events if event["event"] == "block"][-RECENT:]
    seconds = sum(block["seconds"] for block in blocks)
    if seconds and not ended:
        rate = sum(block["episodes"] for block in blocks) / seconds
        left = timedelta(seconds=round((budget - spent) / rate)) if rate else "unknown"
        lines.append(f"{rate:.0f} episodes a second; at most {left} left for the search")
    return lines


def _work(folder: Path, setup: "Setup", quiet: bool) -> None:
    """Run, and tell the end or, if it is interrupted, how to go on."""
    from tuning.run_job import run_job, success_lines

    try:
        with _termination_as_interrupt():
            finished = run_job(folder, setup, environment_of(folder), quiet)
    except KeyboardInterrupt:
        note(f"adwa: stopped; what is done is kept; go on with: adwa tune resume {folder}")
        raise
    if not quiet:
        print("\n".join(success_lines(finished.findings)))
        print(f"wrote {finished.report} and {finished.recommended}")


def _read(path: Path, home: Path, quiet: bool) -> "Setup":
    from tuning.job_checks import set_up
    from tuning.job_file import load_job

    job = load_job(path, home)
    with progress_bar("making scenarios", quiet) as progress:
        return set_up(job, path, home, quiet, progress)


def _reread(folder: Path, quiet: bool) -> "Setup":
    """The setup of a job that has begun; InputError if its files have changed since."""
    environment = environment_of(folder)
    setup = _read(folder / JOB, _home(environment), quiet)
    require_unchanged(folder, environment["inputs"], setup.inputs)
    return setup


def _home(environment: dict[str, Any]) -> Path:
    """The folder that the job file's paths are relative to."""
    return Path(environment["job_file"]).parent


@contextmanager
def _termination_as_interrupt() -> Iterator[None]:
    """SIGTERM ends the work as Ctrl-C does."""

    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
