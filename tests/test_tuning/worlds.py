"""Small worlds for the tests of tuning, in as few padded shapes as possible, so that little is compiled."""

from dataclasses import replace

import jax
import numpy as np

from scenarios.formats import MapFile
from scenarios.generators import toy
from scenarios.suite import Suite, make_suite

KEY = jax.random.key(0)
# Each has an unknown square and a mover, out of the way, so that all are padded to one shape.
OPEN = "........\n.S......\n.....G..\n........\n........\no.......\n.......<"
WALLED_GOAL = "........\n.S..###.\n....#G#.\n....###.\n........\no.......\n.......<"

BANDS = """\
type octile
height 5
width 6
map
......
.@@@@.
......
.@@@@.
......
"""
"""A map of two walls with a way round each."""


def brief(scenario, seconds):
    """The scenario with a short time limit [s]: what it takes to drive depends on it."""
    return replace(scenario, time_limit=np.float32(seconds))


def drawn(drawing, seconds=8.0, **spec):
    return brief(toy.generate(KEY, toy.ToySpec(drawing=drawing, **spec)), seconds)


def mixed_suite():
    """Seven scenarios of unequal size and difficulty, one of them without a path."""
    small, large = make_suite("paper-15", 3, 3).scenarios, make_suite("paper-20", 3, 1).scenarios
    scenarios = {
        "large": brief(large[0], 8.0),
        "detour": drawn(toy.DETOUR, 30.0),
        "small": brief(small[0], 8.0),
        "walled": drawn(WALLED_GOAL),
        "brief": brief(small[1], 0.3),
        "open": drawn(OPEN, 20.0),
        "other small": brief(small[2], 12.0),
    }
    return Suite("mixed", tuple(scenarios.values()), tuple(scenarios), {})


def part_of(suite, indices):
    """The scenarios of a suite at some indices, in that order."""
    return replace(suite, scenarios=tuple(suite.scenarios[index] for index in indices),
                   names=tuple(suite.names[index] for index in indices))  # fmt: skip


def map_file(*rows, **frame):
    """A map from rows of '#', '.' and '?' (unknown), row 0 first."""
    cells = np.array([list(row) for row in rows])
    frame = {"resolution": 1.0, "origin": (0.0, 0.0), **frame}
    return MapFile(name="drawn.map", occupied=cells == "#", unknown=cells == "?", **frame)
