"""Double precision for every test of the physics."""

import jax
import pytest


@pytest.fixture(autouse=True, scope="module")
def _compiled_fast(compiled_fast: None) -> None:
    pass


@pytest.fixture(autouse=True)
def double_precision():
    with jax.enable_x64(True):
        yield
