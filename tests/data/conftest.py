"""A good run of the fixture, to be read or broken."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from sample_log import TOML, fixture_rows

from muscle_bayes.data import Run, read_run


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write NAME.csv and NAME.toml and give the path of the CSV."""

    def write_files(
        lines: list[str] | None = None,
        toml: str = TOML,
        content: bytes | None = None,
        name: str = "stairs",
    ) -> Path:
        path = tmp_path / f"{name}.csv"
        text = "\n".join(fixture_rows() if lines is None else lines) + "\n"
        path.write_bytes(text.encode() if content is None else content)
        path.with_suffix(".toml").write_text(toml)
        return path

    return write_files


@pytest.fixture
def read(write: Callable[..., Path]) -> Callable[..., Run]:
    """Write the files, then read them."""
    return lambda *args, **kwargs: read_run(write(*args, **kwargs))


@pytest.fixture(scope="session")
def cases() -> Path:
    """The folder of inputs that failed once; the test is skipped where it is absent."""
    beside = Path(__file__).parents[2].parent / "shared" / "cases"
    folder = Path(os.environ.get("MUSCLE_BAYES_CASES", beside))
    if not folder.is_dir():
        pytest.skip("the failing inputs are not here (set MUSCLE_BAYES_CASES)")
    return folder
