"""Everything that sets the planner: traced constants on one side, static options on the other."""

from dataclasses import dataclass, field
from functools import partial

import jax

from adwa_jax.astar import SearchOptions
from adwa_jax.checks import require, require_choice, require_numbers, require_whole
from adwa_jax.grid import Scalar
from adwa_jax.heuristic_weight import Scope, WeightRule
from adwa_jax.keypoints import KeyPointRule
from adwa_jax.rules import Rules
from adwa_jax.score import Normalisation, ScoreWeights
from adwa_jax.window import RobotLimits


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["dt", "clearance_cap", "clearance_margin", "keypoint_tolerance", "sensor_range", "danger_clearance",
                 "stuck_radius", "stuck_time", "static_margin", "mover_margin", "mover_growth", "mover_cap",
                 "lookahead", "route_margin", "lost_time"],
    meta_fields=[],
)
@dataclass(frozen=True)
class Behaviour:
    """Distances and times of the closed loop (§4). Traced."""

    dt: Scalar  # control step [s]
    clearance_cap: Scalar  # the clearance term grows no further [m]
    clearance_margin: Scalar  # key-point segments keep more than this from occupied squares [m]
    keypoint_tolerance: Scalar  # a key point counts as reached within this distance [m]
    sensor_range: Scalar  # to an obstacle's outline [m]
    danger_clearance: Scalar  # closer than this is a danger point of the driven path [m]
    stuck_radius: Scalar  # STUCK: not out of this circle [m] ...
    stuck_time: Scalar  # ... for so long [s]
    # Of the rules beyond the paper.
    static_margin: Scalar = 0.0  # a braking robot keeps so far from statics [m] (`stopping`)
    mover_margin: Scalar = 0.0  # ... and from movers [m] (`mover_margin`)
    mover_growth: Scalar = 0.0  # by which that margin grows with the time predicted [m/s]
    mover_cap: Scalar = 1.0  # clearance to movers counts no further [m] (`mover_terms`)
    lookahead: Scalar = 2.0  # to the carrot, along the route [m] (`carrot`)
    route_margin: Scalar = 0.0  # a route's cells keep so much more than the radius from squares [m] (`replan`)
    lost_time: Scalar = 1.0  # a route out of sight for so long is planned anew [s] (`replan`)

    def __post_init__(self) -> None:
        """Refuse negative distances and a step that is not positive; traced values pass unseen."""
        if require_numbers(self, least=0.0):
            for name in ("dt", "clearance_cap", "mover_cap", "lookahead"):
                value = float(getattr(self, name))
                require(value > 0, name, value, "must be positive", "raise it")


@partial(jax.tree_util.register_dataclass, data_fields=["weight_rule", "weights", "robot", "behaviour"], meta_fields=[])
@dataclass(frozen=True)
class Constants:
    """All that may be tuned without compiling anew."""

    weight_rule: WeightRule  # eq. 5
    weights: ScoreWeights  # eq. 9
    robot: RobotLimits  # eq. 6
    behaviour: Behaviour


@jax.tree_util.register_static
@dataclass(frozen=True)
class PlanOptions:
    """Static choices of the global plan (§2)."""

    search: SearchOptions = field(default_factory=SearchOptions)
    scope: Scope = "node"
    keypoint_rule: KeyPointRule = "anchor"
    inflate: bool = True  # block cells whose centre is within the robot's radius of an occupied square
    subdivision: int = 4  # lattice steps a cell of the distance field

    def __post_init__(self) -> None:
        """Refuse unknown choices."""
        require_choice("scope", self.scope, ("start", "node", "one"))
        require_choice("keypoint_rule", self.keypoint_rule, ("anchor", "literal"))
        require_whole("subdivision", self.subdivision, 1)


@jax.tree_util.register_static
@dataclass(frozen=True)
class DwaOptions:
    """Static choices of a decision: how many candidates, how far ahead, how terms are made comparable."""

    v_samples: int = 11  # V
    yaw_rate_samples: int = 21  # N
    horizon_steps: int = 20  # K
    normalisation: Normalisation = "sum"
    # Of the rules beyond the paper.
    watch_beyond: int = 0  # predicted steps beyond the horizon for which movers are watched (`long_watch`)
    stride: int = 1  # control steps in a predicted step (`ramp`)
    turn_step: int = 2  # predicted step after which a candidate changes its mind (`second_phase`)
    halt_steps: int = 6  # control steps from any speed to rest, one of them at speed (`stopping`)

    def __post_init__(self) -> None:
        """Refuse windows without both their ends and empty horizons."""
        for name, least in (("v_samples", 2), ("yaw_rate_samples", 2), ("horizon_steps", 1), ("stride", 1),
                            ("turn_step", 1), ("halt_steps", 1), ("watch_beyond", 0)):
            require_whole(name, getattr(self, name), least)
        require_choice("normalisation", self.normalisation, ("sum", "minmax", "none"))


@jax.tree_util.register_static
@dataclass(frozen=True)
class Options:
    """All static choices. Another value compiles anew."""

    plan: PlanOptions = field(default_factory=PlanOptions)
    dwa: DwaOptions = field(default_factory=DwaOptions)
    rules: Rules = field(default_factory=Rules)  # none: the paper's method
    contact_reach: int = 2  # cells around the robot in which contact is judged exactly; ≥ radius / resolution + 1

    def __post_init__(self) -> None:
        """Refuse a contact window without cells."""
        require_whole("contact_reach", self.contact_reach, 1)
