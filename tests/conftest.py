"""Strict JAX settings for every test, and where the real data lies."""

from pathlib import Path

import jax
import pytest

jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_debug_nans", False)

DATA_FOLDER = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def data_folder() -> Path:
    if not DATA_FOLDER.is_dir():
        pytest.skip(f"real data absent: {DATA_FOLDER} is not a folder")
    return DATA_FOLDER


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--every-query", action="store_true", help="every MovingAI query, not a sample (minutes)")


@pytest.fixture(scope="session")
def every_query(request: pytest.FixtureRequest) -> bool:
    return request.config.getoption("--every-query")
