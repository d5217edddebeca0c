"""More scenarios than there are worlds: each world from its own start, then from others near it."""

from dataclasses import replace

import jax
import numpy as np

from adwa_jax.scenario import Scenario
from scenarios.generators.draws import streams_of
from scenarios.suite import Suite

SHIFT = 0.1
"""A start is moved by at most so much in x and in y [m], and turned by as much [rad]."""


def with_more_starts(suite: Suite, seed: int, count: int) -> Suite:
    """`count` scenarios from the N worlds of a suite: scenario i is world i modulo N.

    The first round is the suite itself; in round k ≥ 1 starts are shifted by a draw from fold_in(key(seed), i), and
    named `world_7-start03` for k = 3. A longer suite begins with the shorter one. Start headings must be given.
    """
    worlds, key = len(suite.scenarios), jax.random.key(seed, impl="threefry2x32")
    scenarios, names = list(suite.scenarios), list(suite.names)
    for index in range(worlds, count):
        scenarios.append(_shifted(suite.scenarios[index % worlds], jax.random.fold_in(key, index)))
        names.append(f"{suite.names[index % worlds]}-start{index // worlds:02d}")
    recipe = {"suite": suite.name, "starts_near": suite.recipe, "seed": seed, "count": count}
    return Suite(suite.name, tuple(scenarios[:count]), tuple(names[:count]), recipe)


def _shifted(scenario: Scenario, key: jax.Array) -> Scenario:
    """Another start pose within `SHIFT` of the scenario's. Consumes the key."""
    shift = SHIFT * (2.0 * streams_of(key).task.uniforms(3) - 1.0)
    return replace(scenario, start=(np.asarray(scenario.start, np.float64) + shift).astype(np.float32))
