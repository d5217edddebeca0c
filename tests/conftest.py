"""Strict JAX settings for every test, where compiled programs are kept, and where the real data lies."""

import os
from pathlib import Path

import jax
import pytest

jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_debug_nans", False)

# In the environment, so that the command line in a process of its own keeps them there as well.
COMPILED = os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(Path(__file__).resolve().parents[1] / ".jax_cache"))
jax.config.update("jax_compilation_cache_dir", COMPILED)
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.5)

DATA_FOLDER = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def data_folder() -> Path:
    if not DATA_FOLDER.is_dir():
        pytest.skip(f"real data absent: {DATA_FOLDER} is not a folder")
    return DATA_FOLDER


def pytest_configure(config: pytest.Config) -> None:
    # Another process may be writing the entry; the program is then compiled anew.
    config.addinivalue_line("filterwarnings", "ignore:Error (reading|writing) persistent compilation cache")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--every-query", action="store_true", help="every MovingAI query, not a sample (minutes)")


@pytest.fixture(scope="session")
def every_query(request: pytest.FixtureRequest) -> bool:
    return request.config.getoption("--every-query")
