"""Improved A* and improved Dynamic Window Approach as JAX kernels, in the paper's order.

Every kernel is written for one scenario (unbatched), is pure, and can be jitted and vmapped.
"""

from adwa_jax.grid import DistanceField, Grid, clearance_at, distance_field, inflate
from adwa_jax.density import Density, obstacle_density
from adwa_jax.heuristic_weight import WeightRule, heuristic_weight, weight_field
from adwa_jax.astar import SearchOptions, SearchResult, Status, search
from adwa_jax.keypoints import KeyPoints, key_points, segment_free, turning_points
from adwa_jax.window import RobotLimits, velocity_window
from adwa_jax.footprint import covering_discs
from adwa_jax.rollout import Pose, RobotState, euler_step, rollout
from adwa_jax.scenario import Movers, Scenario, UnknownSquares
from adwa_jax.obstacles import Sensed, movers_at, sense
from adwa_jax.score import ScoreWeights, Terms
from adwa_jax.rules import EVERY_RULE, RULE_NAMES, Rules
from adwa_jax.constants import Behaviour, Constants, DwaOptions, Options, PlanOptions
from adwa_jax.dwa import Candidates, Decision, Guidance, decide
from adwa_jax.metrics import Measures, PlannedMeasures
from adwa_jax.plan import Plan, plan
from adwa_jax.episode import Episode, Outcome
from adwa_jax.simulate import drive
from adwa_jax.lanes import Trace, drive_lanes, trace
from adwa_jax.presets import PRESETS, ROBOTS, Preset, extended, jackal, on_robot, paper, preset

__all__ = [  # in the order of the pipeline
    "DistanceField", "Grid", "clearance_at", "distance_field", "inflate",
    "Density", "obstacle_density",
    "WeightRule", "heuristic_weight", "weight_field",
    "SearchOptions", "SearchResult", "Status", "search",
    "KeyPoints", "key_points", "segment_free", "turning_points",
    "RobotLimits", "velocity_window",
    "covering_discs",
    "Pose", "RobotState", "euler_step", "rollout",
    "Movers", "Scenario", "UnknownSquares",
    "Sensed", "movers_at", "sense",
    "ScoreWeights", "Terms",
    "EVERY_RULE", "RULE_NAMES", "Rules",
    "Behaviour", "Constants", "DwaOptions", "Options", "PlanOptions",
    "Candidates", "Decision", "Guidance", "decide",
    "Measures", "PlannedMeasures",
    "Plan", "plan",
    "Episode", "Outcome", "drive",
    "Trace", "drive_lanes", "trace",
    "PRESETS", "ROBOTS", "Preset", "extended", "jackal", "on_robot", "paper", "preset",
]  # fmt: skip
