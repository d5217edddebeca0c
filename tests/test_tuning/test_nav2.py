import math
from dataclasses import replace

import pytest
import yaml

from adwa_jax.presets import Preset, extended, jackal, on_robot, paper
from tuning.nav2 import nav2_text, scales
from tuning.space import with_constants


def controller(preset):
    """Parameters of the controller server, and of its DWB plugin."""
    server = yaml.safe_load(nav2_text(preset))["controller_server"]["ros__parameters"]
    return server, server["FollowPath"]


def with_robot(preset, **limits):
    constants = preset.constants
    return Preset(replace(constants, robot=replace(constants.robot, **limits)), preset.options)


def test_limits_samples_and_horizon_of_the_paper_carry_over():
    server, dwb = controller(paper())
    assert server["controller_frequency"] == 10.0
    assert server["controller_plugins"] == ["FollowPath"]
    assert dwb["plugin"] == "dwb_core::DWBLocalPlanner"
    exact = {"min_vel_x": 0.0, "max_vel_x": 1.0, "max_vel_theta": 1.5, "acc_lim_x": 2.0, "decel_lim_x": -2.0,
             "acc_lim_theta": 6.0, "decel_lim_theta": -6.0, "vx_samples": 11, "vtheta_samples": 21, "sim_time": 2.0,
             "time_granularity": 0.1, "discretize_by_time": True, "sim_period": 0.1}  # fmt: skip
    assert {name: dwb[name] for name in exact} == exact
    assert dwb["trajectory_generator_name"] == "dwb_plugins::LimitedAccelGenerator"


def test_ramps_become_the_generator_that_ramps():
    _, dwb = controller(extended())
    assert dwb["trajectory_generator_name"] == "dwb_plugins::StandardTrajectoryGenerator"
    assert dwb["sim_time"] == pytest.approx(8 * 2 * 0.1)
    assert dwb["time_granularity"] == pytest.approx(0.2)
    assert "sim_period" not in dwb


def test_scales_of_the_papers_terms_by_hand():
    """α 0.8 and δ 0.1 over π rad of a point 0.325 m ahead, γ 0.8 over the 2 m of the horizon, twice for DWB's half;
    β 0.3 over the costs of a cell.
    """
    assert scales(paper()) == pytest.approx({
        "GoalDist": 0.8, "PathAlign": 1.6 / (math.pi * 0.325), "GoalAlign": 0.2 / (math.pi * 0.325),
        "BaseObstacle": 0.3 / 252.0,
    })  # fmt: skip


def test_scales_of_the_rules_beyond_the_paper_by_hand():
    """Horizon 1.6 m; the headings of one target only."""
    assert scales(extended()) == pytest.approx({
        "GoalDist": 2 * 0.65 / 1.6, "PathDist": 2 * 0.43 / 1.6, "PathAlign": 2 * 0.53 / (math.pi * 0.325),
        "BaseObstacle": 0.1 / 252.0, "PreferForward": 0.03,
    })  # fmt: skip


@pytest.mark.parametrize("preset", [paper(), extended(), on_robot(extended(), jackal())])
def test_every_critic_named_has_its_scale(preset):
    _, dwb = controller(preset)
    assert {name: dwb[name]["scale"] for name in dwb["critics"]} == pytest.approx(scales(preset), rel=1e-5)


def test_a_term_without_weight_has_no_critic_but_collisions_are_still_refused():
    preset = with_constants(paper(), {"global_heading": 0.0, "clearance": 0.0})
    _, dwb = controller(preset)
    assert dwb["critics"] == ["GoalDist", "PathAlign", "BaseObstacle"]
    assert 0.0 < dwb["BaseObstacle"]["scale"] <= 1e-6


def test_a_long_robot_is_judged_by_its_footprint():
    text = nav2_text(on_robot(extended(), jackal()))
    costmap = yaml.safe_load(text)["local_costmap"]["local_costmap"]["ros__parameters"]
    assert "ObstacleFootprint" in text
    assert "robot_radius" not in costmap
    robot = jackal()
    outline = float(robot.radius) + max(float(offset) for offset in robot.disc_offsets)
    assert costmap["inflation_layer"]["inflation_radius"] == pytest.approx(outline + 0.36)


def test_inflation_reaches_as_far_as_clearance_counts():
    costmap = yaml.safe_load(nav2_text(paper()))["local_costmap"]["local_costmap"]["ros__parameters"]
    assert costmap["robot_radius"] == 0.25
    assert costmap["inflation_layer"]["inflation_radius"] == pytest.approx(0.75)
    assert math.exp(-costmap["inflation_layer"]["cost_scaling_factor"] * 0.5) == pytest.approx(0.05, abs=0.001)


def test_every_number_is_read_as_one():
    """YAML 1.1 takes 1e-05 for a word, and ROS refuses a whole number where it was told a decimal one."""
    tiny = with_constants(with_robot(paper(), v_max=3.0, acceleration=1e-5), {"clearance": 1e-4})
    _, dwb = controller(tiny)
    assert isinstance(dwb["max_vel_x"], float)
    assert dwb["acc_lim_x"] == pytest.approx(1e-5)
    assert dwb["BaseObstacle"]["scale"] == pytest.approx(1e-6)
    assert isinstance(dwb["vx_samples"], int)


def test_comments_say_what_carries_over():
    ours, papers = nav2_text(extended()), nav2_text(paper())
    for words in ("# Carried over exactly:", "# Approximate:", "# Not carried over:", "eq. 5"):
        assert words in ours
        assert words in papers
    assert "contact_time" in ours
    assert "contact_time" not in papers
