"""What is built holds what it needs, and runs from where it is installed."""

import os
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
SOURCE = PROJECT / "src" / "muscle_bayes"
VERSION = tomllib.loads((PROJECT / "pyproject.toml").read_text())["project"]["version"]


@pytest.fixture(scope="module")
def dist(tmp_path_factory) -> Path:
    """Folder of wheel and sdist, built without network."""
    out = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "hatchling", "build", "-d", str(out))
    return out


def run(*command: str, **variables: str) -> str:
    told = subprocess.run(
        command, cwd=PROJECT, env=os.environ | variables, capture_output=True, text=True
    )
    assert told.returncode == 0, told.stdout + told.stderr
    return told.stdout


def test_the_wheel_holds_the_whole_package_and_no_more(dist):
    (wheel,) = dist.glob("*.whl")
    held = set(zipfile.ZipFile(wheel).namelist())
    source = {
        f"muscle_bayes/{path.relative_to(SOURCE).as_posix()}"
        for path in SOURCE.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert source <= held
    assert "muscle_bayes/py.typed" in held
    assert "muscle_bayes/example_data/spring-1.csv" in held
    about = f"muscle_bayes-{VERSION}.dist-info/"
    assert {name.split("/")[0] for name in held} == {"muscle_bayes", about.rstrip("/")}
    assert f"{about}licenses/LICENCE" in held


def test_the_sdist_holds_what_tests_and_bench_need(dist):
    (archive,) = dist.glob("*.tar.gz")
    with tarfile.open(archive) as tar:
        held = {name.partition("/")[2] for name in tar.getnames()}
    for name in (
        "CHANGELOG.md",
        "CITATION.cff",
        "LICENCE",
        "Makefile",
        "requirements.lock",
        "data/sawtooth.csv",
        "docs/conf.py",
        "firmware/Makefile",
        "firmware/src/safety.c",
        "notebooks/01_quick_start.py",
        "tests/packaging/test_package.py",
    ):
        assert name in held
    assert not any("__pycache__" in name for name in held)
    reports = {name.split("/")[1] for name in held if name.startswith("reports/")}
    assert reports <= {".gitignore", "calibration", "trial"}


def test_the_installed_command_runs(dist, tmp_path):
    (wheel,) = dist.glob("*.whl")
    quiet = ("--quiet", "--disable-pip-version-check", "--no-deps", "--no-index", "--no-compile")
    run(sys.executable, "-m", "pip", "install", *quiet, "--target", str(tmp_path), str(wheel))
    told = run(str(tmp_path / "bin" / "muscle-bayes"), "--help", PYTHONPATH=str(tmp_path))
    assert "discover" in told
    where = run(
        sys.executable,
        "-c",
        "import muscle_bayes; print(muscle_bayes.__file__)",
        PYTHONPATH=str(tmp_path),
    )
    assert where.startswith(str(tmp_path))
    code = "import muscle_bayes as mb; (run,) = mb.load_example('sawtooth'); print(run.path)"
    assert run(sys.executable, "-c", code, PYTHONPATH=str(tmp_path)).startswith(str(tmp_path))
    version = run(str(tmp_path / "bin" / "muscle-bayes"), "--version", PYTHONPATH=str(tmp_path))
    assert version.split()[-1] == VERSION


def test_citation_and_changelog_tell_the_version():
    assert f"version: {VERSION}" in (PROJECT / "CITATION.cff").read_text().splitlines()
    assert f"## {VERSION}" in (PROJECT / "CHANGELOG.md").read_text()
