"""Random worlds, one file a kind: a frozen spec and `generate(key, spec) -> Scenario` with numpy leaves.

Every known map is solvable: start and goal are connected under the corner rule `never` for a disc of the
spec's `robot_radius` on the map inflated by it. Equal keys and specs give equal bits.
"""

from scenarios.generators import barn, blocks, crowd, dynabarn, maze, on_map, paper, rooms, toy
from scenarios.generators.barn import BarnSpec
from scenarios.generators.blocks import BlocksSpec
from scenarios.generators.crowd import CrowdSpec
from scenarios.generators.dynabarn import DynabarnSpec
from scenarios.generators.maze import MazeSpec
from scenarios.generators.on_map import OnMapSpec
from scenarios.generators.paper import PaperSpec
from scenarios.generators.rooms import RoomsSpec
from scenarios.generators.toy import ToySpec

__all__ = [
    "BarnSpec", "BlocksSpec", "CrowdSpec", "DynabarnSpec", "MazeSpec", "OnMapSpec", "PaperSpec", "RoomsSpec", "ToySpec",
    "barn", "blocks", "crowd", "dynabarn", "maze", "on_map", "paper", "rooms", "toy",
]
