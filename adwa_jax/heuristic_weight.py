"""The heuristic weight ω set by obstacle density (eq. 5)."""

from dataclasses import dataclass
from functools import partial
from typing import Literal

import jax
import jax.numpy as jnp

from adwa_jax.checks import require, require_numbers
from adwa_jax.density import Density, obstacle_density
from adwa_jax.grid import Grid, Scalar

Scope = Literal["start", "node", "one"]
MAX_WEIGHT = 16.0  # the search's integer costs leave room for weights up to this


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["dense_base", "dense_gain", "sparse_base", "sparse_gain", "dense_ratio", "sparse_ratio"],
    meta_fields=[],
)
@dataclass(frozen=True)
class WeightRule:
    """The constants of eq. 5: α, β (dense), γ, δ (sparse) and the two thresholds on P/Q. Traced.

    Made from plain numbers, it refuses constants that break what the rule promises, ω < 1 where dense and ω > 1 where
    sparse: dense_base + dense_gain / dense_ratio < 1 and sparse_base ≥ 1, gains ≥ 0.
    """

    dense_base: Scalar  # α
    dense_gain: Scalar  # β
    sparse_base: Scalar  # γ
    sparse_gain: Scalar  # δ
    dense_ratio: Scalar = 1.5  # dense where P ≥ dense_ratio·Q
    sparse_ratio: Scalar = 0.5  # sparse where P < sparse_ratio·Q

    def __post_init__(self) -> None:
        """Refuse constants that break the rule's promise; traced values pass unseen."""
        if not require_numbers(self, least=0.0):
            return
        require(self.sparse_ratio <= self.dense_ratio, "sparse_ratio", self.sparse_ratio,
                f"must not exceed dense_ratio = {self.dense_ratio}", "lower it")
        require(self.dense_ratio > 0, "dense_ratio", self.dense_ratio, "must be positive", "the paper uses 1.5")
        densest = self.dense_base + self.dense_gain / self.dense_ratio
        require(densest < 1, "dense_base + dense_gain / dense_ratio", densest,
                "must be < 1, so that ω < 1 in dense areas (eq. 5)", "lower dense_base or dense_gain")
        require(self.sparse_base >= 1, "sparse_base", self.sparse_base,
                "must be ≥ 1, so that ω > 1 in sparse areas (eq. 5)", "raise it")
        sparsest = self.sparse_base + self.sparse_gain * self.sparse_ratio
        require(sparsest <= MAX_WEIGHT, "sparse_base + sparse_gain · sparse_ratio", sparsest,
                f"must be ≤ {MAX_WEIGHT:g}, the largest weight the integer costs hold", "lower it")


def weight_field(grid: Grid, start_cell: jax.Array, goal_cell: jax.Array, rule: WeightRule, scope: Scope) -> jax.Array:
    """[H, W] float32 ω(n) (eq. 5).

    Scope `start`: one ω for the whole search, from the rectangle between start and goal (eq. 2 to the letter); it is 1
    whenever that rectangle is the map. Scope `node`: each cell's own rectangle to the goal ("in segments based on the
    robot's position", §6). Unbatched; cells are [2] int32 (row, col) on the map.
    """
    weight = heuristic_weight(obstacle_density(grid, goal_cell), rule)
    if scope == "start":
        return jnp.full_like(weight, 1.0) * weight[start_cell[0], start_cell[1]]
    return weight


def heuristic_weight(density: Density, rule: WeightRule) -> jax.Array:
    """ω = α + β·Q/P where P ≥ 1.5 Q; γ + δ·P/Q where P < 0.5 Q; 1 elsewhere and where Q = 0 (eq. 5). Shape of P.

    P against Q is judged on the products N·S and T·M, whole numbers exact in float32 up to 64 × 64 cells.
    """
    local = density.obstacles * density.map_cells  # P · (M·S)
    overall = density.map_obstacles * density.cells  # Q · (M·S)
    dense = rule.dense_base + rule.dense_gain * overall / jnp.maximum(local, 1.0)
    sparse = rule.sparse_base + rule.sparse_gain * local / jnp.maximum(overall, 1.0)
    weight = jnp.where(local >= rule.dense_ratio * overall, dense, 1.0)
    weight = jnp.where(local < rule.sparse_ratio * overall, sparse, weight)
    return jnp.where(density.map_obstacles > 0, weight, 1.0)
