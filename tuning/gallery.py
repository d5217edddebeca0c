"""The failures of an evaluation, by cause, each with a picture of its last seconds."""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from adwa_jax.episode import Outcome
from adwa_jax.presets import Preset
from scenarios.drawing import FONT, figure_legend, new_figure
from scenarios.suite import Suite
from tuning.figures import disc_centres, driven_path, last_heading
from tuning.last_seconds import draw_last_seconds, step_of
from tuning.outputs import save_figure, write_whole
from tuning.replay import Replay, replay
from tuning.results import Results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SECONDS = 4.0  # [s] that are shown
SHORTLY = 2.0  # [s]: a mover that turned back no longer ago had just turned back
MOST_SHOWN = 12  # of a cause
COLUMNS = 4
Progress = Callable[[int, int], None]  # (failures looked at, of how many)


class Cause(Enum):
    """Why scenarios fail: a name for files, a heading, a sentence."""

    STANDING = ("standing_robot_hit", "Standing robot hit",
                "A mover ran into the robot while it stood, which no command of the last step could have avoided.")
    TURNED = ("mover_turned_back", "Mover turned back shortly before",
              f"The mover that was hit had turned back at the border of its ground in the last {SHORTLY:g} s; a robot "
              "that predicts constant velocities is surprised by that.")
    MOVING = ("moving_robot_hit", "Moving robot hit", "The robot drove and a mover touched it.")
    STUCK = ("stuck", "Stuck", "The robot stayed within a small circle for so long that it was given up.")
    UNKNOWN = ("hit_unknown", "Hit an unknown obstacle",
               "The robot touched an unknown square or disc, or a cell that its map did not hold.")
    KNOWN = ("hit_known", "Hit a known obstacle", "The robot touched an obstacle of its map, or the map's border.")
    TIMEOUT = ("timeout", "Out of time", "The robot was still under way when the time was over.")
    NO_PATH = ("no_path", "No path", "The planner found no path for the robot, which never drove.")

    @property
    def file(self) -> str:
        """Name of its picture, without the suffix."""
        return self.value[0]

    @property
    def heading(self) -> str:
        """In a few words."""
        return self.value[1]

    @property
    def sentence(self) -> str:
        """What happened."""
        return self.value[2]


BY_OUTCOME = {Outcome.STUCK: Cause.STUCK, Outcome.HIT_UNKNOWN: Cause.UNKNOWN, Outcome.HIT_KNOWN: Cause.KNOWN,
              Outcome.TIMEOUT: Cause.TIMEOUT, Outcome.NO_PATH: Cause.NO_PATH}  # fmt: skip


@dataclass
class Group:
    """The failures of one cause."""

    indices: list[int] = field(default_factory=list)  # in the suite
    shown: list[Replay] = field(default_factory=list)  # of the first `MOST_SHOWN`


def write_gallery(folder: Path, suite: Suite, results: Results, config: Preset, y_down: bool = False,
                  seconds: float = SECONDS, progress: Progress | None = None) -> list[Path]:
    """Write gallery.md and a picture for each cause that there is; returns their paths.

    results: of the suite under `config`. y_down: of the maps in pictures. seconds: how much of each end is shown [s].
    """
    groups = grouped(suite, results, config, progress)
    written = [save_figure(lambda cause=cause, group=group: sheet(cause, group, suite, seconds, y_down),
                           folder / f"{cause.file}.png") for cause, group in groups.items()]  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(folder / "gallery.md", _index(groups, suite, results, seconds))
    return [folder / "gallery.md", *written]


def grouped(suite: Suite, results: Results, config: Preset, progress: Progress | None = None) -> dict[Cause, Group]:
    """The failures by cause, in the order of `Cause`, in each the suite's order; causes without any are left out.

    Only what is shown, or needed to tell causes apart, is driven again.
    """
    groups = {cause: Group() for cause in Cause}
    failures = np.flatnonzero(~results.reached).tolist()
    for done, index in enumerate(failures, start=1):
        cause, driven = _looked_at(suite, results, index, config, groups)
        groups[cause].indices.append(index)
        if driven is not None and len(groups[cause].shown) < MOST_SHOWN:
            groups[cause].shown.append(driven)
        if progress:
            progress(done, len(failures))
    return {cause: group for cause, group in groups.items() if group.indices}


def cause_by_result(results: Results, index: int) -> Cause | None:
    """What the results alone tell; None for a moving robot's hit, of which two kinds are told apart."""
    outcome = Outcome(int(results.outcome[index]))
    if outcome != Outcome.HIT_MOVER:
        return BY_OUTCOME[outcome]
    return Cause.STANDING if results.measures["hit_while_stopped"][index] else None


def turned_back(driven: Replay) -> bool:
    """Whether the mover that was hit was mirrored at its box within the last `SHORTLY`."""
    mover, last = _touched(driven), int(driven.trace.length)
    if int(np.asarray(driven.scenario.movers.track_length)[mover]):
        return False
    first = max(last - 1 - round(SHORTLY / step_of(driven)), 0)
    velocity = np.asarray(driven.trace.movers.velocity)[first:last, mover]
    return bool((velocity[1:] * velocity[:-1] < 0).any())


def sheet(cause: Cause, group: Group, suite: Suite, seconds: float = SECONDS, y_down: bool = False) -> "Figure":
    """The last seconds of the failures shown, side by side."""
    count = len(group.shown)
    rows = ceil(count / COLUMNS)
    columns = ceil(count / rows)
    figure = new_figure((3.1 * columns + 1.0, 3.3 * rows + 1.2))
    tiles = figure.subplots(rows, columns, squeeze=False).ravel().tolist()
    shaded = None
    for tile, driven, index in zip(tiles, group.shown, group.indices, strict=False):
        title = f"{suite.names[index]}, {float(driven.episode.measures.time):.1f} s"
        shaded = draw_last_seconds(driven, tile, seconds, title, y_down) or shaded
    for tile in tiles[count:]:
        tile.set_axis_off()
    heading = f"{suite.name}: {cause.heading.lower()}, {count} of {len(group.indices)}"
    separator = "\n" if columns == 1 else " "
    figure.suptitle(f"{heading}{separator}(x and y in metres)", fontsize=FONT + 2)
    figure_legend(figure, tiles[:count])
    if shaded is not None:
        bar = figure.colorbar(shaded, ax=tiles, shrink=0.6, pad=0.01, extend="min")
        bar.set_label("time before the end [s]", fontsize=FONT)
        bar.ax.tick_params(labelsize=FONT - 1)
    return figure


def _looked_at(suite: Suite, results: Results, index: int, config: Preset,
               groups: dict[Cause, Group]) -> tuple[Cause, Replay | None]:
    """Why a scenario failed, and how it was driven, where that is needed."""
    cause = cause_by_result(results, index)
    if cause is not None and len(groups[cause].shown) >= MOST_SHOWN:
        return cause, None
    driven = replay(suite.scenarios[index], config)
    return cause or (Cause.TURNED if turned_back(driven) else Cause.MOVING), driven


def _touched(driven: Replay) -> int:
    """Index of the mover nearest to the robot's outline at the end."""
    row, movers = int(driven.trace.length) - 1, driven.scenario.movers
    radius = np.asarray(movers.radius)
    position = driven_path(driven.scenario, driven.trace)[-1]
    discs = disc_centres(position, last_heading(driven.scenario, driven.trace), driven.robot.disc_offsets)
    centres = np.asarray(driven.trace.movers.position)[row, : len(radius)]
    present = np.asarray(driven.trace.movers.present)[row, : len(radius)]
    apart = np.linalg.norm(centres[:, None] - discs[None], axis=2).min(axis=1) - radius
    return int(np.argmin(np.where(present, apart, np.inf)))


def _index(groups: dict[Cause, Group], suite: Suite, results: Results, seconds: float) -> str:
    failed = sum(len(group.indices) for group in groups.values())
    lines = [f"# Failures on {suite.name}: {failed} of {results.count} scenarios\n"]
    if groups:
        lines += [f"Pictures show the last {seconds:g} s: robot and movers have the same colour at the same time, dots "
                  "mark whole seconds,\narrows the way of the next second.\n", "| cause | scenarios | of all |",
                  "|---|--:|--:|"]  # fmt: skip
    lines += [f"| {cause.heading} | {len(group.indices)} | {len(group.indices) / results.count:.1%} |"
              for cause, group in groups.items()]  # fmt: skip
    for cause, group in groups.items():
        names = ", ".join(f"{suite.names[index]} (index {index})" for index in group.indices)
        lines += [f"\n## {cause.heading}\n", f"{cause.sentence}\n", f"![{cause.heading}]({cause.file}.png)\n", names]
    return "\n".join(lines).rstrip() + "\n"
