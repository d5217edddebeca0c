"""File formats that worlds come in: maps of four kinds, BARN tasks, moving obstacles and pedestrian tracks."""

from scenarios.formats.barn_grids import load_barn_grids
from scenarios.formats.barn_world import load_barn_folder, load_barn_scenario, load_barn_world
from scenarios.formats.by_suffix import load_map
from scenarios.formats.dynabarn import load_dynabarn
from scenarios.formats.image_map import load_image_map
from scenarios.formats.map_file import MapFile
from scenarios.formats.movingai import ScenEntry, load_movingai_map, load_scen
from scenarios.formats.ros_map import load_ros_map
from scenarios.formats.tracks import load_tracks, movers_from_tracks

__all__ = [
    "MapFile",
    "ScenEntry",
    "load_barn_folder",
    "load_barn_grids",
    "load_barn_scenario",
    "load_barn_world",
    "load_dynabarn",
    "load_image_map",
    "load_map",
    "load_movingai_map",
    "load_ros_map",
    "load_scen",
    "load_tracks",
    "movers_from_tracks",
]
