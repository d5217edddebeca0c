"""One scenario driven with its path kept, for pictures and animations."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.constants import Constants, Options
from adwa_jax.episode import Episode, Outcome
from adwa_jax.lanes import Trace, trace
from adwa_jax.plan import Plan, plan
from adwa_jax.presets import Preset
from adwa_jax.scenario import Scenario
from adwa_jax.window import RobotLimits
from scenarios.padding import pad
from tuning.engine import driven_columns, program_of
from tuning.outputs import names_as_they_are, parent_made, save_figure
from tuning.plans_ahead import planned_columns

LEAST_STEPS = 256  # control steps that are kept; doubled until they cover the time limit, so that few programs do


@dataclass(frozen=True)
class Replay:
    """A driven scenario on the host."""

    scenario: Scenario
    plan: Plan
    episode: Episode
    trace: Trace
    robot: RobotLimits

    @property
    def outcome(self) -> Outcome:
        """How it ended."""
        return Outcome(int(self.episode.outcome))

    def summary(self) -> dict[str, Any]:
        """Outcome, measures and the driven path [[x, y], ...] [m], start included."""
        episode, used = self.episode, int(self.trace.length)
        columns = {**planned_columns(self.plan), **driven_columns(episode)}
        del columns["outcome"]  # named below
        row = {name: np.asarray(value).item() for name, value in columns.items()}
        path = np.stack([self.trace.robot.x[:used], self.trace.robot.y[:used]], axis=-1)
        path = np.concatenate([np.asarray(self.scenario.start)[None, :2], path])
        return {"outcome": self.outcome.name, **row, "driven_path": np.round(path, 4).tolist()}

    def sentence(self) -> str:
        """What happened, in a line."""
        measures = self.episode.measures
        return (f"{self.outcome.name} after {float(measures.time):.1f} s and {float(measures.length):.2f} m "
                f"(shortest {float(self.plan.optimal_length):.2f} m), "
                f"least clearance {float(measures.least_clearance):.2f} m")  # fmt: skip


def replay(scenario: Scenario, config: Preset) -> Replay:
    """Plan and drive one scenario, keeping the path."""
    constants = jax.tree.map(np.float32, config.constants)
    program = program_of(scenario, constants, config.options)
    last_step = int(np.round(scenario.time_limit / constants.behaviour.dt))  # in float32, as the episode counts
    steps = max(LEAST_STEPS, 1 << (last_step - 1).bit_length())
    padded = pad(scenario, program.shape)
    planned, episode, path = jax.device_get(_replay(padded, constants, program.options, steps))
    return Replay(scenario, planned, episode, path, constants.robot)


@partial(jax.jit, static_argnames=("options", "steps"))
def _replay(scenario: Scenario, constants: Constants, options: Options, steps: int) -> tuple[Plan, Episode, Trace]:
    """The same arithmetic as `evaluate`, hence the same bits and outcome."""
    lanes = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], scenario)
    planned = jax.lax.map(lambda one: plan(one.grid, one.start[:2], one.goal, constants, options.plan), lanes)
    planned = jax.tree.map(lambda leaf: leaf[0], planned)
    return planned, *trace(scenario, planned, constants, options, steps)


def draw_replay(driven: Replay, title: str, figure: Path, animation: Path | None = None, y_down: bool = False,
                progress: Callable[[int, int], None] | None = None) -> list[Path]:
    """Write the picture (as Fig. 4) and, if asked for, the animation; returns the files written.

    Raises InputError for an animation that is no .gif or .mp4, and for .mp4 without ffmpeg.
    """
    from tuning.animation import animate_drive
    from tuning.figures import drive_figure

    parts = (driven.scenario, driven.plan, driven.episode, driven.trace)
    save_figure(lambda: drive_figure(*parts, title=title, y_down=y_down, robot=driven.robot), figure)
    if animation is None:
        return [figure]
    with names_as_they_are():
        animate_drive(parent_made(animation), *parts, title=title, y_down=y_down, robot=driven.robot,
                      progress=progress)
    return [figure, animation]
