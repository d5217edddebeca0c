"""Every constant of the planner, in one place, faithful to the paper's text.

The text gives the thresholds 1.5 and 0.5 of eq. 5, the weights' step of 0.1 and the map sizes, and nothing else: the
other numbers are ours, each beside its reason.
"""

from typing import NamedTuple

from adwa_jax.astar import SearchOptions
from adwa_jax.constants import Behaviour, Constants, Options, PlanOptions
from adwa_jax.dwa import DwaOptions
from adwa_jax.heuristic_weight import WeightRule
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


PRESETS = {"paper": paper}
