"""The report of a tuning job: one HTML file that needs nothing beside it and no network."""

import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from tuning import report_figures as figures
from tuning import report_html as html
from tuning import report_interactive as interactive
from tuning import report_summary as summary
from tuning.evaluations import Evaluations
from tuning.failures import FailurePicture
from tuning.findings import Findings
from tuning.outputs import write_whole

NAME = "report.html"
JOB_FILE = "job.toml"
NO_PLOTLY = ("The same with axes to choose and constants under the mouse needs plotly, which the extra `report` "
             "installs: pip install 'adwa-jax[report]'.")  # fmt: skip


def write_report(folder: Path, job: Any, findings: Findings, training: Evaluations, held_out: Evaluations | None,
                 held_out_rows: np.ndarray, remembered: Mapping[str, Mapping[str, np.ndarray]],
                 environment: Mapping[str, Any], gallery: Sequence[FailurePicture] = ()) -> Path:
    """Write report.html into the job's folder; returns its path.

    job: the job file's model, of which `name` and `model_dump` are used; its text is read from the folder where it is
    there. held_out_rows: [W] the row of `training` that each candidate of `held_out` is. remembered: what the method
    kept, by key; `agreement` is drawn. environment: versions and the like, by name. gallery: of `failure_pictures`.
    """
    fields = job.model_dump(mode="json")
    plot, scripts = interactive.interactive_front(findings, training) if interactive.available() else ("", "")
    sections = {
        "Summary": _summary(fields, findings, training),
        "Front": _front(findings, training, plot),
        "Choice": summary.choices_table(findings),
        "Trade-offs": _parallel(findings),
        "Sweeps": _sweeps(findings, training),
        "Progress": _progress(findings),
        "Importance": _importance(findings),
        "Training and held-out": _optimism(findings, held_out, held_out_rows),
        "Failures": _failures(gallery),
        "Gradients": _gradients(findings, remembered.get("agreement")),
        "Settings and provenance": _provenance(folder, fields, environment),
    }
    write_whole(folder / NAME, _page(f"Tuning report: {job.name}", sections, scripts))
    return folder / NAME


def _page(title: str, sections: Mapping[str, str], scripts: str) -> str:
    """Sections without content are left out."""
    present = {heading: part for heading, part in sections.items() if part}
    contents = "".join(f'<a href="#{_anchor(heading)}">{html.escape(heading)}</a> ' for heading in present)
    body = "\n".join(html.section(_anchor(heading), heading, part) for heading, part in present.items())
    template = Template((files("tuning") / "report_template.html").read_text(encoding="utf-8"))
    return template.substitute(title=html.escape(title), contents=contents, sections=body, scripts=scripts)


def _anchor(heading: str) -> str:
    return heading.lower().replace(" ", "-")


def _summary(fields: Mapping[str, Any], findings: Findings, training: Evaluations) -> str:
    return "\n".join([
        html.paragraph(summary.what_was_tuned(fields, findings, training)),
        html.verdict("Is it better? " + summary.verdict(findings)),
        summary.success_table(findings),
        summary.constants_table(findings),
        summary.objectives_table(findings),
        html.paragraph(summary.honest_reading(findings)),
    ])  # fmt: skip


def _front(findings: Findings, training: Evaluations, plot: str) -> str:
    picture = html.drawn(
        figures.front_figure(findings, training),
        f"Scatter plots of each pair of objectives: {len(findings.front)} members of the front, the default constants "
        "and the recommended ones; the table below holds the same.",
        "No member of the front is better than another in everything. Filled: training; hollow: the same constants on "
        "held-out scenarios. The view is that of the members; candidates beyond it are not shown.",
    )  # fmt: skip
    how = "Point at a candidate to see its constants; the lists choose the axes." if plot else NO_PLOTLY
    told = f'<div class="screen">{html.paragraph(how)}</div>'
    return "\n".join([picture, told, plot, html.folded("As a table", summary.front_table(findings))])


def _parallel(findings: Findings) -> str:
    return html.drawn(figures.parallel_figure(findings),
                      "Parallel coordinates of the front: a line a member through its constants and objectives.",
                      "Each line is a member of the front; what is good in one objective costs another.")  # fmt: skip


def _sweeps(findings: Findings, training: Evaluations) -> str:
    found = figures.sweeps(training)
    if not found:
        return ""
    names = ", ".join(training.parameters[sweep.parameter].replace("_", " ") for sweep in found)
    return html.drawn(figures.sweep_figure(findings.goals, training, found),
                      f"Curves of every objective against each of {names}, with 95 % intervals.",
                      "One constant varies, all others keep their defaults. Dashed: the default; shaded: 95 % "
                      "intervals, Wilson's for rates, else by bootstrap over the scenarios.")  # fmt: skip


def _progress(findings: Findings) -> str:
    curve, objectives = findings.hypervolume, findings.goals.objectives
    point = ", ".join(f"{figures.name_and_unit(statistic)} {figures.in_units(statistic, statistic.sign * value):.4g}"
                      for statistic, value in zip(objectives, curve.reference, strict=True))  # fmt: skip
    return html.drawn(figures.hypervolume_figure(curve),
                      f"Hypervolume against episodes, from {curve.value[0]:.3g} to {curve.value[-1]:.3g}.",
                      "How much of the objectives' space the candidates so far dominate, measured from the reference "
                      f"point {point}. A curve still rising at its end asks for a larger budget.")  # fmt: skip


def _importance(findings: Findings) -> str:
    return html.drawn(figures.importance_figure(findings),
                      "Heat map of how much each constant explains of each objective.",
                      "How much of an objective's variation over the candidates a constant explains by itself, in "
                      "percent. A column need not add up to 100: what constants explain that the search moved together "
                      "counts for each of them; what shows only in their interplay counts for none.")  # fmt: skip


def _optimism(findings: Findings, held_out: Evaluations | None, held_out_rows: np.ndarray) -> str:
    if held_out is None or figures.recommended(findings).held_out is None:
        return html.paragraph("Nothing was driven on held-out scenarios: how far training values flatter is not known.")
    picture = html.drawn(figures.optimism_figure(findings),
                         "Held-out against training value of the front, the default and the recommended constants.",
                         "On the dashed line both are equal; how far a point is off to the bad side is its optimism "
                         "gap. Bars: 95 % intervals.")  # fmt: skip
    return picture + "\n" + summary.outcomes_table(findings, held_out, held_out_rows)


def _failures(gallery: Sequence[FailurePicture]) -> str:
    if not gallery:
        return ""
    pictures = "\n".join(html.picture(shown.path.read_bytes(), shown.caption, shown.caption) for shown in gallery)
    heading = "The worst scenarios of the recommended constants: failures first, then the longest detours."
    return f'{html.paragraph(heading)}\n<div class="gallery">\n{pictures}\n</div>'


def _gradients(findings: Findings, agreement: Mapping[str, np.ndarray] | None) -> str:
    if agreement is None:
        return ""
    low, high = np.min(agreement["cosine"]), np.max(agreement["cosine"])
    picture = html.drawn(figures.agreement_figure(agreement),
                         f"Agreement of gradients at each start; cosines from {low:.2f} to {high:.2f}.",
                         "Gradient of the relaxed planner beside that of the real one, estimated by evolution "
                         "strategies. Cosine 1: the same direction; an interval that holds 0: the relaxed gradient "
                         "cannot be trusted there.")  # fmt: skip
    return picture + "\n" + html.folded("Both gradients", *_gradient_tables(findings.parameters, agreement))


def _gradient_tables(parameters: Sequence[str], agreement: Mapping[str, np.ndarray]) -> list[str]:
    titles = {"surrogate": "Relaxed planner, by start", "hard": "Real planner, by start"}
    return [html.table(title, ("start", *parameters), [(str(start), *(f"{value:.3g}" for value in row))
                       for start, row in enumerate(np.atleast_2d(agreement[key]), start=1)])
            for key, title in titles.items() if key in agreement]  # fmt: skip


def _provenance(folder: Path, fields: Mapping[str, Any], environment: Mapping[str, Any]) -> str:
    rows = [(name, str(value)) for name, value in _flat({"seed": fields.get("seed"), **environment})]
    file = folder / JOB_FILE
    text = file.read_text(encoding="utf-8") if file.is_file() else json.dumps(fields, indent=1, default=str)
    return "\n".join([html.table("Made with", ("what", "value"), rows), html.folded("Job file", html.listing(text))])


def _flat(facts: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Facts in facts by a dotted name."""
    for name, value in facts.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", value
