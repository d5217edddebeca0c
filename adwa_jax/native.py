"""Functions that a CPU is to run as one piece of native code."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax.experimental.xla_metadata import set_xla_metadata


def whole(function: Callable, *operands: Any) -> Any:
    """function(*operands), compiled on a CPU as one native function rather than as a kernel for each operation.

    It is a wall as well: what is inside is computed once, not once more in every operation outside that uses it, and a
    write outside that needs the outcome comes after all reads inside, so that arrays are updated in place.
    Only speed rests on the marks: a compiler that does not know them ignores them.
    """
    # A compiler fails on operands that nothing reads. So they are closed over, whereby only those read are handed in;
    # and empty ones are made inside.
    operands = jax.tree.map(lambda leaf: leaf if jnp.size(leaf) else jnp.zeros(jnp.shape(leaf), leaf.dtype), operands)
    return set_xla_metadata(jax.jit(lambda: function(*operands))(), inlineable="false", xla_cpu_small_call="true")


def total(values: jax.Array) -> jax.Array:
    """[] sum of [...] float32: `jnp.sum` becomes a call of a library, for which there is no place inside a `whole`."""
    row = values.reshape(-1, values.shape[-1])
    return folded(jnp.add, list(folded(jnp.add, list(row))))


def largest(values: jax.Array) -> jax.Array:
    """[] largest of [...] float32 that hold no NaN, as `total`."""
    row = values.reshape(-1, values.shape[-1])
    return folded(_greater, list(folded(_greater, list(row))))


def _greater(a: jax.Array, b: jax.Array) -> jax.Array:
    return jnp.where(a > b, a, b)


def folded(function: Callable, rows: list) -> Any:
    """Fold rows, neighbours first: no chain of operations is longer than it must be."""
    while len(rows) > 1:
        odd = rows[len(rows) // 2 * 2 :]
        rows = [function(*pair) for pair in zip(rows[::2], rows[1::2], strict=False)] + odd
    return rows[0]
