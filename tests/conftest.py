"""Fixtures that several test folders share."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

# Workers and the commands they start share what they compile; `make clean` removes it. JAX reads this
# when it is imported.
os.environ.setdefault(
    "JAX_COMPILATION_CACHE_DIR", str(Path(__file__).parents[1] / ".cache" / "compiled")
)
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")

_BESIDE_THE_PROJECT = Path(__file__).parents[1].parent / "shared" / "real"


LONGEST = {"test_discover.py", "test_api.py", "test_catalogue.py", "test_simulate.py"}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files come first: else one worker ends minutes after the others."""
    items.sort(key=lambda item: item.path.name not in LONGEST)


@pytest.fixture(scope="module", autouse=True)
def few_memory_maps() -> Iterator[None]:
    """Without this, one process that runs all tests is aborted two thirds through."""
    yield
    from muscle_bayes.compiled import forget_much_compiled_code

    forget_much_compiled_code()


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of real measurements; the test is skipped where it is absent."""
    folder = Path(os.environ.get("MUSCLE_BAYES_REAL", _BESIDE_THE_PROJECT))
    if not folder.is_dir():
        pytest.skip("the real measurements are not here (set MUSCLE_BAYES_REAL)")
    return folder


@pytest.fixture(scope="module")
def compiled_fast() -> Iterator[None]:
    """Compile with little optimising: for tests that compile much and compute little."""
    import jax

    jax.config.update("jax_disable_most_optimizations", True)
    yield
    jax.config.update("jax_disable_most_optimizations", False)
