"""Where compiled programs are kept from one process to the next."""

import os
from functools import cache
from pathlib import Path

import jax

WORTH_KEEPING = 0.5  # [s] of compiling


@cache
def keep_compiled() -> None:
    """Keep them in JAX_COMPILATION_CACHE_DIR, else in ~/.cache/adwa-jax if that can be written.

    A folder that the user has given JAX in another way is left as it is.
    """
    if jax.config.values["jax_compilation_cache_dir"] is None:
        try:
            folder = Path.home() / ".cache" / "adwa-jax"
            folder.mkdir(parents=True, exist_ok=True)
        except (OSError, RuntimeError):
            return
        jax.config.update("jax_compilation_cache_dir", str(folder))
    if "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS" not in os.environ:
        jax.config.update("jax_persistent_cache_min_compile_time_secs", WORTH_KEEPING)
