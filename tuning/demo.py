"""A tuning job of a few minutes: what tuning gives, and what it costs, on the paper's 20 x 20 maps.

The extended planner solves nearly all of these maps as it is, so there is next to nothing to gain in success; but it
cuts close past obstacles. The job keeps the success and asks what else the paper counts can be had: the way's length,
its breaking points, its danger points. What can be gained on maps that are hard, a job on such maps shows.
"""

from collections.abc import Iterator
from pathlib import Path

from tuning.findings import Findings
from tuning.outputs import write_whole
from tuning.report import NAME
from tuning.report_figures import measure_name, recommended
from tuning.report_summary import SUCCESS, shown, shown_difference, verdict

JOB = """\
# Written by `adwa demo`; change it and run it again with `adwa tune run demo.toml --out FOLDER`.
name = "demo"
seed = {seed}

[planner]
preset = "extended"

[training]
suites = [{{suite = "paper-20", count = 96, seed = {training}}}]

[held_out]   # maps that the search never sees
suites = [{{suite = "paper-20", count = 256, seed = {held_out}}}]

[parameters]   # weights of the score, and how much room counts as enough [m]
clearance = {{low = 0.0, high = 0.6}}
progress = {{low = 0.2, high = 1.4}}
local_heading = {{low = 0.0, high = 1.0}}
on_route = {{low = 0.0, high = 1.0}}
mover_clearance = {{low = 0.1, high = 1.2, scale = "log"}}
contact_time = {{low = 0.5, high = 4.0, scale = "log"}}
clearance_cap = {{low = 0.15, high = 0.6}}

# Objectives: those of the paper's section 3.4, success, length ratio, breaking points, danger points.
[[constraints]]
measure = "success"
at_least = 0.97

[method]
name = "nsga3"
episodes = 6144
racing = true
population = 16

[choice]   # weights of the objectives, each in units of the front's range
rule = "weights"
weights = {{success = 2.0, length_ratio = 1.0, breaking_points = 1.0, danger_points = 1.0}}
"""


def run_demo(out: Path, seed: int = 0, quiet: bool = False) -> Findings:
    """Write the job file into `out`, run the job there, and print what it found."""
    from tuning.run_job import run_job  # builds on all of tuning

    out.mkdir(parents=True, exist_ok=True)
    file, folder = out / "demo.toml", out / "job"
    write_whole(file, JOB.format(seed=seed, training=2 * seed + 1, held_out=2 * seed + 2))
    findings = run_job(file, folder, quiet)
    if not quiet:
        print("\n".join(sentences(findings)))
        print(f"report: {folder / NAME}")
    return findings


def sentences(findings: Findings) -> Iterator[str]:
    """Recommended constants, success before and after on both suites, the other objectives, and the verdict."""
    best, default, compared = recommended(findings), findings.default, findings.compared
    yield "recommended constants (default):"
    for name, after, before in zip(findings.parameters, best.values, default.values, strict=True):
        yield f"  {name} = {after:.4g} ({before:.4g})"
    yield (f"success on {best.training.scenarios} training scenarios: {shown(SUCCESS, default.training.success)} "
           f"before, {shown(SUCCESS, best.training.success)} after")  # fmt: skip
    if best.held_out is not None and default.held_out is not None:
        yield (f"success on {best.held_out.scenarios} held-out scenarios: {shown(SUCCESS, default.held_out.success)} "
               f"before, {shown(SUCCESS, best.held_out.success)} after")  # fmt: skip
    if compared is not None:
        for statistic, change in zip(findings.goals.objectives, compared.objectives, strict=True):
            if statistic != SUCCESS:
                yield f"{measure_name(statistic)}, held out: {shown_difference(statistic, change)} by tuning"
    yield f"better? {verdict(findings)}"
