"""A drive as a film: GIF by Pillow, MP4 by ffmpeg."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from adwa_jax.episode import Episode, Outcome
from adwa_jax.lanes import Trace
from adwa_jax.plan import Plan
from adwa_jax.scenario import Scenario
from adwa_jax.window import RobotLimits
from scenarios.drawing import (
    BLACK,
    BLUE,
    CELL_LINES,
    FONT,
    GREEN,
    OCCUPIED,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    draw_ends,
    draw_squares,
    figure_legend,
    new_figure,
)
from scenarios.errors import InputError
from tuning.figures import (
    COLLISIONS,
    SENTENCES,
    disc_centres,
    draw_hidden_cells,
    draw_last_route,
    draw_outline,
    draw_polyline,
    draw_used_map,
    drive_points,
    driven_path,
    driven_ways,
    prefixed,
    used_map_size,
)

MOST_FRAMES = 150
FRAME_RATE = 12.0  # pictures a second, at most
DPI = 90
LEGEND = 0.75  # [inch]
LAST_SHOWN = 2.0  # [s]
AHEAD = 1.0  # [s] of each mover's way that is drawn
Progress = Callable[[int, int], None]  # (pictures done, of how many)


def animate_drive(path: Path, scenario: Scenario, plan: Plan, episode: Episode, trace: Trace, title: str = "",
                  y_down: bool = False, robot: RobotLimits | None = None, speed: float = 4.0,
                  progress: Progress | None = None) -> Path:
    """Write the drive to a .gif, or to an .mp4 where ffmpeg is installed; returns the path. Unbatched.

    At most `MOST_FRAMES` pictures, `speed` times as fast as it was driven, the last one held. Squares fill when they
    are sensed, hidden cells are filled throughout where the drive saw them; a line shows each mover's way in the next
    second; a ring is the local target; the last route is there from the beginning. robot: drawn to scale. Raises
    InputError (a ValueError) as `check_writer`.
    """
    path = Path(path)
    check_writer(path)
    write = _write_gif if path.suffix.lower() == ".gif" else _write_mp4
    film = _Film(scenario, plan, episode, trace, title, y_down, robot)
    seconds = max(film.dt * film.steps, film.dt) / speed
    count = min(int(np.ceil(seconds * FRAME_RATE)), MOST_FRAMES, film.steps + 1)
    moments = np.unique(np.linspace(0, film.steps, max(count, 1)).round().astype(int)).tolist()
    write(path, film, moments, len(moments) / seconds, progress or (lambda done, of: None))
    return path


class _Film:
    """One picture, redrawn for each moment. Moment k is after k control steps."""

    def __init__(self, scenario: Scenario, plan: Plan, episode: Episode, trace: Trace, title: str, y_down: bool,
                 robot: RobotLimits | None):
        self.steps = int(trace.length)
        self.path, self.ways = driven_path(scenario, trace), driven_ways(scenario, trace)
        self.trace, self.valid = trace, np.asarray(scenario.squares.valid)
        self.dt = float(episode.measures.time) / self.steps if self.steps else 0.1
        self.outcome, self.title = Outcome(int(episode.outcome)), prefixed(title)
        self.start_heading = float(np.asarray(scenario.start)[2])
        points = drive_points(scenario, plan, trace)
        self.figure = new_figure(used_map_size(scenario.grid, points, legend=LEGEND))
        self.ax = draw_used_map(scenario.grid, points, self.figure.subplots(), y_down)
        self._draw_fixed(scenario, plan, episode)
        self._draw_moving(scenario, robot)
        figure_legend(self.figure, [self.ax])
        self.show(0)
        self.figure.set_dpi(DPI)
        for _ in range(2):  # the second knows how large the first has made the map
            self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")  # laid out before it moves, or the map would tremble

    def _draw_fixed(self, scenario: Scenario, plan: Plan, episode: Episode) -> None:
        draw_hidden_cells(scenario, self.trace, self.ax)
        draw_last_route(episode, self.trace, self.ax)
        draw_ends(scenario.start[:2], scenario.goal, self.ax)
        key_points = np.asarray(plan.key_points)[: int(plan.key_point_count)]
        if len(key_points):
            draw_polyline(key_points, self.ax, "--", "planned path")
        self.squares = draw_squares(scenario.squares, self.ax)
        if self.squares:
            self.squares[0].set_label("unknown, filled once sensed")

    def _draw_moving(self, scenario: Scenario, robot: RobotLimits | None) -> None:
        from matplotlib.patches import Circle

        ax = self.ax
        style: dict[str, Any] = {"edgecolor": BLACK, "linewidth": 0.8}
        radii = np.asarray(scenario.movers.radius)
        self.movers = [Circle((0, 0), float(size), facecolor=SKY, zorder=3.5, label="_" if index else "mover", **style)
                       for index, size in enumerate(radii)]  # fmt: skip
        self.ahead = [ax.plot([], [], color=BLUE, linewidth=1.2, zorder=3.4,
                              label="_" if index else f"its way, {AHEAD:g} s ahead")[0]
                      for index in range(len(radii))]  # fmt: skip
        (self.driven,) = ax.plot([], [], color=VERMILLION, linewidth=2.0, zorder=6, label="driven path")
        (self.target,) = ax.plot([], [], linestyle="none", marker="o", markersize=12, markerfacecolor="none",
                                 markeredgecolor=BLACK, zorder=7, label="local target")
        for disc in self.movers:
            ax.add_patch(disc)
        self.radius = float(robot.radius) if robot else 0.012 * max(np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim()))
        self.offsets = robot.disc_offsets if robot else (0.0,)
        self.robot = draw_outline(np.zeros((len(self.offsets), 2)), self.radius, ax, label="robot",
                                  facecolor=VERMILLION, **style)
        (self.nose,) = ax.plot([], [], color=BLACK, linewidth=1.5, zorder=9.1)
        (self.crash,) = ax.plot([], [], linestyle="none", marker="X", markersize=13, markerfacecolor=VERMILLION,
                                markeredgecolor=BLACK, zorder=10)

    def show(self, moment: int) -> None:
        """Redraw as it was after `moment` steps."""
        row = moment - 1
        self._show_squares(moment)
        self._show_movers(moment)
        self.driven.set_data(*self.path[: moment + 1].T)
        self._show_robot(self.path[moment], self._heading(moment))
        self.target.set_data(*(np.asarray(self.trace.target)[row][:, None] if moment else ([], [])))
        ended = moment == self.steps
        self.crash.set_data(*(self.path[-1][:, None] if ended and self.outcome in COLLISIONS else ([], [])))
        state = SENTENCES[self.outcome] if ended else "driving"
        self.ax.set_title(f"{self.title}{moment * self.dt:5.1f} s, {state}", fontsize=FONT)

    def _show_squares(self, moment: int) -> None:
        known = np.zeros(len(self.valid), bool)
        if moment:
            known = np.asarray(self.trace.known)[moment - 1][: len(self.valid)]
        for square, seen in zip(self.squares, known[self.valid], strict=True):
            square.set_facecolor(ORANGE if seen else "white")

    def _show_movers(self, moment: int) -> None:
        last = min(moment + max(round(AHEAD / self.dt), 1), len(self.ways) - 1)
        for index, (disc, line) in enumerate(zip(self.movers, self.ahead, strict=True)):
            centre = self.ways[moment, index]
            disc.set_visible(bool(np.isfinite(centre).all()))
            if disc.get_visible():
                disc.set_center(tuple(centre))
            line.set_data(*self.ways[moment : last + 1, index].T)

    def _show_robot(self, position: np.ndarray, heading: float) -> None:
        for disc, centre in zip(self.robot, disc_centres(position, heading, self.offsets), strict=True):
            disc.set_center(tuple(centre))
        reach = max(self.offsets) + 1.6 * self.radius
        tip = position + reach * np.array([np.cos(heading), np.sin(heading)])
        self.nose.set_data(*np.stack([position, tip]).T)

    def _heading(self, moment: int) -> float:
        """That of the start is not kept: the one a step later stands for it."""
        return float(np.asarray(self.trace.robot.heading)[max(moment - 1, 0)]) if self.steps else self.start_heading


def check_writer(path: Path) -> None:
    """Raises InputError unless an animation can be written to such a file: .gif, or .mp4 where ffmpeg is installed."""
    from matplotlib.animation import FFMpegWriter

    suffix = path.suffix.lower()
    if suffix not in (".gif", ".mp4"):
        raise InputError(f"{path}: suffix {suffix!r}; an animation is a .gif or an .mp4; rename it")
    if suffix == ".mp4" and not FFMpegWriter.isAvailable():
        raise InputError(f"{path}: .mp4 is written by ffmpeg, which is not on the PATH; install it or write a .gif")


def _write_gif(path: Path, film: _Film, moments: list[int], rate: float, progress: Progress) -> None:
    """All pictures in one palette, so that only what changes is stored anew."""
    from PIL import Image

    palette = Image.new("P", (1, 1))
    palette.putpalette(_palette())
    pictures = []
    for done, moment in enumerate(moments, start=1):
        pictures.append(_picture(film, moment).quantize(palette=palette, dither=Image.Dither.NONE))
        progress(done, len(moments))
    hundredths = round(100 / rate)  # GIF counts in these
    durations = [10 * max(hundredths, 2)] * (len(pictures) - 1) + [round(1000 * LAST_SHOWN)]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=durations, loop=0, optimize=False)


def _palette() -> list[int]:
    """R, G, B of the colours drawn with, of greys, and of blends with white and black for smooth edges."""
    from matplotlib.colors import to_rgb

    colours = [to_rgb(colour) for colour in (ORANGE, SKY, GREEN, BLUE, VERMILLION, PURPLE)]
    blends = [share * np.array(colour) + (1 - share) * ground
              for colour in colours for ground in (0.0, 1.0) for share in (1.0, 0.75, 0.5, 0.25)]  # fmt: skip
    greys = [np.full(3, level) for level in np.linspace(0, 1, 24)]
    exact = [np.array(to_rgb(colour)) for colour in (OCCUPIED, CELL_LINES)]
    return [round(255 * float(level)) for colour in (*blends, *greys, *exact) for level in colour]


def _picture(film: _Film, moment: int) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    film.show(moment)
    canvas = FigureCanvasAgg(film.figure)
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])


def _write_mp4(path: Path, film: _Film, moments: list[int], rate: float, progress: Progress) -> None:
    from matplotlib.animation import FFMpegWriter

    writer = FFMpegWriter(fps=max(round(rate), 1))
    with writer.saving(film.figure, str(path), DPI):
        for done, moment in enumerate(moments + moments[-1:] * round(LAST_SHOWN * writer.fps), start=1):
            film.show(moment)
            writer.grab_frame()
            progress(min(done, len(moments)), len(moments))
