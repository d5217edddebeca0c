"""An ablation as tables, files and a picture."""

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich import box
from rich.table import Table

from adwa_jax.episode import Outcome
from scenarios.drawing import BLACK, BLUE, CELL_LINES, FONT, VERMILLION, figure_of, new_figure
from scenarios.suite import Suite
from tuning.ablate import EXTENDED, PAPER, REPEATS, TIMED, Row
from tuning.figures import Panels, panels_of
from tuning.outputs import save_figure, write_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEADINGS = ("configuration", "success", "95 %", "difference", "95 %", "other outcome", "failures", "time [s]",
            "length ratio", "µs a step")  # fmt: skip
LEGEND = f"""\
Every configuration drives the same scenarios. Differences are to `extended` for a planner without a rule, to `paper`
for the paper's with one rule and for `extended`.

- success: with its Wilson interval. difference: in success, in percentage points, with the interval for paired
  proportions (Newcombe 1998, method 10). other outcome: scenarios that ended otherwise than with the base.
- failures: by outcome, in brackets the hits of a standing robot.
- time, length ratio: mean difference over the scenarios that both reach, with its 95 % interval (Student's t). Length
  ratio: driven length over the shortest path's.
- µs a step: processor time of evaluating the first {TIMED} scenarios, planning included and compilation left out, over
  the control steps that they drove, which leave lanes idle towards the end. The least of {REPEATS} runs.
- A rule may need another to be of use: alone it can do nothing, or harm.
"""


def write_ablation(folder: Path, suite: Suite, rows: Sequence[Row]) -> list[Path]:
    """Write ablation.md, ablation.json and ablation.csv of the rows so far; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    records = [row.record() for row in rows]
    header = {"suite": suite.name, "recipe": suite.recipe, "count": len(suite.scenarios),
              "scenarios": list(suite.names), "outcome_codes": {outcome.name: int(outcome) for outcome in Outcome}}
    texts = {"ablation.md": _markdown(suite, rows), "ablation.csv": _csv(records),
             "ablation.json": json.dumps(header | {"rows": records}, indent=1) + "\n"}  # fmt: skip
    for name, text in texts.items():
        write_whole(folder / name, text)
    return [folder / name for name in texts]


def draw_ablation(folder: Path, suite: Suite, rows: Sequence[Row]) -> Path:
    """Write the picture ablation.png; returns its path."""
    return save_figure(lambda: ablation_figure(suite, rows), folder / "ablation.png")


def ablation_table(suite: Suite, rows: Sequence[Row]) -> Table:
    """One row a configuration, for the terminal."""
    title = f"{suite.name}: {len(suite.scenarios)} scenarios, each with every configuration"
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in HEADINGS:
        table.add_column(heading, justify="left" if heading in ("configuration", "failures") else "right", no_wrap=True)
    for row in rows:
        table.add_row(*_cells(row))
    return table


def row_sentence(row: Row) -> str:
    """What a row says, in a line."""
    name, success, interval, difference, its_interval, *_ = _cells(row)
    against = f", {difference} [{its_interval}] points to {row.configuration.base}" if row.base is not None else ""
    return f"{name}: {success} [{interval}]{against}"


def ablation_figure(suite: Suite, rows: Sequence[Row], axes: "Panels | None" = None) -> "Figure":
    """Paired difference in success a rule, with its interval: the rule added to the paper's planner, and taken from the
    extended. To the right of 0 the change raises success; a mark is filled where the interval leaves out 0. axes: 2.
    """
    rules = list(dict.fromkeys(row.configuration.rule for row in rows if row.configuration.rule))
    alone = axes is None
    size = (8.6, 0.32 * max(len(rules), 2) + 1.9)
    panels = panels_of(new_figure(size).subplots(1, 2, sharey=True) if axes is None else axes, 2)
    for ax, base, verb, style in zip(panels, (PAPER, EXTENDED), ("added to", "taken from"),
                                     ({"marker": "s", "color": BLUE}, {"marker": "o", "color": VERMILLION}),
                                     strict=True):  # fmt: skip
        chosen = [row for row in rows if row.configuration.rule and row.configuration.base == base]
        _draw_forest(chosen, rules, style, ax)
        ax.set_title(f"rule {verb} the {base} planner{_rate(rows, base)}".replace("paper ", "paper's "), fontsize=FONT)
    for ax in panels[:1] if alone else panels:
        ax.set_yticks(range(len(rules)), rules)
        ax.set_ylim(len(rules) - 0.4, -0.6)
    figure = figure_of(panels[0])
    if alone:
        figure.suptitle(f"{suite.name}, {len(suite.scenarios)} scenarios", fontsize=FONT + 1)
    return figure


def _draw_forest(rows: Sequence[Row], rules: list[str], style: dict[str, Any], ax: "Axes") -> None:
    for row in rows:
        difference = row.difference()
        if difference is None:
            continue
        mean, low, high = (100.0 * value for value in difference)
        place = rules.index(str(row.configuration.rule))
        apart = low > 0 or high < 0
        ax.hlines(place, low, high, color=style["color"], linewidth=1.6, zorder=2)
        ax.plot(mean, place, markersize=6, markerfacecolor=style["color"] if apart else "white", zorder=3, **style)
    ax.axvline(0.0, color=BLACK, linewidth=0.9, linestyle="--", zorder=1)
    for place in range(len(rules)):
        ax.axhline(place, color=CELL_LINES, linewidth=0.5, zorder=0)
    ax.set_xlabel("difference in success [percentage points], 95 %", fontsize=FONT)
    ax.tick_params(labelsize=FONT - 1)


def _rate(rows: Sequence[Row], name: str) -> str:
    """How often the base succeeds, if it is among the rows."""
    rates = [row.results.reached.mean() for row in rows if row.configuration.name == name]
    return f" ({100 * float(rates[0]):.1f} % success)" if rates else ""


def _markdown(suite: Suite, rows: Sequence[Row]) -> str:
    lines = [f"# What each rule does: {suite.name}, {len(suite.scenarios)} scenarios\n", LEGEND,
             "![Difference in success a rule](ablation.png)\n", f"| {' | '.join(HEADINGS)} |",
             "|---|" + "--:|" * 5 + "---|" + "--:|" * 3]  # fmt: skip
    lines += [f"| {' | '.join(_cells(row))} |" for row in rows]
    return "\n".join(lines) + f"\n\nRecipe: `{json.dumps(suite.recipe)}`\n"


def _csv(records: list[dict[str, Any]]) -> str:
    """Without the outcome of each scenario; the two ends of an interval in columns of their own."""
    flat = []
    for record in records:
        row: dict[str, Any] = {}
        for name, value in record.items():
            if name.endswith("_ci"):
                row |= dict(zip((f"{name}_low", f"{name}_high"), value or (None, None), strict=True))
            elif name != "outcome":
                row[name] = value
        flat.append(row)
    file = io.StringIO()
    writer = csv.DictWriter(file, fieldnames=list(flat[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    return file.getvalue()


def _cells(row: Row) -> list[str]:
    record = row.record()
    low, high = record["success_ci"]
    failures = {name: str(count) for name, count in row.results.outcomes().items() if count and name != "REACHED"}
    if "HIT_MOVER" in failures:
        failures["HIT_MOVER"] += f" ({record['hit_while_stopped']})"
    cost = record["microseconds_a_step"]
    return [
        row.configuration.name,
        f"{100 * record['success_rate']:.1f} %",
        f"{100 * low:.1f} … {100 * high:.1f}",
        *_difference(row.difference(), 100.0, 1),
        "–" if record["other_outcome"] is None else str(record["other_outcome"]),
        ", ".join(" ".join(failure) for failure in failures.items()) or "–",
        " ".join(_difference(row.mean_difference("time"), 1.0, 2)).strip(),
        " ".join(_difference(row.mean_difference("length_ratio"), 1.0, 3)).strip(),
        "–" if cost is None else f"{cost:.0f}",
    ]


def _difference(interval: tuple[float, float, float] | None, factor: float, digits: int) -> tuple[str, str]:
    """A difference with its sign, and its interval."""
    if interval is None:
        return "–", ""
    mean, low, high = (factor * value + 0.0 for value in interval)  # + 0.0: no −0
    return f"{mean:+.{digits}f}", f"{low:+.{digits}f} … {high:+.{digits}f}"
