"""ROS map_server maps: a YAML file of metadata beside an image, read as Nav2's map server reads them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from scenarios.errors import InputError
from scenarios.formats.image_map import Pixels, read_pixels
from scenarios.formats.map_file import MapFile
from scenarios.formats.reading import bad_input, number, positive_number, read_lines, shown

UNKNOWN = -1
OCCUPIED = 100
MODES = ("trinary", "scale", "raw")

_KIND = "a ROS map YAML"
_FIELDS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")


@dataclass(frozen=True)
class RosMetadata:
    """The fields of a map YAML, checked. The image's path is resolved from the YAML's folder."""

    image: Path
    resolution: float  # [m]
    origin: tuple[float, float]  # x, y of the lower-left corner [m]
    yaw: float  # turn of the map in the world [rad]
    negate: bool  # True: white is occupied
    occupied_thresh: float  # 0..1
    free_thresh: float  # 0..1, at most occupied_thresh
    mode: str  # one of MODES


def load_ros_map(path: str | Path) -> MapFile:
    """Read a map YAML and its image; the rows are turned over, so that row 0 lies at the origin.

    The values of Nav2's OccupancyGrid are kept in `occupancy`, and -1 is unknown. A planner's two other
    classes: occupied is a value of 100 in the modes trinary and scale (what Nav2's costmap calls lethal;
    scale reaches it at p ≥ occupied_thresh), and a value of at least 100·occupied_thresh in the mode raw,
    which has met no threshold yet. All other known cells are free.

    Raises InputError naming the file and the field, or the image.
    """
    metadata = read_metadata(path)
    values = occupancy(read_pixels(metadata.image), metadata)[::-1].copy()
    occupied, unknown = values == OCCUPIED, values == UNKNOWN
    if metadata.mode == "raw":
        occupied = ~unknown & (values.astype(np.float64) / OCCUPIED >= metadata.occupied_thresh)
    return MapFile(name=str(path), occupied=occupied, unknown=unknown, resolution=metadata.resolution,
                   origin=metadata.origin, yaw=metadata.yaw, occupancy=values)


def occupancy(pixels: Pixels, metadata: RosMetadata) -> np.ndarray:
    """[h, w] int8 in image order: 0 free to 100 occupied, -1 unknown.

    With p = 1 - v/255 (v/255 with `negate`), v the mean of the colour channels:
    trinary: 100 where p ≥ occupied_thresh; 0 where p ≤ free_thresh, applied last, so it wins; otherwise -1;
    scale: the same, but between the thresholds 100·(p - free_thresh)/(occupied_thresh - free_thresh),
    rounded;
    raw: v itself where it is at most 100, otherwise -1; `negate`, thresholds and alpha play no part.
    Trinary and scale take pixels with alpha below 255 as unknown.
    """
    if metadata.mode == "raw":
        value = _rounded(pixels.bright() * 255.0)
        return np.where(value <= OCCUPIED, value, UNKNOWN).astype(np.int8)
    p = pixels.bright() if metadata.negate else pixels.dark()
    result = np.where(p >= metadata.occupied_thresh, OCCUPIED, UNKNOWN)
    if metadata.mode == "scale" and metadata.occupied_thresh > metadata.free_thresh:
        between = (p > metadata.free_thresh) & (p < metadata.occupied_thresh)
        share = (p - metadata.free_thresh) / (metadata.occupied_thresh - metadata.free_thresh)
        result = np.where(between, _rounded(share * OCCUPIED), result)
    result = np.where(p <= metadata.free_thresh, 0, result)
    if pixels.alpha is not None:
        result = np.where(pixels.alpha < 255, UNKNOWN, result)
    return result.astype(np.int8)


def read_metadata(path: str | Path) -> RosMetadata:
    """Read and check a map YAML. `mode` may be left out (trinary); the other fields may not, as in Nav2.

    Raises InputError naming the file and the field.
    """
    fields = _read_mapping(path)
    for name in _FIELDS:
        if name not in fields:
            raise bad_input(path, f"field '{name}' is missing", f"{_KIND} has {', '.join(_FIELDS)}",
                            f"add a line '{name}: ...'")
    x, y, yaw = _origin(path, fields["origin"])
    occupied_thresh, free_thresh = _thresholds(path, fields)
    return RosMetadata(
        image=_image_path(path, fields["image"]),
        resolution=positive_number(f"{path}, resolution", fields["resolution"],
                                   "give the side of a pixel in metres"),
        origin=(x, y), yaw=yaw, negate=_negate(path, fields["negate"]), occupied_thresh=occupied_thresh,
        free_thresh=free_thresh, mode=_mode(path, fields.get("mode", "trinary")))


def _read_mapping(path: str | Path) -> dict[Any, Any]:
    text = "\n".join(read_lines(path, _KIND))
    try:
        content = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise _not_yaml(path, error) from None
    if not isinstance(content, dict):
        raise bad_input(path, f"holds {shown(content)}", f"{_KIND} is a list of lines 'field: value'",
                        "check that this is the map's YAML")
    return content


def _not_yaml(path: str | Path, error: Exception) -> InputError:
    mark = getattr(error, "problem_mark", None)
    where = f"{path}:{mark.line + 1}" if mark else str(path)
    problem = getattr(error, "problem", None) or str(error)
    return bad_input(where, f"is not YAML ({problem})", f"{_KIND} is YAML", "mend the line")


def _image_path(path: str | Path, value: Any) -> Path:
    where = f"{path}, image"
    if not isinstance(value, str) or not value.strip():
        raise bad_input(where, shown(value), "must be the name of an image file", "name the map's image")
    image = Path(path).parent / value
    if not image.is_file():
        raise bad_input(where, shown(value), f"there is no file {image}",
                        "put the image there or mend the name")
    return image


def _origin(path: str | Path, value: Any) -> tuple[float, float, float]:
    where, rule = f"{path}, origin", "must be three finite numbers"
    remedy = "write [x, y, yaw] in metres and radians"
    if not isinstance(value, list) or len(value) != 3:
        raise bad_input(where, shown(value), rule, remedy)
    x, y, yaw = (number(where, part, rule, remedy) for part in value)
    return x, y, yaw


def _thresholds(path: str | Path, fields: dict[Any, Any]) -> tuple[float, float]:
    """(occupied_thresh, free_thresh), both within 0..1 and in order."""
    values: list[float] = []
    for name in ("occupied_thresh", "free_thresh"):
        rule, remedy = "must be a number from 0 to 1", "Nav2's defaults are 0.65 (occupied) and 0.25 (free)"
        value = number(f"{path}, {name}", fields[name], rule, remedy)
        if not 0.0 <= value <= 1.0:
            raise bad_input(f"{path}, {name}", shown(value), rule, remedy)
        values.append(value)
    occupied, free = values
    if free > occupied:
        raise bad_input(f"{path}, free_thresh", shown(free), f"must be at most occupied_thresh {occupied}",
                        "swap or mend the two")
    return occupied, free


def _negate(path: str | Path, value: Any) -> bool:
    if isinstance(value, bool | int) and value in (0, 1):
        return bool(value)
    raise bad_input(f"{path}, negate", shown(value), "must be 0 or 1",
                    "write 1 if white is occupied, otherwise 0")


def _mode(path: str | Path, value: Any) -> str:
    mode = value.lower() if isinstance(value, str) else ""
    if mode not in MODES:
        raise bad_input(f"{path}, mode", shown(value), f"must be one of {', '.join(MODES)}",
                        "mend or drop the line")
    return mode


def _rounded(values: np.ndarray) -> np.ndarray:
    """Nearest whole number, halves upwards."""
    return np.floor(values + 0.5)
