"""Many improved-A* searches, lane after lane inside one compiled function; equals `astar.search` in every output.

Why it stands beside the unbatched kernel: under `vmap` a `while_loop` selects the whole carry each turn and runs until
the slowest lane ends; and on a CPU every operation in a loop's body is a kernel of its own, whose call costs more than
the few numbers it handles. Here each lane runs to its own end before the next begins, and `whole` has all of it
compiled to one native function. What then counts is the number of instructions, so the open list is leaner: f is not
stored but made from g where a row is scanned, and of the three rows that an expansion touches only the closed cell's
own is scanned, because in the others costs can only have fallen.
"""

from functools import partial, reduce
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from adwa_jax.astar import (
    FAR,
    MOVES,
    RUNNING,
    Costs,
    SearchOptions,
    SearchResult,
    Status,
    StopRule,
    begin,
    legal_moves,
    unit_costs,
    weighted_heuristic,
)
from adwa_jax.native import whole

BLOCK = np.arange(9, dtype=np.int32).reshape(3, 3)  # index into MOVES of each place in a 3 × 3 neighbourhood
CENTRE = BLOCK == 4
UNROLLED = 32  # shorter loops are unrolled into single numbers by the compiler, longer ones use its vectors


class _Line(NamedTuple):
    """How a row or a column of n cells lies in memory: the map's cells from index 1 to n of `length`.

    Looked through are `scanned` of them, from index `first` on: whole vectors, where the compiler uses its vectors.
    """

    length: int
    first: int
    scanned: int


class _Lane(NamedTuple):
    """What one search reads: the map with a ring (and padding) of cells that no move leads to. R, C are lengths."""

    legal: jax.Array  # [R, C] int32, bit i set where MOVES[i] may be taken
    weighted: jax.Array  # [R, C] int32, ω·h in units of cost
    # [R, C] int32, ⌊h⌋ in the high bits, the column in the low ones. Maps whose costs fit into int32 have H + W < 5000,
    # so that both have room.
    tie: jax.Array
    start: jax.Array  # [2] int32, in ringed coordinates as all cells below
    goal: jax.Array  # [2] int32


class _Open(NamedTuple):
    """What is known of the map, and the best open cell of each row."""

    g: jax.Array  # [R, C] int32; FAR where not reached, ~g where closed: negative, so that no route improves it
    row_f: jax.Array  # [R] int32, least f of a row's open cells, FAR where it has none
    row_tie: jax.Array  # [R] int32, least `tie` among those


class _Cell(NamedTuple):
    row: jax.Array  # [] int32
    column: jax.Array  # [] int32
    g: jax.Array  # [] int32, cost from the start


class _Carry(NamedTuple):
    open: _Open
    order: jax.Array  # [R, C] int32, order of closing; -1: open or not reached
    cell: _Cell  # next to close
    expansions: jax.Array  # [] int32
    status: jax.Array  # [] int32


class _Walk(NamedTuple):
    """A place on the way back from the goal."""

    cell: _Cell
    path: jax.Array  # [2·H·W, 2] int32; the path's cells fill the first half from its end, the goal all else
    cells: jax.Array  # [] int32
    diagonal: jax.Array  # [] int32, diagonal steps


def search_lanes(blocked: jax.Array, start_cell: jax.Array, goal_cell: jax.Array, weight: jax.Array,
                 options: SearchOptions) -> SearchResult:
    """`astar.search` for B lanes; every output has a leading axis B. Lanes know nothing of each other.

    blocked: [B, H, W] bool; start_cell, goal_cell: [B, 2] int32 (row, col); weight: [B, H, W] float32, ω ≤ 16. One call
    keeps one core busy: split the lanes over as many calls as there are cores. Not to be vmapped.
    Raises ValueError where the map is too large for int32 costs to be ordered exactly.
    """
    costs = unit_costs(*blocked.shape[1:])
    one = partial(_search, options=options, costs=costs)
    return whole(partial(lax.map, lambda lane: one(*lane)), (blocked, start_cell, goal_cell, weight))


def _search(blocked: jax.Array, start_cell: jax.Array, goal_cell: jax.Array, weight: jax.Array,
            options: SearchOptions, costs: Costs) -> SearchResult:
    """One lane, unbatched: as `astar.search`."""
    rows, columns = blocked.shape
    budget = options.budget if options.budget is not None else rows * columns
    lane = _lane(blocked, start_cell, goal_cell, weight, options, costs)
    choose = partial(_choose, rows=_line(rows), costs=costs, budget=budget, stop_rule=options.stop_rule)

    def cond_fun(carry: _Carry) -> jax.Array:
        return carry.status == RUNNING

    def body_fun(carry: _Carry) -> _Carry:
        carry = _expand(carry, lane, _line(columns), costs)
        cell, status = whole(choose, carry.open, carry.expansions, lane.goal)
        return carry._replace(cell=cell, status=status)

    begun = begin(blocked, start_cell, goal_cell)
    height, width = lane.legal.shape
    carry = lax.while_loop(cond_fun, body_fun, _Carry(
        open=_Open(jnp.full((height, width), FAR), jnp.full((height,), FAR), jnp.full((height,), FAR)),
        order=jnp.full((height, width), np.int32(-1)),
        cell=_Cell(begun.cell[0], begun.cell[1], begun.cell_g),
        expansions=begun.expansions,
        status=begun.status,
    ))
    return _result(carry, lane, (rows, columns), costs)


def _line(cells: int) -> _Line:
    """The layout of a row or column of so many cells."""
    if cells <= UNROLLED:
        return _Line(cells + 2, 1, cells)
    length = _rounded_up(cells + 2, 8)
    length = length if length <= 4 * UNROLLED else _rounded_up(length, UNROLLED)
    return _Line(length, 0, length)


def _rounded_up(number: int, multiple: int) -> int:
    return -(-number // multiple) * multiple


def _lane(blocked: jax.Array, start_cell: jax.Array, goal_cell: jax.Array, weight: jax.Array,
          options: SearchOptions, costs: Costs) -> _Lane:
    """The heuristic and the legal moves, computed on the bare map and then padded."""
    rows, columns = blocked.shape
    height, width = _line(rows).length, _line(columns).length
    ring = ((1, height - rows - 1), (1, width - columns - 1))
    weigh = partial(weighted_heuristic, (rows, columns), heuristic=options.heuristic, costs=costs)
    weighted, floor = whole(lambda goal, weight: weigh(goal, weight), goal_cell, weight)
    column = jnp.arange(width, dtype=jnp.int32)[None, :]
    return _Lane(
        legal=jnp.pad(legal_moves(blocked, options.corner_rule), ring),
        weighted=jnp.pad(weighted, ring),
        tie=(jnp.pad(floor, ring) << width.bit_length()) | column,
        start=start_cell + 1,
        goal=goal_cell + 1,
    )


def _expand(carry: _Carry, lane: _Lane, columns: _Line, costs: Costs) -> _Carry:
    """Close the cell, offer its neighbours a route through it, and renew the best of the three rows it touches."""
    row, column, _ = carry.cell
    block, near_f, near_tie = whole(partial(_offer, costs=costs), carry.open, carry.cell, lane)
    g = _put(carry.open.g, block, row - 1, column - 1)
    own_f, own_tie = whole(partial(_scan, columns=columns), g, row, lane.weighted, lane.tie)
    own = np.arange(3) == 1
    return carry._replace(
        open=_Open(
            g=g,
            row_f=_put(carry.open.row_f, jnp.where(own, own_f, near_f), row - 1),
            row_tie=_put(carry.open.row_tie, jnp.where(own, own_tie, near_tie), row - 1),
        ),
        order=_put(carry.order, carry.expansions[None, None], row, column),
        expansions=carry.expansions + 1,
    )


def _offer(known: _Open, cell: _Cell, lane: _Lane, costs: Costs) -> tuple[jax.Array, jax.Array, jax.Array]:
    """g of the 3 × 3 neighbourhood once its centre is closed, [3, 3], and the least f and its tie for each row, [3].

    Of the centre's own row they are not the least: the closed cell may be it.
    """
    corner = (cell.row - 1, cell.column - 1)
    allowed = (_cut(lane.legal, (1, 1), cell.row, cell.column) >> BLOCK) & 1 == 1
    old = _cut(known.g, (3, 3), *corner)
    offered = cell.g + _step_costs(costs)
    better = allowed & (offered < old)
    block = jnp.where(better, offered, jnp.where(CENTRE, ~cell.g, old))
    f = jnp.where(better, offered + _cut(lane.weighted, (3, 3), *corner), FAR)
    tie = _cut(lane.tie, (3, 3), *corner)
    old_f, old_tie = _cut(known.row_f, (3,), corner[0]), _cut(known.row_tie, (3,), corner[0])
    row_f = jnp.minimum(old_f, jnp.min(f, axis=1))
    row_tie = jnp.min(jnp.where(f == row_f[:, None], tie, FAR), axis=1)
    return block, row_f, jnp.minimum(row_tie, jnp.where(old_f == row_f, old_tie, FAR))


def _step_costs(costs: Costs) -> np.ndarray:
    """[3, 3] int32, of the moves in a neighbourhood."""
    step = np.where((MOVES != 0).all(axis=1), costs.diagonal, costs.straight)
    return step.astype(np.int32).reshape(3, 3)


def _scan(g: jax.Array, row: jax.Array, weighted: jax.Array, tie: jax.Array,
          columns: _Line) -> tuple[jax.Array, jax.Array]:
    """Least f of the open cells in a row, FAR where there are none, and the least tie among those."""

    def of_row(field: jax.Array) -> jax.Array:
        return _cut(field, (1, columns.scanned), row, columns.first)[0]

    own_g = of_row(g)
    f = jnp.where((own_g >= 0) & (own_g < FAR), own_g + of_row(weighted), FAR)
    least = _least(f)
    return least, _least(jnp.where(f == least, of_row(tie), FAR))


def _choose(known: _Open, expansions: jax.Array, goal: jax.Array, rows: _Line, costs: Costs, budget: int,
            stop_rule: StopRule) -> tuple[_Cell, jax.Array]:
    """The next cell to close, and the status: whether the search has ended."""
    height, width = known.g.shape
    scanned = slice(rows.first, rows.first + rows.scanned)
    f = _least(known.row_f[scanned])
    floor = known.row_tie[scanned] >> width.bit_length()
    keys = (floor << height.bit_length()) | jnp.arange(height, dtype=jnp.int32)[scanned]
    row = _least(jnp.where(known.row_f[scanned] == f, keys, FAR)) & _ones(height)
    column = _cut(known.row_tie, (1,), row)[0] & _ones(width)
    g = known.g[row, column]
    found = (f != FAR) & (row == goal[0]) & (column == goal[1])
    if stop_rule == "generated":
        found |= known.g[goal[0], goal[1]] != FAR
    exhausted = (expansions >= budget) | (g >= costs.limit)
    status = jnp.where(exhausted, np.int32(Status.BUDGET_EXHAUSTED), RUNNING)
    status = jnp.where(f == FAR, np.int32(Status.UNREACHABLE), status)
    return _Cell(row, column, g), jnp.where(found, np.int32(Status.FOUND), status)


def _ones(number: int) -> int:
    """The bits that hold numbers up to this one, all set."""
    return (1 << number.bit_length()) - 1


def _least(line: jax.Array) -> jax.Array:
    """[] least number of a line of `_Line.scanned` numbers.

    Folded by whole vectors, then in pairs: a reduction would be done one number after another.
    """
    if len(line) > UNROLLED:
        for width in (UNROLLED, 8) if len(line) > 4 * UNROLLED else (8,):
            line = whole(partial(_folded, width=width), line)
    return whole(_least_of_pairs, line)


def _folded(line: jax.Array, width: int) -> jax.Array:
    """[width], least of every `width`-th number."""
    return reduce(jnp.minimum, [line[at : at + width] for at in range(0, len(line), width)])


def _least_of_pairs(line: jax.Array) -> jax.Array:
    numbers = [line[at] for at in range(len(line))]
    while len(numbers) > 1:
        odd = numbers[len(numbers) // 2 * 2 :]
        numbers = [jnp.minimum(*pair) for pair in zip(numbers[::2], numbers[1::2], strict=False)] + odd
    return numbers[0]


def _cut(field: jax.Array, shape: tuple[int, ...], *corner: jax.Array | int) -> jax.Array:
    return lax.dynamic_slice(field, corner, shape, allow_negative_indices=False)


def _put(field: jax.Array, update: jax.Array, *corner: jax.Array | int) -> jax.Array:
    return lax.dynamic_update_slice(field, update, corner, allow_negative_indices=False)


def _result(carry: _Carry, lane: _Lane, shape: tuple[int, int], costs: Costs) -> SearchResult:
    """Walk back from the goal; the path then is the end of the walk's first half, and the goal repeats."""
    found = carry.status == Status.FOUND
    rows, columns = shape
    capacity = rows * columns
    parent = partial(_parent, costs=costs)

    def cond_fun(walk: _Walk) -> jax.Array:
        away = (walk.cell.row != lane.start[0]) | (walk.cell.column != lane.start[1])
        return found & away & (walk.cells < capacity)

    def body_fun(walk: _Walk) -> _Walk:
        return _step_back(walk, whole(parent, walk.cell, carry.open.g, carry.order, lane.legal), capacity, costs)

    walk = lax.while_loop(cond_fun, body_fun, _Walk(
        cell=_Cell(lane.goal[0], lane.goal[1], carry.open.g[lane.goal[0], lane.goal[1]]),
        path=jnp.broadcast_to(lane.goal[None, :] - 1, (2 * capacity, 2)),
        cells=jnp.int32(1),
        diagonal=jnp.int32(0),
    ))
    return SearchResult(
        status=carry.status,
        path=_cut(walk.path, (capacity, 2), capacity - walk.cells, 0),
        path_cells=jnp.where(found, walk.cells, 0),
        straight_steps=jnp.where(found, walk.cells - 1 - walk.diagonal, 0),
        diagonal_steps=jnp.where(found, walk.diagonal, 0),
        expansions=carry.expansions,
        expanded_at=carry.order[1 : 1 + rows, 1 : 1 + columns],
    )


def _parent(cell: _Cell, g: jax.Array, order: jax.Array, legal: jax.Array, costs: Costs) -> jax.Array:
    """[] int32 place in BLOCK of the neighbour that first gave the cell its g: the first closed of those that could."""
    corner = (cell.row - 1, cell.column - 1)
    closed_at = _cut(order, (3, 3), *corner)
    allowed = (_cut(legal, (3, 3), *corner) >> (8 - BLOCK)) & 1 == 1  # the move from there to here
    gives = ~_cut(g, (3, 3), *corner) + _step_costs(costs) == cell.g
    key = jnp.where(allowed & gives & (closed_at >= 0), closed_at, FAR)
    return jnp.min(jnp.where((key == jnp.min(key)) & (key != FAR), BLOCK, 8))


def _step_back(walk: _Walk, place: jax.Array, capacity: int, costs: Costs) -> _Walk:
    """To the neighbour at that place, which is written before the path so far."""
    down, right = place // 3 - 1, place % 3 - 1
    diagonal = (down != 0) & (right != 0)
    step = jnp.where(diagonal, np.int32(costs.diagonal), np.int32(costs.straight))
    cell = _Cell(walk.cell.row + down, walk.cell.column + right, walk.cell.g - step)
    return _Walk(
        cell=cell,
        path=_put(walk.path, jnp.stack([cell.row, cell.column])[None, :] - 1, capacity - 1 - walk.cells, 0),
        cells=walk.cells + 1,
        diagonal=walk.diagonal + diagonal.astype(jnp.int32),
    )
