"""The worst scenarios of one planner, each with a picture and a sentence that says why it failed."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from adwa_jax.presets import Preset
from scenarios.drawing import FONT, figure_of, legend_below, new_figure
from scenarios.suite import Suite
from tuning.evaluations import Evaluations
from tuning.figures import (
    Panels,
    drive_figure,
    drive_points,
    drive_sentence,
    legend_of,
    panels_of,
    used_map_size,
)
from tuning.gallery import SECONDS, Cause, cause_by_result, turned_back
from tuning.last_seconds import draw_last_seconds
from tuning.outputs import save_figure
from tuning.replay import Replay, replay
from tuning.results import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class FailurePicture(NamedTuple):
    """One scenario, drawn."""

    path: Path
    caption: str


def failure_pictures(suite: Suite, preset: Preset, results: Results, folder: Path, limit: int = 6,
                     y_down: bool = False) -> tuple[FailurePicture, ...]:
    """Drive the worst scenarios again and write a picture of each to the folder.

    results: of the suite under the preset. Failures come first, of every outcome one before a second of any; where
    there are fewer than `limit`, the longest detours among the successes follow.
    """
    return tuple(_pictured(suite, preset, results, index, folder, y_down) for index in worst(results)[:limit])


def worst_figure(suite: Suite, preset: Preset, results: Results, limit: int = 3, y_down: bool = False,
                 axes: "Panels | None" = None) -> "Figure":
    """Drive the worst scenarios again, as `failure_pictures`, and draw them side by side: of a failure the last
    seconds, of a success the whole way. axes: one a scenario, `limit` or as many as there are.
    """
    alone = axes is None
    shown = worst(results)[:limit]
    driven = [replay(suite.scenarios[index], preset) for index in shown]
    if axes is None:
        height = max(used_map_size(one.scenario.grid, drive_points(one.scenario, one.plan, one.trace), 4.4, 0.6)[1]
                     for one in driven)  # fmt: skip
        axes = new_figure((4.4 * len(shown), height)).subplots(1, len(shown), squeeze=False)
    panels = panels_of(axes, len(shown))
    shaded = None
    for ax, one, index in zip(panels, driven, shown, strict=True):
        if results.reached[index]:
            _whole_drive(one, suite.names[index], y_down, ax)
        else:
            shaded = _last_seconds(one, suite.names[index], y_down, ax) or shaded
    legend_of(panels, alone)
    figure = figure_of(panels[0])
    if shaded is not None:
        _time_bar(shaded, panels, figure)
    return figure


def results_of(evaluations: Evaluations, row: int, suite: Suite) -> Results:
    """What one candidate that has seen all scenarios of the suite did, in the form of an evaluation."""
    columns = {name: values[row] for name, values in evaluations.columns.items()}
    return Results(suite.name, suite.names, columns.pop("outcome"), columns)


def worst(results: Results) -> list[int]:
    """All scenarios by index, worst first."""
    seen: dict[int, int] = {}
    turn = []
    for index in np.flatnonzero(~results.reached).tolist():
        outcome = int(results.outcome[index])
        turn.append((seen.get(outcome, 0), index))
        seen[outcome] = seen.get(outcome, 0) + 1
    successes = np.flatnonzero(results.reached)
    ratio = "length_ratio" if "length_ratio" in results.measures else "planned_length_ratio"  # where nothing was driven
    detours = successes[np.argsort(-results.measures[ratio][successes], kind="stable")]
    return [index for _, index in sorted(turn)] + detours.tolist()


def _pictured(suite: Suite, preset: Preset, results: Results, index: int, folder: Path, y_down: bool) -> FailurePicture:
    driven, name = replay(suite.scenarios[index], preset), suite.names[index]
    if results.reached[index]:
        ratio = results.measures["length_ratio"][index]
        caption = f"{name}: a success, its way {ratio:.2f} times the shortest grid path."
        path = save_figure(lambda: _whole_drive(driven, name, y_down), folder / f"scenario_{index}.png")
        return FailurePicture(path, caption)
    cause = cause_by_result(results, index) or (Cause.TURNED if turned_back(driven) else Cause.MOVING)
    path = save_figure(lambda: _last_seconds_alone(driven, name, y_down), folder / f"scenario_{index}.png")
    return FailurePicture(path, f"{name}: {cause.heading.lower()}. {cause.sentence}")


def _whole_drive(driven: Replay, name: str, y_down: bool, ax: "Axes | None" = None) -> "Figure":
    return drive_figure(driven.scenario, driven.plan, driven.episode, driven.trace, title=name, ax=ax, y_down=y_down,
                        legend=ax is None, robot=driven.robot)  # fmt: skip


def _last_seconds_alone(driven: Replay, name: str, y_down: bool) -> "Figure":
    figure = new_figure((5.0, 6.0))
    ax = figure.subplots()
    shaded = _last_seconds(driven, name, y_down, ax)
    legend_below(ax)
    if shaded is not None:
        _time_bar(shaded, [ax], figure)
    return figure


def _last_seconds(driven: Replay, name: str, y_down: bool, ax: "Axes") -> Any:
    """Returns what the bar of time needs, or None."""
    shaded = draw_last_seconds(driven, ax, SECONDS, f"{name}: {drive_sentence(driven.plan, driven.episode)}", y_down)
    ax.set_xlabel("x [m]", fontsize=FONT)
    ax.set_ylabel("y [m]", fontsize=FONT)
    return shaded


def _time_bar(shaded: Any, axes: list["Axes"], figure: "Figure") -> None:
    bar = figure.colorbar(shaded, ax=axes, shrink=0.6, pad=0.02, extend="min")
    bar.set_label("time before the end [s]", fontsize=FONT)
    bar.ax.tick_params(labelsize=FONT - 1)
