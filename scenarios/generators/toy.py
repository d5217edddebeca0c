"""Hand-drawn scenarios: what is drawn is what is tested."""

from dataclasses import dataclass

import jax
import numpy as np

from adwa_jax.scenario import Movers, Scenario
from scenarios.generators.assembly import centre, grid_of, movers_of, scenario_of, squares_of
from scenarios.generators.connectivity import Cell
from scenarios.generators.task_spec import TaskSpec, demand, demand_number

DETOUR = """
........
.S.##.v.
...##...
.o.##...
...##...
........
.>.....G
"""
"""A wall of two columns, an unknown square beside the way, a mover along the bottom and one on the right."""
DIRECTIONS = {">": (1.0, 0.0), "<": (-1.0, 0.0), "^": (0.0, 1.0), "v": (0.0, -1.0)}
"""Characters of the movers: where they head, y up."""


@dataclass(frozen=True, kw_only=True)
class ToySpec(TaskSpec):
    """A drawing of the map and the task, its first line on top.

    `#` is occupied, `.` free, `S` start, `G` goal, `o` an unknown square; `> < ^ v` are movers and where they
    head. A character is a cell of `resolution` [m]. Movers go at the lower end of `mover_speed`, have the lower
    radius, and are mirrored at the border. As drawn: nothing is moved or made solvable.
    """

    drawing: str = DETOUR
    resolution: float = 1.0
    mover_speed: tuple[float, float] = (0.5, 0.5)
    mover_radius: tuple[float, float] = (0.3, 0.3)

    def __post_init__(self):
        super().__post_init__()
        demand_number("resolution", self.resolution, 1e-3)
        lines = self.drawing.split()
        equal = len({len(line) for line in lines}) == 1
        demand(equal, "drawing", self.drawing, "its lines must be equally long", "fill them up with '.'")
        unknown = set("".join(lines)) - set("#.SGo") - set(DIRECTIONS)
        marks = "".join(sorted(unknown))
        demand(not unknown, "drawing", marks, "knows only # . S G o > < ^ v", "draw with these")
        for end in "SG":
            count = self.drawing.count(end)
            demand(count == 1, "drawing", self.drawing, f"needs exactly one {end}", f"draw one {end}")


def generate(key: jax.Array, spec: ToySpec) -> Scenario:
    """The scenario as drawn, numpy leaves, origin (0, 0).

    The key is there for the common signature and is not used.
    """
    del key
    cells = np.array([list(line) for line in reversed(spec.drawing.split())])
    start, goal = (centre(_cells(cells, end)[0], spec.resolution) for end in "SG")
    hidden = [centre(cell, spec.resolution) for cell in _cells(cells, "o")]
    squares = squares_of(hidden, spec.square_half_width)
    grid = grid_of(cells == "#", spec.resolution)
    return scenario_of(grid, start, goal, spec, squares, _drawn_movers(cells, spec))


def _drawn_movers(cells: np.ndarray, spec: ToySpec) -> Movers:
    """The movers of a drawing [H, W] of characters, in the order of `DIRECTIONS`, then row by row from below."""
    drawn = [(cell, way) for mark, way in DIRECTIONS.items() for cell in _cells(cells, mark)]
    radius, speed, count = spec.mover_radius[0], spec.mover_speed[0], len(drawn)
    width, height = cells.shape[1] * spec.resolution, cells.shape[0] * spec.resolution
    return movers_of([radius] * count, [centre(cell, spec.resolution) for cell, _ in drawn],
                     [(speed * x, speed * y) for _, (x, y) in drawn], [(radius, radius)] * count,
                     [(width - radius, height - radius)] * count)


def _cells(cells: np.ndarray, mark: str) -> list[Cell]:
    """(row, column) of the cells with a character, row by row from below."""
    return [(int(row), int(column)) for row, column in np.argwhere(cells == mark)]
