"""A* with a heap and Python's unlimited integers.

A cost a + b·√2 is the integer a·ONE + b·ROOT2 in units of 10⁻⁴⁰: linear in (a, b), so equal costs are equal
integers whatever route made them, and fine enough that different costs keep their order on any map.
"""

import heapq
import itertools
from dataclasses import dataclass
from math import isqrt

ONE = 10**40
ROOT2 = isqrt(2 * ONE * ONE)
STEPS = ((-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (-1, 1), (1, -1), (1, 1))  # N S W E NW NE SW SE


@dataclass(frozen=True)
class Answer:
    status: str  # "FOUND", "UNREACHABLE", "BUDGET_EXHAUSTED", "BAD_START" or "BAD_GOAL"
    path: tuple = ()  # (row, col), start to goal
    straight_steps: int = 0
    diagonal_steps: int = 0
    expanded: tuple = ()  # (row, col) in the order of closing

    @property
    def expansions(self):
        return len(self.expanded)

    @property
    def cost(self):
        """Path cost in units of 1/ONE."""
        return self.straight_steps * ONE + self.diagonal_steps * ROOT2


def heuristic_cost(cell, goal, heuristic):
    """h from a cell to the goal, in units of 1/ONE."""
    down, across = abs(cell[0] - goal[0]), abs(cell[1] - goal[1])
    if heuristic == "zero":
        return 0
    if heuristic == "manhattan":
        return (down + across) * ONE
    if heuristic == "octile":
        return (max(down, across) - min(down, across)) * ONE + min(down, across) * ROOT2
    if heuristic == "euclidean":
        return root(down * down + across * across)
    raise ValueError(heuristic)


def root(number):
    """√number in units of 1/ONE; k·√2 comes out as k·ROOT2, so that ties with diagonal steps are ties."""
    whole = isqrt(number)
    if whole * whole == number:
        return whole * ONE
    half = isqrt(number // 2)
    if 2 * half * half == number:
        return half * ROOT2
    return isqrt(number * ONE * ONE)


def legal(blocked, cell, step, corner_rule):
    """Whether a step (row, col) from a free cell is allowed."""
    height, width = blocked.shape

    def free(row, column):
        return 0 <= row < height and 0 <= column < width and not blocked[row, column]

    row, column = cell
    if not free(row + step[0], column + step[1]):
        return False
    if 0 in step or corner_rule == "always":
        return True
    sides = (free(row + step[0], column), free(row, column + step[1]))
    return {"never": all, "squeeze": any}[corner_rule](sides)


def search(blocked, start, goal, weight_1024=None, *, corner_rule="never", heuristic="octile",
           stop_rule="popped", budget=None):
    """f = 1024·g + weight_1024(cell)·h: smallest f, then smallest whole part of h, then lowest index.

    weight_1024: function of a cell (row, col) giving ω in 1024ths; None is ω = 1.
    """
    height, width = blocked.shape
    start, goal = tuple(map(int, start)), tuple(map(int, goal))
    for cell, status in ((start, "BAD_START"), (goal, "BAD_GOAL")):
        if not (0 <= cell[0] < height and 0 <= cell[1] < width) or blocked[cell]:
            return Answer(status)

    def key(cell, g):
        h = heuristic_cost(cell, goal, heuristic)
        weight = 1024 if weight_1024 is None else int(weight_1024(cell))
        return (1024 * g + weight * h, h // ONE, cell[0] * width + cell[1])

    best, parent, closed, order = {start: 0}, {}, set(), []
    queue = [(key(start, 0), start)]
    found = start == goal
    while queue and not found:
        _, cell = heapq.heappop(queue)
        if cell in closed:
            continue
        if cell == goal:
            found = True
            break
        if budget is not None and len(order) == budget:
            return Answer("BUDGET_EXHAUSTED", expanded=tuple(order))
        closed.add(cell)
        order.append(cell)
        for step in STEPS:
            neighbour = (cell[0] + step[0], cell[1] + step[1])
            if not legal(blocked, cell, step, corner_rule) or neighbour in closed:
                continue
            g = best[cell] + (ONE if 0 in step else ROOT2)
            if neighbour in best and g >= best[neighbour]:
                continue
            best[neighbour], parent[neighbour] = g, cell
            heapq.heappush(queue, (key(neighbour, g), neighbour))
            if stop_rule == "generated" and neighbour == goal:
                found = True
                break
    if not found:
        return Answer("UNREACHABLE", expanded=tuple(order))
    path = [goal]
    while path[-1] != start:
        path.append(parent[path[-1]])
    path.reverse()
    diagonal = sum(a[0] != b[0] and a[1] != b[1] for a, b in itertools.pairwise(path))
    return Answer("FOUND", tuple(path), len(path) - 1 - diagonal, diagonal, tuple(order))


def cheapest_cost(blocked, start, goal, corner_rule="never"):
    """Optimal cost in units of 1/ONE by relaxing every step until nothing changes; None: no way."""
    cost = {tuple(start): 0}
    changed = True
    while changed:
        changed = False
        for cell, known in list(cost.items()):
            for step in STEPS:
                if legal(blocked, cell, step, corner_rule):
                    neighbour = (cell[0] + step[0], cell[1] + step[1])
                    g = known + (ONE if 0 in step else ROOT2)
                    if g < cost.get(neighbour, g + 1):
                        cost[neighbour] = g
                        changed = True
    return cost.get(tuple(goal))
