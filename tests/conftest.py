"""Fixtures that several test folders share."""

import os
from pathlib import Path

import pytest

_BESIDE_THE_PROJECT = Path(__file__).parents[1].parent / "shared" / "real"


@pytest.fixture(scope="session")
def real_data() -> Path:
    """The folder of real measurements; the test is skipped where it is absent."""
    folder = Path(os.environ.get("MUSCLE_BAYES_REAL", _BESIDE_THE_PROJECT))
    if not folder.is_dir():
        pytest.skip("the real measurements are not here (set MUSCLE_BAYES_REAL)")
    return folder
