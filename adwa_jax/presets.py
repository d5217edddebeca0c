"""Every constant of the planner, in one place, faithful to the paper's text.

The text gives the thresholds 1.5 and 0.5 of eq. 5, the weights' step of 0.1 and the map sizes, and nothing else: the
other numbers are ours, each beside its reason.
"""

from dataclasses import replace
from math import ceil
from typing import NamedTuple

from adwa_jax.astar import SearchOptions
from adwa_jax.constants import Behaviour, Constants, DwaOptions, Options, PlanOptions
from adwa_jax.footprint import covering_discs
from adwa_jax.heuristic_weight import WeightRule
from adwa_jax.rules import EVERY_RULE, Rules
from adwa_jax.score import ScoreWeights
from adwa_jax.window import RobotLimits


class Preset(NamedTuple):
    """A planner ready to drive."""

    constants: Constants  # traced
    options: Options  # static


def paper() -> Preset:
    """The paper's method to the letter: eq. 5 by node, anchor key points, whole-horizon DWA, no replanning."""
    return Preset(
        constants=Constants(
            weight_rule=WeightRule(
                dense_base=0.5, dense_gain=0.5,  # ω from 0.5 to 0.83 where dense
                sparse_base=1.2, sparse_gain=0.6,  # ω from 1.2 to 1.5 where sparse
                dense_ratio=1.5, sparse_ratio=0.5,  # eq. 5
            ),  # fmt: skip
            weights=ScoreWeights(  # multiples of the paper's step of 0.1; the best of a few tried on other seeds
                local_heading=0.8, clearance=0.3, velocity=0.8, global_heading=0.1,
            ),  # fmt: skip
            robot=RobotLimits(  # a small indoor robot on maps of 1 m cells
                radius=0.25, v_min=0.0, v_max=1.0, yaw_rate_max=1.5, acceleration=2.0, yaw_acceleration=6.0,
                brake=2.0, yaw_brake=60.0,  # a disc that turns on the spot needs no room
            ),  # fmt: skip
            behaviour=Behaviour(
                dt=0.1,
                clearance_cap=0.5,  # two radii: more room than that is no safer
                clearance_margin=0.25,  # the robot's radius: it can drive along every key-point segment
                keypoint_tolerance=1.0,  # one cell of the paper's maps
                sensor_range=5.0,
                danger_clearance=0.1,  # a tenth of a cell, as for planned paths
                stuck_radius=0.25, stuck_time=15.0,
            ),  # fmt: skip
        ),
        options=Options(
            plan=PlanOptions(
                search=SearchOptions(corner_rule="never", heuristic="octile", stop_rule="popped"),
                scope="node",  # under `start` ω is always 1 for start and goal in opposite corners
                keypoint_rule="anchor",
            ),
            dwa=DwaOptions(v_samples=11, yaw_rate_samples=21, horizon_steps=20, normalisation="sum"),
        ),
    )


def preset(rules: Rules) -> Preset:
    """The paper's planner with some rules beyond it; a rule that is off leaves the paper's constants in force.

    Weights, margins and lookahead of the rules were found by a random search on 480 scenarios of `paper-25` and of its
    kind with discs, of seeds that no reported figure uses; the counts of candidates and steps were chosen by hand.
    """
    base = paper()
    constants, options = base.constants, base.options
    weights, behaviour, robot, dwa = constants.weights, constants.behaviour, constants.robot, options.dwa
    if rules.ramp:  # 1.6 s in steps of 0.2 s; a mind is changed after 0.4 s
        dwa = replace(dwa, v_samples=6, yaw_rate_samples=9, horizon_steps=8, stride=2, turn_step=2)
    if rules.long_watch:  # 3.2 s in all, 3 s without ramps
        dwa = replace(dwa, watch_beyond=8 if rules.ramp else 10)
    if rules.fixed_scale:
        dwa = replace(dwa, normalisation="none")
    if rules.reverse:
        robot = replace(robot, v_min=-0.5)
        weights = replace(weights, forward=0.03)
    if rules.stopping:
        behaviour = replace(behaviour, static_margin=0.02, clearance_cap=0.36)
    if rules.progress:
        weights = replace(weights, local_heading=0.53, clearance=0.1, progress=0.65, on_route=0.43)
    if rules.mover_terms:
        weights = replace(weights, contact_time=1.9, mover_clearance=0.4)
        behaviour = replace(behaviour, mover_cap=1.2)
    if rules.mover_margin:
        behaviour = replace(behaviour, mover_margin=0.1, mover_growth=0.01)
    if rules.carrot:  # far: the place that is in sight decides
        behaviour = replace(behaviour, lookahead=6.0)
    if rules.replan:  # 5 cm beyond the radius for the cells, 10 cm for shortcuts
        behaviour = replace(behaviour, clearance_margin=0.35, route_margin=0.05)
    plan = replace(options.plan, subdivision=10) if rules.fine_field else options.plan
    return Preset(
        constants=replace(constants, weights=weights, robot=robot, behaviour=behaviour),
        options=replace(options, plan=plan, dwa=dwa, rules=rules),
    )


def on_robot(config: Preset, robot: RobotLimits) -> Preset:
    """The same planner on another robot: what follows from its size and speed is set anew.

    Reverse is as the robot says; without `rules.reverse` it stands still at the slowest.
    """
    constants, options = config.constants, config.options
    behaviour, rules, dwa = constants.behaviour, options.rules, options.dwa
    keeps = behaviour.clearance_margin - constants.robot.radius  # what key-point segments keep beyond the outline
    lookahead = behaviour.lookahead * min(max(robot.v_max / constants.robot.v_max, 0.5), 2.0)
    halt = max(robot.v_max / robot.acceleration, robot.yaw_rate_max / robot.yaw_acceleration) / behaviour.dt
    return Preset(
        constants=replace(
            constants,
            robot=robot if rules.reverse else replace(robot, v_min=max(robot.v_min, 0.0)),
            behaviour=replace(behaviour, clearance_margin=robot.radius + keeps, lookahead=lookahead),
        ),
        options=replace(options, dwa=replace(dwa, halt_steps=ceil(halt - 1e-6) + 1)),
    )


def jackal(v_max: float = 2.0) -> RobotLimits:
    """Clearpath's Jackal, the robot of the BARN benchmark: 0.42 × 0.33 m, covered by two discs of radius 0.196 m.

    Its accelerations are ours, well below the 20 m/s² and 25 rad/s² that its driver allows.
    """
    radius, offsets = covering_discs(length=0.42, width=0.33, count=2)
    return RobotLimits(
        radius=radius, disc_offsets=offsets, v_min=-0.3, v_max=v_max, yaw_rate_max=1.57,
        acceleration=4.0, yaw_acceleration=8.0, brake=4.0, yaw_brake=8.0,
    )  # fmt: skip


def extended() -> Preset:
    """Every rule beyond the paper."""
    return preset(EVERY_RULE)


ROBOTS = {"disc": lambda: extended().constants.robot, "jackal": jackal}
PRESETS = {"paper": paper, "extended": extended}
