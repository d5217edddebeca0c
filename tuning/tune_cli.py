"""The commands `adwa tune`: check, run, resume, status, report."""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path
from typing import Annotated, Any

import typer

from tuning.console import note
from tuning.findings import Findings
from tuning.job_folder import JOB, environment_of, events_of, holder, home_of
from tuning.options import QuietOption
from tuning.outputs import check_folder
from tuning.start import INTERRUPTED

tune_app = typer.Typer(help="Tune constants: jobs that go on after a kill and end in a report.")
JobArgument = Annotated[Path, typer.Argument(metavar="JOB", help="The job file, TOML.")]
FolderArgument = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a job.")]
TOLD = {"generation": {"generation": int, "spent": int, "best": dict}, "block": {"seconds": float, "episodes": int}}
RECENT = 20  # blocks of episodes, by which speed is told


@tune_app.command("check")
def check_command(job: JobArgument, quiet: QuietOption = False) -> None:
    """Check a job file whole, its suites included, and run nothing."""
    from tuning.job_checks import remarks_of
    from tuning.run_job import read_setup

    setup = read_setup(job, job.resolve().parent, quiet)
    if not quiet:
        print("".join(f"{job}: {remark}\n" for remark in remarks_of(setup.space)), end="")
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
    from tuning.run_job import run_job

    check_folder("--out", out)
    with _told_to_stop(out):
        findings = run_job(job, out, quiet)
    _tell(out, findings, quiet)


@tune_app.command("resume")
def resume_command(folder: FolderArgument, quiet: QuietOption = False) -> None:
    """Go on with a job that was ended; what is done is not done again."""
    from tuning.run_job import resume_job

    with _told_to_stop(folder):
        findings = resume_job(folder, quiet)
    _tell(folder, findings, quiet)


@tune_app.command("status")
def status_command(folder: FolderArgument) -> None:
    """How far a job is, the best so far, and the time left."""
    from tuning.job_file import load_job

    job = load_job(folder / JOB, home_of(environment_of(folder)))
    print("\n".join(status_lines(job.name, job.method.episodes, events_of(folder), holder(folder))))


@tune_app.command("report")
def report_command(folder: FolderArgument, quiet: QuietOption = False) -> None:
    """Write the report anew, of what is done."""
    from tuning.run_job import report_job

    _tell(folder, report_job(folder, quiet), quiet)


def status_lines(name: str, budget: int, events: list[dict[str, Any]], process: str | None) -> list[str]:
    """What the log of a job tells, for people."""
    generations = _whole(events, "generation")
    spent = generations[-1]["spent"] if generations else 0
    ended = bool(events) and events[-1]["event"] == "end"
    state = "finished" if ended else f"process {process} works on it" if process else "stopped"
    lines = [f"{name}: {state}; generation {generations[-1]['generation'] if generations else '–'}, "
             f"{spent} of at most {budget} episodes ({spent / budget:.0%})"]  # fmt: skip
    best = generations[-1]["best"] if generations else {}
    if {"objectives", "violation", "constants"} <= set(best):
        shown = [f"{label} {value:.4g}" for label, value in best["objectives"].items()]
        violated = f" (violates constraints by {best['violation']:.3g})" if best["violation"] else ""
        lines.append(f"best first objective: {', '.join(shown)}{violated}")
        lines.append("by " + ", ".join(f"{key} = {value:.4g}" for key, value in best["constants"].items()))
    blocks = _whole(events, "block")[-RECENT:]
    seconds = sum(block["seconds"] for block in blocks)
    searched = any(event["event"] == "searched" for event in events)
    if searched and not ended:
        lines.append("the search has ended; the held-out scenarios are driven")
    elif seconds and not ended:
        rate = sum(block["episodes"] for block in blocks) / seconds
        left = timedelta(seconds=round((budget - spent) / rate)) if rate else "unknown"
        lines.append(f"{rate:.0f} episodes a second; at most {left} left for the search")
    return lines


def _whole(events: list[dict[str, Any]], kind: str) -> list[dict[str, Any]]:
    """Events of a kind that have all that is told of them; a damaged log may hold others."""
    return [event for event in events if event["event"] == kind
            and all(isinstance(event.get(name), of) for name, of in TOLD[kind].items())]  # fmt: skip


def _tell(folder: Path, findings: Findings, quiet: bool) -> None:
    from tuning.conclude_job import RECOMMENDED, success_lines
    from tuning.report_summary import verdict

    if not quiet:
        print("\n".join(success_lines(findings)))
        print(f"better? {verdict(findings)}")
        print(f"wrote {folder / 'report.html'} and {folder / RECOMMENDED}")


@contextmanager
def _told_to_stop(folder: Path) -> Iterator[None]:
    """SIGTERM ends the work as Ctrl-C does, and a line says how to go on."""

    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    except KeyboardInterrupt:
        if (folder / JOB).exists():
            note(f"adwa: stopped; what is done is kept; go on with: adwa tune resume {folder}")
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(INTERRUPTED)  # a signal between two looks leaves threads at work, which the interpreter's end aborts
    finally:
        signal.signal(signal.SIGTERM, before)
