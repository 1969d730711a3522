"""The built firmware, for every test that runs it."""

import fcntl
import subprocess
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("fixed", derandomize=True, deadline=None)
settings.load_profile("fixed")

PROJECT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def firmware() -> Path:
    """The folder of the built firmware; skipped only where its tools cannot be installed."""
    build = PROJECT / "firmware" / "build"
    build.mkdir(exist_ok=True)
    with (build / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # one of the parallel test processes builds
        tools = subprocess.run(["sh", "scripts/firmware-tools"], cwd=PROJECT, capture_output=True)
        if tools.returncode:
            pytest.skip(tools.stderr.decode())
        subprocess.run(["make", "--silent", "--directory", "firmware"], cwd=PROJECT, check=True)
    return build
