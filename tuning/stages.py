"""What happens inside the planner on the way from a map to a command, kept for pictures.

Dimension letters: H, W map without its padding; V, N candidates; K predicted points; M movers.
"""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from adwa_jax.constants import Constants, Options
from adwa_jax.density import Density, obstacle_density
from adwa_jax.dwa import Decision, Guidance, decide
from adwa_jax.grid import DistanceField, Grid, Scalar, cell_of
from adwa_jax.heuristic_weight import weight_field
from adwa_jax.obstacles import Sensed, movers_at, predicted_centres, sense
from adwa_jax.presets import Preset
from adwa_jax.rollout import Pose, RobotState, rollout
from adwa_jax.rules import Rules
from adwa_jax.scenario import Scenario
from adwa_jax.score import ScoreWeights
from scenarios.errors import InputError
from scenarios.padding import pad, padded_shape
from tuning.compiled import keep_compiled
from tuning.replay import Replay

TERMS = {"local_heading": "α·LHeading", "clearance": "β·Dist", "velocity": "γ·Vel", "global_heading": "δ·GHeading"}
"""The terms of eq. 9, as the paper writes them."""


class Densities(NamedTuple):
    """Eqs. 2, 3 and 5 on one map."""

    local: np.ndarray  # [H, W] P, share of occupied cells in the rectangle from the cell to the goal
    overall: float  # Q, that of the map
    weight: np.ndarray  # [H, W] ω


class Moment(NamedTuple):
    """One decision of the paper's planner, with what it was taken from."""

    time: float  # since the start [s]
    robot: RobotState  # before the command
    target: np.ndarray  # [2] (x, y) of the local target [m]
    square_known: np.ndarray  # [S] bool
    movers: np.ndarray  # [1 + K, M, 2] (x, y) now and as predicted [m]; NaN where not seen
    v: np.ndarray  # [V] [m/s]
    yaw_rate: np.ndarray  # [N] [rad/s]
    arcs: np.ndarray  # [1 + K, V, N, 2] (x, y) from where the robot is [m]
    admissible: np.ndarray  # [V, N] bool
    score: np.ndarray  # [V, N], G of eq. 9; of no meaning where not admissible
    terms: dict[str, np.ndarray]  # [V, N] each by its name in eq. 9, weighted and normalised: their sum is the score
    chosen: tuple[int, int] | None  # (speed, yaw rate); None: nothing was admissible, the robot brakes


class Situation(NamedTuple):
    """What one decision is taken from."""

    scenario: Scenario  # padded
    field: DistanceField
    robot: RobotState
    known: np.ndarray  # [S] bool
    target: np.ndarray  # [2] (x, y) [m]
    time: jax.Array  # since the start [s]


def densities(scenario: Scenario, config: Preset) -> Densities:
    """Density and ω for every cell of the scenario's map, as the planner sees them. Unbatched."""
    grid = jax.tree.map(jnp.asarray, scenario.grid)
    density, weight = jax.device_get(_densities(grid, scenario.start[:2], scenario.goal, config.constants,
                                                config.options))  # fmt: skip
    rows, columns = int(scenario.grid.height), int(scenario.grid.width)
    local = (density.obstacles / density.cells)[:rows, :columns]
    return Densities(local, float(density.map_obstacles / density.map_cells), weight[:rows, :columns])


def moment(driven: Replay, config: Preset, step: int) -> Moment:
    """The decision of control step `step`, counted from 0, of a drive by the paper's planner.

    config: that of the drive. Raises InputError as `situation_at` does.
    """
    here, constants = situation_at(driven, config, step), jax.tree.map(np.float32, config.constants)
    return _on_host(here, jax.device_get(_decided(here, constants, config.options)))


def situation_at(driven: Replay, config: Preset, step: int) -> Situation:
    """What control step `step`, counted from 0, of a drive by the paper's planner decided on.

    config: that of the drive. Raises InputError for a step that was not driven, for a planner with rules beyond the
    paper and for hidden cells.
    """
    last = int(driven.trace.length) - 1
    if not 0 <= step <= last:
        raise InputError(f"step: {step}; must be one that was driven, 0..{last}; choose one of them")
    if config.options.rules != Rules() or np.size(driven.scenario.hidden):
        raise InputError("moment: a planner with rules beyond the paper, or a scenario with hidden cells; what it "
                         "knows is not kept; drive with `paper` on a known map")  # fmt: skip
    keep_compiled()
    dt = jnp.float32(config.constants.behaviour.dt)
    robot, known = _before(driven, step, dt)
    scenario = pad(driven.scenario, padded_shape(driven.scenario))
    return Situation(scenario, driven.plan.field, robot, known, np.asarray(driven.trace.target)[step], step * dt)


def sensed_at(here: Situation, constants: Constants) -> Sensed:
    """What the robot senses. Unbatched."""
    scenario = here.scenario
    return sense(scenario.squares, jnp.asarray(here.known), scenario.movers, movers_at(scenario.movers, here.time),
                 jnp.stack([here.robot.x, here.robot.y]), constants.behaviour.sensor_range)  # fmt: skip


def _before(driven: Replay, step: int, dt: Scalar) -> tuple[RobotState, np.ndarray]:
    """The robot and the squares known before control step `step`."""
    trace = driven.trace
    if step:
        return jax.tree.map(lambda values: values[step - 1], trace.robot), np.asarray(trace.known)[step - 1]
    first = jax.tree.map(lambda values: values[0], trace.robot)
    x, y, _ = np.asarray(driven.scenario.start, np.float32)
    still = np.zeros_like(x)
    begin = RobotState(x, y, first.heading - first.yaw_rate * dt, still, still)
    return begin, np.zeros_like(np.asarray(trace.known)[0])


class _Decided(NamedTuple):
    sensed: Sensed
    ahead: jax.Array  # [K, M, 2]
    decision: Decision
    arcs: Pose  # [K, V, N]
    terms: jax.Array  # [4, V, N]


@partial(jax.jit, static_argnames="options")
def _densities(grid: Grid, start: jax.Array, goal: jax.Array, constants: Constants,
               options: Options) -> tuple[Density, jax.Array]:
    start_cell, goal_cell = cell_of(grid, start), cell_of(grid, goal)
    density = obstacle_density(grid, goal_cell)
    if options.plan.scope == "one":
        return density, jnp.ones(grid.occupied.shape, jnp.float32)
    return density, weight_field(grid, start_cell, goal_cell, constants.weight_rule, options.plan.scope)


@partial(jax.jit, static_argnames="options")
def _decided(here: Situation, constants: Constants, options: Options) -> _Decided:
    """The steps of `control_step` up to the decision."""
    dt, steps, robot = constants.behaviour.dt, options.dwa.horizon_steps, here.robot
    sensed = sensed_at(here, constants)

    def decided(weights: ScoreWeights) -> Decision:
        guidance = Guidance(jnp.asarray(here.target), jnp.asarray(here.scenario.goal))
        return decide(robot, guidance, here.field, sensed, replace(constants, weights=weights), options)

    def term(chosen: jax.Array) -> jax.Array:
        """The score is linear in the weights: with one of them alone it is that one's term. chosen: [4], 1 and 0s."""
        alone = {name: getattr(constants.weights, name) * chosen[place] for place, name in enumerate(TERMS)}
        return decided(ScoreWeights(**alone)).candidates.score

    found = decided(constants.weights)
    pose = Pose(robot.x, robot.y, robot.heading)
    return _Decided(
        sensed=sensed,
        ahead=jax.vmap(lambda step: predicted_centres(sensed, step * dt))(jnp.arange(1.0, steps + 1.0)),
        decision=found,
        arcs=rollout(pose, found.candidates.v, found.candidates.yaw_rate, dt, steps),
        terms=jax.vmap(term)(jnp.eye(len(TERMS))),
    )


def _on_host(here: Situation, found: _Decided) -> Moment:
    robot, candidates, sensed, index = here.robot, found.decision.candidates, found.sensed, int(found.decision.index)
    v, yaw_rate, admissible, score, known = map(np.asarray, (candidates.v, candidates.yaw_rate, candidates.admissible,
                                                             candidates.score, sensed.square_known))  # fmt: skip
    arcs = np.stack([found.arcs.x, found.arcs.y], axis=-1)
    place = np.broadcast_to(np.array([robot.x, robot.y], np.float32), arcs[:1].shape)
    movers = np.concatenate([sensed.position[None], found.ahead])
    return Moment(
        time=float(here.time), robot=robot, target=here.target, square_known=known,
        movers=np.where(sensed.seen[:, None], movers, np.float32(np.nan)),
        v=v, yaw_rate=yaw_rate, arcs=np.concatenate([place, arcs]),
        admissible=admissible, score=score,
        terms=dict(zip(TERMS.values(), np.asarray(found.terms), strict=True)),
        chosen=divmod(index, len(yaw_rate)) if index >= 0 else None,
    )  # fmt: skip
