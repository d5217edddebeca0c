"""A map as read from a file: what is occupied, what is unknown, and where it lies in the world."""

import math
from dataclasses import dataclass

import numpy as np

from adwa_jax.grid import Grid
from scenarios.errors import InputError
from scenarios.formats.leaves import numpy_grid
from scenarios.formats.reading import bad_input, positive_number, shown


@dataclass(frozen=True, eq=False)
class MapFile:
    """A map on the host. Dimension letters: H rows (along y), W columns (along x); row 0 has the lowest y.

    The map's own frame ("grid frame") is the world's, turned by -yaw about the map's origin corner; without
    yaw the two are one. Raises InputError for a resolution that is not finite and above 0, ValueError for
    arrays that disagree.
    """

    name: str  # the file it came from, as named by the user
    occupied: np.ndarray  # [H, W] bool
    unknown: np.ndarray  # [H, W] bool; never both occupied and unknown
    resolution: float  # side of a cell [m]
    origin: tuple[float, float]  # x, y of the outer corner of cell (0, 0) [m]
    yaw: float = 0.0  # turn of the map's x axis from the world's [rad]
    y_down: bool = False  # True: y grows downwards in this format, so pictures turn the y axis round
    occupancy: np.ndarray | None = None  # [H, W] int8, 0..100 or -1 unknown, where graded

    def __post_init__(self):
        positive_number(f"{self.name}, resolution", self.resolution, "give the side of a cell in metres")
        shape = self.occupied.shape
        if any(mask.dtype != np.bool_ or mask.shape != shape for mask in (self.occupied, self.unknown)):
            raise ValueError(f"{self.name}: occupied and unknown must be bool arrays of one shape [H, W]")
        if (self.occupied & self.unknown).any():
            raise ValueError(f"{self.name}: a cell cannot be both occupied and unknown")

    @property
    def unknown_share(self) -> float:
        """Share of the cells that are unknown, 0..1."""
        return float(self.unknown.mean())

    def grid(self, unknown: str = "occupied") -> Grid:
        """The map as an unpadded Grid with numpy leaves, its unknown cells taken as `unknown` says.

        Raises InputError for another policy and for a map that has no free cell under it.
        """
        if unknown not in ("occupied", "free"):
            raise bad_input("unknown", shown(unknown), "unknown cells count as 'occupied' or as 'free'",
                            "choose one of the two")
        occupied = self.occupied | self.unknown if unknown == "occupied" else self.occupied
        if occupied.all():
            raise self._no_free_cell(occupied is not self.occupied)
        return numpy_grid(occupied, self.resolution, self.origin)

    def to_grid_frame(self, points: np.ndarray) -> np.ndarray:
        """World points [..., 2] (x, y) [m] in the grid frame: p ↦ origin + R(-yaw)·(p - origin), float64."""
        return self._turned(points, -self.yaw)

    def to_world(self, points: np.ndarray) -> np.ndarray:
        """Grid-frame points [..., 2] (x, y) [m] in the world: the inverse of `to_grid_frame`, float64."""
        return self._turned(points, self.yaw)

    def _turned(self, points: np.ndarray, angle: float) -> np.ndarray:
        points = np.asarray(points, np.float64)
        if angle == 0.0:
            return points.copy()
        cosine, sine = math.cos(angle), math.sin(angle)
        origin = np.asarray(self.origin, np.float64)
        x, y = np.moveaxis(points - origin, -1, 0)
        return origin + np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)

    def _no_free_cell(self, unknown_counted: bool) -> InputError:
        height, width = self.occupied.shape
        unknown = int(self.unknown.sum())
        among = f", {unknown} of them unknown and counted as occupied" if unknown_counted and unknown else ""
        remedy = "let unknown cells count as free" if among else "check the map and, if any, its thresholds"
        return bad_input(self.name, f"no free cell among {height} x {width}{among}",
                         "a map needs at least one free cell", remedy)
