"""Temperatures in a log of their own, on a clock of its own."""

from pathlib import Path

import numpy as np
import pytest

from muscle_bayes.data import Run, RunError, read_run
from muscle_bayes.data.second_log import ALIGNED
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.records.open_delay import with_open_delay

AHEAD = 137.3
ABOUT = """format = 1
protocol = "free"
origin = "synthetic"
[columns]
time = "t"
position = "x"
position_unit = "mm"
temperature_a = "hottest"
[fixture]
motion = "linear"
[thermometer_log]
file = "camera.txt"
time = "ms"
time_unit = "ms"
STATED
[thermometer_log.log]
separator = ";"
decimal = ","
[element_a]
kind = "muscle"
linkage = "straight"
base_length = 0.12
length_at_zero = 0.12
[load]
time = [0.0]
mass = [0.2]
"""


def heat(time: np.ndarray) -> np.ndarray:
    return 25.0 + 20.0 * (1.0 - np.cos(time / 9.0)) + 8.0 * np.sin(time / 31.0)


def written(folder: Path, stated: str = "", ahead: float = AHEAD, until: float = 300.0) -> Path:
    """A position that follows the temperature with some lag, and a camera that runs longer."""
    rng = np.random.default_rng(0)
    time, camera = np.arange(0.0, 240.0, 0.1), np.arange(-40.0, until, 0.5)
    lagging = heat(time - 0.8)
    x = -0.1 * lagging - 5e-4 * lagging**2 + 0.02 * rng.standard_normal(time.size)
    rows = [f"{t:.1f},{q:.3f}" for t, q in zip(time, x, strict=True)]
    (folder / "pull.csv").write_text("\n".join(["t,x", *rows]))
    seen = heat(camera) + 0.1 * rng.standard_normal(camera.size)
    clock = 1e3 * (camera + ahead)
    rows = [f"{ms:.0f};{c:.1f}".replace(".", ",") for ms, c in zip(clock, seen, strict=True)]
    (folder / "camera.txt").write_text("\n".join(["ms;hottest", *rows]))
    (folder / "pull.toml").write_text(ABOUT.replace("STATED", stated))
    return folder / "pull.csv"


def error_of(run: Run) -> float:
    away = run.table["temperature_a"] - heat(run.table["time"].to_numpy())
    return float(np.sqrt(np.mean(away**2)))


def test_an_offset_that_nobody_stated_is_found_and_stays_open(tmp_path: Path) -> None:
    run = read_run(written(tmp_path))
    assert error_of(run) < 4.0  # the lag counts for the clock: as a fit may find
    (repair,) = run.repairs
    assert repair.rule == "joined log"
    found = float(repair.note.split("its clock is ")[1].split(" s")[0])
    assert found == pytest.approx(AHEAD - 0.8, abs=0.3)
    assert with_open_delay([run], ()) == ("clock-offset",)
    prior = pose([run], effects=("clock-offset",)).sites["clock-offset.delay"].prior
    assert float(prior.variance) ** 0.5 == pytest.approx(ALIGNED)


def test_an_offset_that_is_stated_is_taken(tmp_path: Path) -> None:
    run = read_run(written(tmp_path, f"offset = {AHEAD}"))
    assert error_of(run) < 0.2
    assert "as stated" in run.repairs[0].note


@pytest.mark.parametrize(
    ("stated", "until", "told"),
    [
        ("offset = 5000.0", 300.0, r"camera\.txt.*0% of the log's time.*Fix: correct"),
        (f"offset = {AHEAD}", 60.0, r"25% of the log's time"),
    ],
)
def test_a_log_that_does_not_cover_the_run(
    tmp_path: Path, stated: str, until: float, told: str
) -> None:
    with pytest.raises(RunError, match=told):
        read_run(written(tmp_path, stated, until=until))


def test_a_log_that_is_not_there(tmp_path: Path) -> None:
    log = written(tmp_path)
    (tmp_path / "camera.txt").unlink()
    with pytest.raises(RunError, match=r"camera\.txt"):
        read_run(log)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('temperature_a = "hottest"\n', "", "thermometer_log: given, but no column"),
        ('time = "ms"\n', "", "thermometer_log.*time"),
        ('time_unit = "ms"', 'time_unit = "kg"', "no unit of time"),
        ('temperature_a = "hottest"', 'temperature_a = "coldest"', r"camera\.txt.*coldest"),
    ],
)
def test_metadata_that_cannot_be(tmp_path: Path, old: str, new: str, told: str) -> None:
    log = written(tmp_path)
    about = log.with_suffix(".toml")
    about.write_text(about.read_text().replace(old, new))
    with pytest.raises(RunError, match=told):
        read_run(log)
