"""Any map file, read by what its name ends in."""

from pathlib import Path

from scenarios.formats.barn_world import load_barn_world
from scenarios.formats.image_map import IMAGE_SUFFIXES, load_image_map
from scenarios.formats.map_file import MapFile
from scenarios.formats.movingai import load_movingai_map
from scenarios.formats.reading import bad_input, shown
from scenarios.formats.ros_map import load_ros_map

_LOADERS = {".map": load_movingai_map, ".yaml": load_ros_map, ".yml": load_ros_map, ".world": load_barn_world,
            ".world.gz": load_barn_world}


def load_map(path: str | Path, resolution: float = 1.0) -> MapFile:
    """Read a MovingAI `.map`, a ROS `.yaml`, a BARN `.world` or `.world.gz`, or a plain image.

    The case of the suffix does not matter. `resolution` [m] is the side of a pixel of a plain image; the
    other formats state their own. Raises InputError for any other suffix, and as the formats' loaders do.
    """
    name = Path(path).name.lower()
    if Path(path).is_dir():
        raise bad_input(path, "is a folder", "a map is one file", "name the file inside it")
    if name.endswith(IMAGE_SUFFIXES):
        return load_image_map(path, resolution)
    for suffix, loader in _LOADERS.items():
        if name.endswith(suffix):
            return loader(path)
    ending = Path(path).suffix
    raise bad_input(path, f"suffix {shown(ending)}" if ending else "no suffix",
                    f"a map file ends in {' '.join((*_LOADERS, *IMAGE_SUFFIXES))}",
                    "rename it, or convert the map")
