"""Improved A*, traditional A* and Dijkstra: one search in `lax.while_loop` with a fixed budget (§2).

Costs a + b·√2 are whole numbers a·S + b·D, with D/S a convergent of √2. Their order is the exact order of the real
costs as long as no path is D cells long, which the search watches, so that ties are ties whatever route made them.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from adwa_jax.checks import require, require_choice, require_whole
from adwa_jax.heuristic_weight import MAX_WEIGHT

CornerRule = Literal["never", "squeeze", "always"]
Heuristic = Literal["octile", "euclidean", "manhattan", "zero"]
StopRule = Literal["popped", "generated"]

WEIGHT_STEPS = 1024  # the heuristic weight is rounded to a multiple of 1/1024
FAR = np.int32(2**31 - 1)
CONVERGENTS = ((470832, 665857), (195025, 275807), (80782, 114243), (33461, 47321), (13860, 19601), (5741, 8119))
# Order of the 3 × 3 neighbourhood, row-major, and of the eight moves in it; the centre is no move.
MOVES = np.array([(dr, dc) for dr in (-1, 0, 1) for dc in (-1, 0, 1)], dtype=np.int32)


class Status(IntEnum):
    """How a search ended."""

    FOUND = 0
    UNREACHABLE = 1
    BUDGET_EXHAUSTED = 2  # expansions, or path costs beyond what integers order exactly
    BAD_START = 3  # off the map or blocked
    BAD_GOAL = 4


RUNNING = np.int32(-1)


@jax.tree_util.register_static
@dataclass(frozen=True)
class SearchOptions:
    """Static choices of the search (§2.1, §2.2.1)."""

    corner_rule: CornerRule = "never"
    heuristic: Heuristic = "octile"
    stop_rule: StopRule = "popped"
    budget: int | None = None  # expansions; None: as many as there are cells

    def __post_init__(self) -> None:
        """Refuse unknown rules and a budget below 1."""
        require_choice("corner_rule", self.corner_rule, ("never", "squeeze", "always"))
        require_choice("heuristic", self.heuristic, ("octile", "euclidean", "manhattan", "zero"))
        require_choice("stop_rule", self.stop_rule, ("popped", "generated"))
        if self.budget is not None:
            require_whole("budget", self.budget, 1)


class SearchResult(NamedTuple):
    """A path and what it took to find it. Without a path `path_cells`, steps are 0."""

    status: jax.Array  # [] int32, a `Status`
    path: jax.Array  # [H·W, 2] int32 (row, col) from start to goal; beyond `path_cells` the goal repeats
    path_cells: jax.Array  # [] int32
    straight_steps: jax.Array  # [] int32; the path's cost is straight + √2 · diagonal, in cells
    diagonal_steps: jax.Array  # [] int32
    expansions: jax.Array  # [] int32, cells closed and scanned
    expanded_at: jax.Array  # [H, W] int32, order in which a cell was closed, from 0; -1: never


class Costs(NamedTuple):
    """Integer units of one straight and one diagonal step, and the largest path cost that stays exact."""

    straight: int
    diagonal: int
    limit: int


class _Open(NamedTuple):
    """The open list, in two levels: every cell's f, and for each row the best f and, among those, the least ⌊h⌋."""

    f: jax.Array  # [H + 2, W] int32; FAR where not open
    row_f: jax.Array  # [H + 2] int32
    row_floor: jax.Array  # [H + 2] int32


class _Carry(NamedTuple):
    open: _Open
    # [H + 2, W + 2, 2] int32: g, and the index into MOVES of the step that led here. g is FAR where not reached; in a
    # closed cell it is ~order, negative, so that no route improves it.
    reached: jax.Array
    cell: jax.Array  # [2] int32, next to close, in ringed coordinates
    cell_g: jax.Array  # [] int32
    expansions: jax.Array  # [] int32
    status: jax.Array  # [] int32


def search(blocked: jax.Array, start_cell: jax.Array, goal_cell: jax.Array, weight: jax.Array,
           options: SearchOptions) -> SearchResult:
    """Least f = g + ω·h first (eq. 4); among equals smaller ⌊h⌋ in cells, then the lower row-major index.

    Closed cells are not reopened; a cell's parent is the neighbour that first gave it its least g. ω is rounded to a
    multiple of 1/1024, ω·h to the nearest unit of cost.

    Unbatched. blocked: [H, W] bool; start_cell, goal_cell: [2] int32 (row, col); weight: [H, W] float32, ω ≤ 16.
    Raises ValueError where the map is too large for int32 costs to be ordered exactly.
    """
    rows, columns = blocked.shape
    costs = unit_costs(rows, columns)
    budget = options.budget if options.budget is not None else rows * columns
    weighted, floor = weighted_heuristic((rows, columns), goal_cell, weight, options.heuristic, costs)
    legal = jnp.pad(legal_moves(blocked, options.corner_rule), 1)
    weighted, floor = jnp.pad(weighted, 1), jnp.pad(floor, ((1, 1), (0, 0)))
    goal = goal_cell + 1

    def cond_fun(carry: _Carry) -> jax.Array:
        return carry.status == RUNNING

    def body_fun(carry: _Carry) -> _Carry:
        carry = _expand(carry, legal, weighted, floor, costs)
        return _choose(carry, floor, goal, costs, budget, options.stop_rule)

    first = begin(blocked, start_cell, goal_cell)
    carry = lax.while_loop(cond_fun, body_fun, first)
    return _result(carry, start_cell, goal_cell)


def unit_costs(rows: int, columns: int) -> Costs:
    """Finest units that hold any path of the map, or those that hold the longest paths."""
    farthest = int(MAX_WEIGHT * (rows + columns)) + 1

    def capacity(units: tuple[int, int]) -> int:
        return min(units[1], (2**31 - 2) // units[0] - farthest)

    enough = rows * columns // 2 + rows + columns
    holding = [units for units in CONVERGENTS if capacity(units) >= enough]
    straight, diagonal = holding[0] if holding else max(CONVERGENTS, key=capacity)
    cells = capacity((straight, diagonal))
    require(cells > 4 * (rows + columns), "map size", f"{rows} x {columns}",
            "path costs must be ordered exactly in 32-bit integers", "crop the map or coarsen its resolution")
    return Costs(straight, diagonal, cells * straight)


def weighted_heuristic(shape: tuple[int, int], goal_cell: jax.Array, weight: jax.Array, heuristic: Heuristic,
                       costs: Costs) -> tuple[jax.Array, jax.Array]:
    """ω·h in integer units of cost and ⌊h⌋ in whole cells, each [H, W] int32."""
    dr = jnp.abs(jnp.arange(shape[0], dtype=jnp.int32) - goal_cell[0])[:, None]
    dc = jnp.abs(jnp.arange(shape[1], dtype=jnp.int32) - goal_cell[1])[None, :]
    if heuristic == "octile":
        h = jnp.abs(dr - dc) * costs.straight + jnp.minimum(dr, dc) * costs.diagonal
    elif heuristic == "euclidean":
        h = _scaled_root(dr * dr + dc * dc, costs.straight)
    elif heuristic == "manhattan":
        h = (dr + dc) * costs.straight
    else:
        h = jnp.zeros(shape, jnp.int32)
    steps = jnp.round(weight * WEIGHT_STEPS).astype(jnp.int32)
    high, low = h // WEIGHT_STEPS, h % WEIGHT_STEPS  # the product itself would overflow
    return high * steps + (low * steps + WEIGHT_STEPS // 2) // WEIGHT_STEPS, h // costs.straight


def _scaled_root(square: jax.Array, scale: int) -> jax.Array:
    """scale · √square to the nearest whole number, int32; the whole part is exact, float32 errs on the rest only."""
    whole = jnp.floor(jnp.sqrt(square.astype(jnp.float32))).astype(jnp.int32)
    whole = jnp.where(whole * whole > square, whole - 1, whole)
    whole = jnp.where((whole + 1) * (whole + 1) <= square, whole + 1, whole)
    rest = (square - whole * whole).astype(jnp.float32)
    fraction = rest / jnp.maximum(whole.astype(jnp.float32) + jnp.sqrt(square.astype(jnp.float32)), 1.0)
    return whole * scale + jnp.round(fraction * scale).astype(jnp.int32)


def legal_moves(blocked: jax.Array, rule: CornerRule) -> jax.Array:
    """[H, W] int32, bit i set where MOVES[i] may be taken from the cell."""
    rows, columns = blocked.shape
    ringed = jnp.pad(blocked, 1, constant_values=True)

    def blocked_at(dr: int, dc: int) -> jax.Array:
        return ringed[1 + dr : 1 + dr + rows, 1 + dc : 1 + dc + columns]

    bits = jnp.zeros((rows, columns), jnp.int32)
    for index, (dr, dc) in enumerate(MOVES.tolist()):
        if (dr, dc) == (0, 0):
            continue
        allowed = ~blocked_at(dr, dc)
        if dr and dc and rule == "never":
            allowed &= ~(blocked_at(dr, 0) | blocked_at(0, dc))
        elif dr and dc and rule == "squeeze":
            allowed &= ~(blocked_at(dr, 0) & blocked_at(0, dc))
        bits |= allowed.astype(jnp.int32) << index
    return bits


def begin(blocked: jax.Array, start_cell: jax.Array, goal_cell: jax.Array) -> _Carry:
    """Only the start reached; a start or goal that is off the map or blocked ends the search here."""
    rows, columns = blocked.shape

    def usable(cell: jax.Array) -> jax.Array:
        on_map = jnp.all(cell >= 0) & (cell[0] < rows) & (cell[1] < columns)
        return on_map & ~blocked.at[cell[0], cell[1]].get(mode="fill", fill_value=True)

    status = jnp.where(jnp.all(start_cell == goal_cell), np.int32(Status.FOUND), RUNNING)
    status = jnp.where(usable(goal_cell), status, np.int32(Status.BAD_GOAL))
    status = jnp.where(usable(start_cell), status, np.int32(Status.BAD_START))
    return _Carry(
        open=_Open(
            f=jnp.full((rows + 2, columns), FAR),
            row_f=jnp.full((rows + 2,), FAR),
            row_floor=jnp.full((rows + 2,), FAR),
        ),
        reached=jnp.full((rows + 2, columns + 2, 2), FAR),
        cell=jnp.clip(start_cell, 0, jnp.array([rows - 1, columns - 1])) + 1,
        cell_g=jnp.int32(0),
        expansions=jnp.int32(0),
        status=status,
    )


def _expand(carry: _Carry, legal: jax.Array, weighted: jax.Array, floor: jax.Array, costs: Costs) -> _Carry:
    """Close the cell, offer its neighbours a route through it, and renew the three rows of the open list it touches."""
    row, column = carry.cell[0], carry.cell[1]
    corner = (row - 1, column - 1)
    allowed = ((legal[row, column] >> np.arange(9, dtype=np.int32)) & 1).reshape(3, 3) == 1
    step = np.where((MOVES != 0).all(axis=1), costs.diagonal, costs.straight).astype(np.int32).reshape(3, 3)
    old = lax.dynamic_slice(carry.reached, (*corner, 0), (3, 3, 2))
    offered = jnp.stack([carry.cell_g + step, np.arange(9, dtype=np.int32).reshape(3, 3)], axis=-1)
    better = allowed & (offered[..., 0] < old[..., 0])
    centre = np.eye(9, dtype=bool)[4].reshape(3, 3)
    closed = jnp.stack([jnp.full((3, 3), ~carry.expansions), old[..., 1]], axis=-1)
    new = jnp.where(better[..., None], offered, jnp.where(centre[..., None], closed, old))
    f = jnp.where(better, offered[..., 0] + lax.dynamic_slice(weighted, corner, (3, 3)), FAR)
    renewed = _renew_rows(carry.open, row, column, better | centre, f, floor)
    # f is never negative, so `wait` is 0; it makes the write of `reached` wait for all reads, or XLA copies the array.
    wait = jnp.minimum(renewed.row_f[row], 0)
    return carry._replace(
        open=renewed,
        reached=lax.dynamic_update_slice(carry.reached, new, (row - 1 + wait, column - 1, 0)),
        expansions=carry.expansions + 1,
    )


def _renew_rows(open_list: _Open, row: jax.Array, column: jax.Array, changed: jax.Array, f: jax.Array,
                floor: jax.Array) -> _Open:
    """Write the changed cells of a 3 × 3 neighbourhood and take the least of its three rows anew."""
    columns = open_list.f.shape[1]
    lines = lax.dynamic_slice(open_list.f, (row - 1, 0), (3, columns))
    place = jnp.arange(columns, dtype=jnp.int32) + 2 - column  # 0, 1, 2 in the neighbourhood (f has no ring columns)
    for offset in range(3):
        here = (place == offset)[None, :] & changed[:, offset : offset + 1]
        lines = jnp.where(here, f[:, offset : offset + 1], lines)
    row_f = jnp.min(lines, axis=1)
    floors = lax.dynamic_slice(floor, (row - 1, 0), (3, columns))
    row_floor = jnp.min(jnp.where(lines == row_f[:, None], floors, FAR), axis=1)
    return _Open(
        f=lax.dynamic_update_slice(open_list.f, lines, (row - 1, 0)),
        row_f=lax.dynamic_update_slice(open_list.row_f, row_f, (row - 1,)),
        row_floor=lax.dynamic_update_slice(open_list.row_floor, row_floor, (row - 1,)),
    )


def _choose(carry: _Carry, floor: jax.Array, goal: jax.Array, costs: Costs, budget: int,
            stop_rule: StopRule) -> _Carry:
    """Pick the next cell to close and judge whether the search has ended."""
    f = jnp.min(carry.open.row_f)
    floors = jnp.where(carry.open.row_f == f, carry.open.row_floor, FAR)
    row = jnp.argmin(floors).astype(jnp.int32)
    line = lax.dynamic_index_in_dim(carry.open.f, row, keepdims=False)
    line_floor = lax.dynamic_index_in_dim(floor, row, keepdims=False)
    column = jnp.argmax((line == f) & (line_floor == floors[row])).astype(jnp.int32) + 1
    cell = jnp.stack([row, column])
    cell_g = carry.reached[row, column, 0]
    found = (f != FAR) & jnp.all(cell == goal)
    if stop_rule == "generated":
        found |= carry.reached[goal[0], goal[1], 0] != FAR
    exhausted = (carry.expansions >= budget) | (cell_g >= costs.limit)
    status = jnp.where(exhausted, np.int32(Status.BUDGET_EXHAUSTED), RUNNING)
    status = jnp.where(f == FAR, np.int32(Status.UNREACHABLE), status)
    status = jnp.where(found, np.int32(Status.FOUND), status)
    return carry._replace(cell=cell, cell_g=cell_g, status=status)


def _result(carry: _Carry, start_cell: jax.Array, goal_cell: jax.Array) -> SearchResult:
    """Follow the parents back from the goal, then turn the path round."""
    found = carry.status == Status.FOUND
    rows, columns = carry.reached.shape[0] - 2, carry.reached.shape[1] - 2
    capacity = rows * columns
    moves = jnp.asarray(MOVES)

    def cond_fun(state):
        cell, _, count, _ = state
        return found & jnp.any(cell != start_cell) & (count < capacity)

    def body_fun(state):
        cell, path, count, diagonal = state
        step = moves[carry.reached[cell[0] + 1, cell[1] + 1, 1]]
        cell = cell - step
        return cell, path.at[count].set(cell), count + 1, diagonal + jnp.all(step != 0).astype(jnp.int32)

    backwards = jnp.zeros((capacity, 2), jnp.int32).at[0].set(goal_cell)
    state = (goal_cell, backwards, jnp.int32(1), jnp.int32(0))
    _, backwards, count, diagonal = lax.while_loop(cond_fun, body_fun, state)
    index = jnp.maximum(count - 1 - jnp.arange(capacity, dtype=jnp.int32), 0)
    closed = carry.reached[1:-1, 1:-1, 0]
    return SearchResult(
        status=carry.status,
        path=backwards[index],
        path_cells=jnp.where(found, count, 0),
        straight_steps=jnp.where(found, count - 1 - diagonal, 0),
        diagonal_steps=jnp.where(found, diagonal, 0),
        expansions=carry.expansions,
        expanded_at=jnp.where(closed < 0, ~closed, -1),
    )
