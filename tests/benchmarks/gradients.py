"""Whether the relaxed loss has a finite gradient everywhere: 10,000 random pairs of a moment and of constants.

    python -m tests.benchmarks.gradients [paper|extended] [pairs]
"""

import sys
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.constants import Options
from adwa_jax.presets import PRESETS
from adwa_jax.relaxed import Softness
from adwa_jax.relaxed_drive import Loss, OnTheWay, Stretch, stretch_loss
from scenarios.suite import make_suite
from tuning.space import Parameter, Space
from tuning.surrogate import Look, Recorded, record

STRETCH = Stretch(4, 4, "smooth")
NAMES = ("local_heading", "clearance", "velocity", "global_heading", "progress", "on_route", "contact_time",
         "mover_clearance", "forward")  # fmt: skip


def main(preset: str = "paper", pairs: int = 10_000) -> None:
    """Print how many gradients are finite; rows of 32 tasks with 4 moments each."""
    config = PRESETS[preset]()
    small = replace(config.options.dwa, v_samples=4, yaw_rate_samples=5, horizon_steps=6)
    base = config._replace(options=replace(config.options, dwa=small))
    space = Space((Parameter("clearance", 0.0, 1.0),), base)
    scenarios = make_suite("paper-15", 900, 64).scenarios
    rows = record(space, np.array([[0.3]]), scenarios, Look(STRETCH, 4, 40))
    random, seen, finite = np.random.default_rng(0), 0, 0
    while seen < pairs:
        part = rows[random.integers(len(rows))]
        checked = np.asarray(_finite(part.task, _moved(part, random), _weights(random), _softness(random),
                                     part.program.options))  # fmt: skip
        seen, finite = seen + checked.size, finite + int(checked.sum())
    print(f"{preset}: {finite} of {seen} gradients finite")


def _weights(random: np.random.Generator) -> np.ndarray:
    """[32, 4, 9], a third of them 0 and the rest from 1e-4 to 10."""
    drawn = 10.0 ** random.uniform(-4, 1, (32, 4, len(NAMES)))
    return np.where(random.uniform(size=drawn.shape) < 1 / 3, 0.0, drawn).astype(np.float32)


def _softness(random: np.random.Generator) -> Softness:
    return Softness(jnp.float32(10.0 ** random.uniform(-3, 1)), jnp.float32(10.0 ** random.uniform(-3, 0)))


def _moved(part: Recorded, random: np.random.Generator) -> OnTheWay:
    """The moments with the robot somewhere near, in obstacles too, running again."""
    shape, robot = (32, 4), part.way.state.robot
    robot = robot._replace(
        x=robot.x + random.normal(0, 0.5, shape).astype(np.float32),
        y=robot.y + random.normal(0, 0.5, shape).astype(np.float32),
        heading=random.uniform(-3.1, 3.1, shape).astype(np.float32),
    )
    return part.way._replace(state=part.way.state._replace(robot=robot, outcome=np.full(shape, -1, np.int32)))


@partial(jax.jit, static_argnames="options")
def _finite(task, way: OnTheWay, weights: jax.Array, softness: Softness, options: Options) -> jax.Array:
    """[32, 4] bool."""

    def one(task, start: OnTheWay, row: jax.Array) -> jax.Array:
        def loss(row: jax.Array, behaviour) -> jax.Array:
            values = {name: row[index] for index, name in enumerate(NAMES)}
            constants = replace(task.constants, weights=replace(task.constants.weights, **values), behaviour=behaviour)
            return stretch_loss(start, task.scenario, task.plan, constants, softness, Loss(), options, STRETCH)[0]

        value, slopes = jax.value_and_grad(loss, (0, 1))(row, task.constants.behaviour)
        return jnp.all(jnp.stack([jnp.all(jnp.isfinite(leaf)) for leaf in jax.tree.leaves((value, slopes))]))

    return jax.vmap(lambda task, way, rows: jax.vmap(lambda start, row: one(task, start, row))(way, rows))(
        task, way, weights)  # fmt: skip


if __name__ == "__main__":
    main((sys.argv[1:2] or ["paper"])[0], int((sys.argv[2:3] or [10_000])[0]))
