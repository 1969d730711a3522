"""`hold` and `track`: the compiled controller on the simulated bench, driven, logged, and broken."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from benchmarks.bench_test.failures import ALLOWED
from muscle_bayes.bench.boards.protocol import encode
from muscle_bayes.bench.simulation.joint import build_firmware, joint_bench
from muscle_bayes.cli import app
from muscle_bayes.control.laws.gains import FeedForward, Gains, gains_header, gains_toml
from muscle_bayes.control.plant.design import Design
from muscle_bayes.data import read_run
from muscle_bayes.twin import Element, Rig

GAINS = Gains(
    law="feedforward", proportional=8000.0, integral=300.0, windup_time=30.0, filter_time=0.3,
    governor=(82.0, 107.0), feedforward=FeedForward(angle=(-0.14, 0.14), output=(-77.0, 77.0)),
)  # fmt: skip


def run(*arguments):
    return CliRunner().invoke(app, list(map(str, arguments)), env={"COLUMNS": "200"})


@pytest.fixture
def gains(firmware, tmp_path) -> Path:
    path = tmp_path / "gains.toml"
    path.write_text(gains_toml(GAINS))
    return path


@pytest.mark.parametrize("angle", [0.08, pytest.param(-0.116, marks=pytest.mark.slow)])
def test_an_angle_is_held_and_logged(gains, tmp_path, angle):
    """To a count and a half, after a minute: dry friction holds the rotor until heat frees it again."""
    told = run(
        "hold", "--angle", angle, "--gains", gains, "--duration", 60, "--out", tmp_path / "held"
    )
    assert told.exit_code == 0, told.output
    found = read_run(tmp_path / "held" / "hold.csv")
    assert np.diff(found.table["time"]) == pytest.approx(0.03, abs=2e-3)
    sensor = found.metadata.potentiometer
    wanted = round(sensor.zero_reading + angle / sensor.radians_per_count)
    assert found.table["reading"].tail(150).mean() == pytest.approx(wanted, abs=1.5)
    hotter = "b" if angle > 0.0 else "a"
    assert found.table[f"duty_{hotter}"].max() > 200
    assert found.table[f"temperature_{hotter}"].max() < 100.0
    assert "Traceback" not in run("inspect", tmp_path / "held" / "hold.csv").output


def test_a_scenario_is_tracked(gains, tmp_path):
    told = run("track", "step", "--gains", gains, "--duration", 8, "--out", tmp_path / "tracked")
    assert told.exit_code == 0, told.output
    rows = (tmp_path / "tracked" / "step.csv").read_text().splitlines()
    assert rows[0].endswith("Wanted reading")
    wanted = [int(row.rsplit(",", 1)[1]) for row in rows[1:]]
    assert wanted[0] == 512
    assert wanted[-1] == 526


@pytest.mark.parametrize(
    ("arguments", "fix"),
    [
        (("hold", "--angle", 0.05), "--gains GAINS.toml"),
        (("hold", "--angle", 9.0, "--gains", "GAINS"), "beyond the potentiometer"),
        (("hold", "--angle", 0.05, "--real"), "--rig JOINT.toml"),
        (("hold", "--angle", 0.05, "--gains", "GAINS", "--meter", "x"), "add it"),
    ],
)
def test_what_cannot_be_held_is_told(gains, tmp_path, arguments, fix):
    words = [gains if word == "GAINS" else word for word in arguments]
    told = run(*words, "--out", tmp_path / "held")
    assert told.exit_code == 2
    assert fix in told.output
    assert "Traceback" not in told.output


@pytest.fixture(scope="module")
def elf(firmware, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("joint")
    header = folder / "gains.h"
    header.write_text(gains_header(GAINS, Design()))
    return build_firmware(header, folder)


BROKEN = {"open, pulled to the supply": 1023, "shorted to GND": 0, "jumps": None}


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("broken", BROKEN)
def test_a_broken_potentiometer_switches_the_heaters_off(elf, broken, seed):
    random = np.random.default_rng([seed, *broken.encode()])
    with joint_bench(Rig(element_b=Element(kind="muscle")), elf, seed) as bench:

        def ask(milliseconds: int) -> None:
            if milliseconds % 100 == 0:
                shown = (round(10 * t) for t in bench.plant.temperatures())
                bench.heater_board.write(encode(1, "HOLD", 530, *shown))

        bench.listeners.append(ask)
        bench.clock.sleep(float(random.uniform(1.0, 3.0)))
        assert any(bench.heater.duties)
        value = BROKEN[broken]
        if value is None:
            value = bench.plant.counts() + int(random.choice([-1, 1]) * random.integers(90, 300))
        bench.listeners.append(lambda _: bench.heater.set_analog(value))
        bench.clock.sleep(ALLOWED)
        bench.heater.peaks()
        bench.clock.sleep(2.0)
        assert bench.heater.peaks() == (0, 0)
