"""What all specs have in common: the robot, the task, and what the robot does not know beforehand."""

import math
from dataclasses import dataclass

from scenarios.errors import InputError

Range = tuple[float, float]
"""(least, greatest)."""


def demand(holds: bool, field: str, value: object, rule: str, remedy: str) -> None:
    """Raises InputError with the field, its value, the rule and the remedy unless the rule holds."""
    if not holds:
        raise InputError(f"{field}: {value!r}; {rule}; {remedy}")


def demand_number(field: str, value: float, low: float, high: float = math.inf) -> None:
    """Raises InputError unless the value is finite and in [low, high]."""
    remedy = f"try {min(max(value, low), high) if math.isfinite(value) else low:g}"
    holds = math.isfinite(value) and low <= value <= high
    demand(holds, field, value, f"must be a finite number {_between(low, high)}", remedy)


def demand_count(field: str, value: int, low: int, high: int = 10_000) -> None:
    """Raises InputError unless the value is a whole number in [low, high]."""
    whole = isinstance(value, int) and not isinstance(value, bool) and low <= value <= high
    demand(whole, field, value, f"must be a whole number from {low} to {high}", f"try {low}")


def demand_range(field: str, value: Range, low: float, high: float = math.inf) -> None:
    """Raises InputError unless value is (least, greatest) with low ≤ least ≤ greatest ≤ high, all finite."""
    ordered = len(value) == 2 and all(map(math.isfinite, value)) and low <= value[0] <= value[1] <= high
    rule = f"must be (least, greatest), both finite and {_between(low, high)}"
    demand(ordered, field, value, rule, "give two numbers in rising order")


def _between(low: float, high: float) -> str:
    return f"from {low:g} to {high:g}" if math.isfinite(high) else f"from {low:g} up"


@dataclass(frozen=True, kw_only=True)
class TaskSpec:
    """Static numbers shared by the generators; lengths in metres, times in seconds.

    `squares` and `movers` are upper counts: where a map has no room for more under the rules below, it gets
    fewer. Raises InputError (field, value, rule, remedy) for nonsense.
    """

    robot_radius: float = 0.25  # start and goal are connected for a disc of this radius
    goal_tolerance: float = 0.4
    time_limit: float = 60.0
    squares: int = 5  # unknown squares
    square_half_width: float = 0.3
    square_distance: float = 3.0  # along x or y, centre of a square to start and goal: farther than this
    movers: int | None = 6
    mover_speed: Range = (0.2, 0.8)  # [m/s]
    mover_radius: Range = (0.2, 0.4)
    mover_distance: float = 4.0  # centre of a mover at t = 0 to start and goal: farther than this

    def __post_init__(self):
        demand_number("robot_radius", self.robot_radius, 0.0)
        demand_number("goal_tolerance", self.goal_tolerance, 1e-3)
        demand_number("time_limit", self.time_limit, 1e-3)
        demand_count("squares", self.squares, 0)
        demand_number("square_half_width", self.square_half_width, 1e-3)
        demand_number("square_distance", self.square_distance, 0.0)
        demand_count("movers", self.mover_count, 0)
        demand_range("mover_speed", self.mover_speed, 0.0)
        demand_range("mover_radius", self.mover_radius, 1e-3)
        demand_number("mover_distance", self.mover_distance, 0.0)

    @property
    def mover_count(self) -> int:
        """How many movers; a spec whose `movers` may be None says here what that means."""
        return 0 if self.movers is None else self.movers


def demand_fit(field: str, opening_cells: int, resolution: float, robot_radius: float) -> None:
    """Raises InputError unless a robot centred on the middle cell of an opening touches neither side of it."""
    room = ((opening_cells + 1) // 2 - 0.5) * resolution
    demand(room > robot_radius, field, opening_cells,
           f"its middle cell must be farther than robot_radius {robot_radius:g} m from its sides and is {room:g} m "
           "from them", "widen it, enlarge resolution or take a smaller robot_radius")
