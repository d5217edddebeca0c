"""Tuned constants as parameters of Nav2's DWB controller, as far as the two planners agree.

DWB adds up critics that cost, this planner terms that please: a term's weight becomes the scale of the critic whose
cost falls as the term rises, both per metre or radian. Only the ratios of scales decide. Names and units are those of
`nav2_dwb_controller` (https://docs.nav2.org/configuration/packages/configuring-dwb-controller.html).
"""

import math

from adwa_jax.constants import Constants
from adwa_jax.presets import Preset

NOSE = 0.325  # forward_point_distance, DWB's own [m]: PathAlign and GoalAlign judge a point so far ahead of the robot
MAP_GRID = 0.5  # by which DWB multiplies the scale of critics that count metres on the costmap
LARGEST_COST = 252.0  # of a costmap's cell beside those in which the robot touches an obstacle
LEAST_SCALE = 1e-6  # of the critic that refuses collisions: DWB skips a critic whose scale is 0
DECAY = 3.0  # the inflated cost has fallen to e⁻³ = 5 % at the clearance cap

WINDOW = [
    "      # Candidates: the window of one control step, held over the predicted time (eq. 6). Exact.",
    '      trajectory_generator_name: "dwb_plugins::LimitedAccelGenerator"',
]
RAMPS = [
    "      # Candidates: approached within the limits as they are predicted, and commanded step by step. Approximate:",
    "      # DWB spreads its samples over all that can be reached in sim_time, this planner from rest to full speed.",
    '      trajectory_generator_name: "dwb_plugins::StandardTrajectoryGenerator"',
    "      limit_vel_cmd_in_traj: true",
]


def nav2_text(preset: Preset) -> str:
    """YAML for `controller_server` and the inflation of `local_costmap`, commented: what carries over and what not."""
    parts = (_header(preset), _server(preset), _limits(preset), _generator(preset), _critics(preset), _costmap(preset))
    return "\n".join(line for part in parts for line in part) + "\n"


def scales(preset: Preset) -> dict[str, float]:
    """Critic name -> scale; those whose term has no weight are left out.

    The weights are taken as if the terms were divided by fixed scales (`dwa.normalise`, "none"), also where the planner
    divides them by sums over the candidates: w / (the most a term can be) per metre, radian or step backward.
    """
    constants, rules = preset.constants, preset.options.rules
    weights = constants.weights
    farthest = float(constants.robot.v_max) * _horizon(preset)
    drive = float(weights.progress if rules.progress else weights.velocity)
    found = {
        "GoalDist": drive / farthest / MAP_GRID,
        "PathDist": float(weights.on_route) / farthest / MAP_GRID if rules.progress else 0.0,
        "PathAlign": float(weights.local_heading) / (math.pi * NOSE) / MAP_GRID,
        "GoalAlign": 0.0 if rules.progress else float(weights.global_heading) / (math.pi * NOSE) / MAP_GRID,
        _obstacle_critic(constants): max(float(weights.clearance) / LARGEST_COST, LEAST_SCALE),
        "PreferForward": float(weights.forward) if rules.reverse else 0.0,
    }
    return {name: scale for name, scale in found.items() if scale > 0.0}


def _obstacle_critic(constants: Constants) -> str:
    """A disc is judged by its centre's cell, any other robot by its outline."""
    return "BaseObstacle" if len(constants.robot.disc_offsets) == 1 else "ObstacleFootprint"


def _stride(preset: Preset) -> int:
    return preset.options.dwa.stride if preset.options.rules.ramp else 1


def _horizon(preset: Preset) -> float:
    """Predicted time [s]."""
    return float(preset.constants.behaviour.dt) * preset.options.dwa.horizon_steps * _stride(preset)


def _number(value: object) -> str:
    """Seven digits, as float32 has, always read back as a number with a decimal point."""
    text = f"{float(value):.7g}"  # pyright: ignore[reportArgumentType]
    if "e" in text:
        return f"{float(text):.12f}".rstrip("0")
    return text if "." in text else f"{text}.0"


def _header(preset: Preset) -> list[str]:
    ramp = preset.options.rules.ramp
    return [
        "# Nav2 parameters: merge into your own file, beside planner, costmap layers and sensors.",
        "#",
        "# Carried over exactly: velocity and acceleration limits, control period, predicted time and its steps, when",
        "#   the robot counts as stuck, the cost of backing up" + ("." if ramp else ", samples of speed and turn."),
        "# Approximate: all other scales (a term of this planner is larger where better, a critic's cost smaller; DWB",
        "#   counts Manhattan metres on the costmap), inflation in the place of clearance"
        + ("; how samples are spread." if ramp else "."),
        *_not_carried(preset),
        "# Try it in simulation before you rely on it.",
    ]


def _not_carried(preset: Preset) -> list[str]:
    rules = preset.options.rules
    missing = ["ω of eq. 5 and key points (Nav2 plans by its own planner)", "admissibility by braking distance"]
    missing += ["contact_time, mover_clearance and margins to movers (DWB predicts none)"] if rules.mover_terms else []
    missing += ["candidates that change their mind"] if rules.second_phase else []
    missing += ["the carrot (lookahead)"] if rules.carrot else []
    missing += ["static_margin"] if rules.stopping else []
    missing += ["replanning (see bt_navigator)"] if rules.replan else []
    return ["# Not carried over: " + missing[0] + ";", *(f"#   {text};" for text in missing[1:-1]),
            f"#   {missing[-1]}."]  # fmt: skip


def _server(preset: Preset) -> list[str]:
    behaviour = preset.constants.behaviour
    return [
        "controller_server:",
        "  ros__parameters:",
        f"    controller_frequency: {_number(1.0 / float(behaviour.dt))}  # exact: one decision every dt",
        '    progress_checker_plugins: ["progress_checker"]',
        "    progress_checker:  # exact: stuck_radius, stuck_time",
        '      plugin: "nav2_controller::SimpleProgressChecker"',
        f"      required_movement_radius: {_number(behaviour.stuck_radius)}",
        f"      movement_time_allowance: {_number(behaviour.stuck_time)}",
        '    controller_plugins: ["FollowPath"]',
        "    FollowPath:",
        '      plugin: "dwb_core::DWBLocalPlanner"',
    ]


def _limits(preset: Preset) -> list[str]:
    robot = preset.constants.robot
    fastest = max(float(robot.v_max), -float(robot.v_min))
    return [
        "      # Limits of the robot: exact. Slowing down is sampled with the same limits as speeding up.",
        f"      min_vel_x: {_number(robot.v_min)}",
        f"      max_vel_x: {_number(robot.v_max)}",
        "      min_vel_y: 0.0",
        "      max_vel_y: 0.0",
        f"      max_vel_theta: {_number(robot.yaw_rate_max)}",
        "      min_speed_xy: 0.0",
        f"      max_speed_xy: {_number(fastest)}",
        "      min_speed_theta: 0.0",
        f"      acc_lim_x: {_number(robot.acceleration)}",
        "      acc_lim_y: 0.0",
        f"      acc_lim_theta: {_number(robot.yaw_acceleration)}",
        f"      decel_lim_x: {_number(-float(robot.acceleration))}",
        "      decel_lim_y: 0.0",
        f"      decel_lim_theta: {_number(-float(robot.yaw_acceleration))}",
    ]


def _generator(preset: Preset) -> list[str]:
    dt, dwa = float(preset.constants.behaviour.dt), preset.options.dwa
    return [
        *(RAMPS if preset.options.rules.ramp else [*WINDOW, f"      sim_period: {_number(dt)}"]),
        f"      vx_samples: {dwa.v_samples}",
        "      vy_samples: 1",
        f"      vtheta_samples: {dwa.yaw_rate_samples}",
        "      # Exact.",
        f"      sim_time: {_number(_horizon(preset))}",
        "      discretize_by_time: true",
        f"      time_granularity: {_number(dt * _stride(preset))}",
    ]


def _critics(preset: Preset) -> list[str]:
    found = scales(preset)
    names = ", ".join(f'"{name}"' for name in found)
    lines = [
        "      # Approximate. Add RotateToGoal if the heading at the goal matters: here it does not.",
        f"      critics: [{names}]",
    ]
    for name, scale in found.items():
        lines += [f"      {name}:  # {_origin(name, preset)}", f"        scale: {_number(scale)}", *_further(name)]
    return lines


def _origin(name: str, preset: Preset) -> str:
    """Which constant a critic's scale comes from."""
    progress = preset.options.rules.progress
    return {
        "GoalDist": "from progress" if progress else "from velocity: DWB has no critic for speed; who is faster gets "
                                                     "nearer",
        "PathDist": "from on_route",
        "PathAlign": "from local_heading",
        "GoalAlign": "from global_heading",
        "BaseObstacle": "from clearance; costs at the last pose, where this planner takes the nearest",
        "ObstacleFootprint": "from clearance; needs the robot's footprint in the costmap",
        "PreferForward": "exact: from forward",
    }[name]  # fmt: skip


def _further(name: str) -> list[str]:
    """A critic's other parameters."""
    if name in ("PathAlign", "GoalAlign"):
        return [f"        forward_point_distance: {NOSE}"]
    if name == "PreferForward":
        return [f"        {key}" for key in ("penalty: 1.0", "strafe_x: 0.0", "strafe_theta: 0.0", "theta_scale: 0.0")]
    return []


def _costmap(preset: Preset) -> list[str]:
    robot, cap = preset.constants.robot, float(preset.constants.behaviour.clearance_cap)
    return [
        "local_costmap:",
        "  local_costmap:",
        "    ros__parameters:",
        *([f"      robot_radius: {_number(robot.radius)}  # exact"] if len(robot.disc_offsets) == 1 else []),
        "      inflation_layer:  # approximate: from clearance_cap; cost falls by 95 % from contact to there",
        '        plugin: "nav2_costmap_2d::InflationLayer"',
        f"        cost_scaling_factor: {_number(DECAY / cap)}",
        f"        inflation_radius: {_number(_reach(preset) + cap)}",
    ]


def _reach(preset: Preset) -> float:
    """From the robot's centre to its outline's farthest point, as the discs cover it [m]."""
    robot = preset.constants.robot
    return float(robot.radius) + max(abs(float(offset)) for offset in robot.disc_offsets)
