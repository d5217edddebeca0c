"""Square rooms in rows and columns, with walls between them and openings in the walls: rooms and mazes.

Dimension letters: C rooms a side.
"""

import numpy as np

from scenarios.generators.draws import Draws

WALL_CELLS = 1
"""Thickness of a wall in cells."""


def lattice_cells(rooms: int, room_cells: int) -> int:
    """Side of the map in cells; what lies beyond the map is occupied, so there are no outer walls."""
    return rooms * (room_cells + WALL_CELLS) - WALL_CELLS


def draw_lattice(draws: Draws, rooms: int, room_cells: int, opening_cells: int, extra: float) -> np.ndarray:
    """[H, W] bool: rooms² rooms of room_cells² cells, each wall with at most one opening of opening_cells.

    A random spanning tree of openings connects all rooms; each further wall has an opening with probability
    `extra`. Where in its wall an opening lies is random. Consumes `draws`.
    """
    pitch, side = room_cells + WALL_CELLS, lattice_cells(rooms, room_cells)
    occupied = np.zeros((side, side), np.bool_)
    for line in range(room_cells, side, pitch):
        occupied[line : line + WALL_CELLS] = occupied[:, line : line + WALL_CELLS] = True
    for row, column, is_up in _openings(draws, rooms, extra):
        across, beside = (row, column) if is_up else (column, row)
        first = beside * pitch + draws.index(room_cells - opening_cells + 1)
        wall = across * pitch + room_cells
        through, along = slice(wall, wall + WALL_CELLS), slice(first, first + opening_cells)
        occupied[(through, along) if is_up else (along, through)] = False
    return occupied


def _openings(draws: Draws, rooms: int, extra: float) -> list[tuple[int, int, bool]]:
    """(row, column, is_up) of the rooms whose upper (else right) wall has an opening.

    Kruskal's algorithm on randomly ordered walls: a wall between parts not yet connected is opened.
    """
    walls = [(r, c, is_up) for r in range(rooms) for c in range(rooms) for is_up in (False, True)
             if (r if is_up else c) < rooms - 1]
    order, luck = draws.order(len(walls)), draws.uniforms(len(walls)) < extra
    parent, opened = list(range(rooms * rooms)), []
    for index in order.tolist():
        row, column, is_up = walls[index]
        a = _root(parent, row * rooms + column)
        b = _root(parent, (row + is_up) * rooms + column + (not is_up))
        parent[a] = b
        if a != b or luck[index]:
            opened.append(walls[index])
    return opened


def _root(parent: list[int], node: int) -> int:
    """The representative of a node's part; shortens the way to it."""
    while parent[node] != node:
        parent[node] = parent[parent[node]]
        node = parent[node]
    return node
