"""The steps of "First use" in docs/bench.md, walked through on the simulated bench in their order."""

import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from muscle_bayes.bench.heat.tube_calibration import calibrate_tube
from muscle_bayes.bench.recording.loop import RecordingError
from muscle_bayes.bench.recording.session import Session
from muscle_bayes.bench.sequences.sequence import Limits, Sequence, Stage
from muscle_bayes.bench.simulation import SimulatedBench, TwinPlant
from muscle_bayes.bench.simulation.recording import (
    SimulatedOperator,
    rig_tables,
    simulated_devices,
)
from muscle_bayes.cli import app
from muscle_bayes.data import read_run

pytestmark = pytest.mark.usefixtures("firmware")
DOCS = Path(__file__).parents[2] / "docs" / "bench.md"
LAMP, PORTB = 1 << 5, 0x25
STEPS = 8


@pytest.fixture(scope="module")
def bench(firmware):
    """New boards on which nothing was ever done."""
    with SimulatedBench(TwinPlant(load=0.060, seed=3), 3, calibrated=False) as bench:
        bench.clock.sleep(0.3)
        yield bench


@pytest.fixture(scope="module")
def devices(bench):
    devices = simulated_devices(bench)
    devices.open()
    return devices


def session(bench, devices, folder, *stages):
    return Session(
        Sequence(load=0.060, stage=stages, limits=Limits(reconnect_time=2.0)),
        folder / "first.toml",
        folder,
        devices,
        SimulatedOperator(bench, 0.060),
        origin="synthetic",
        rig=rig_tables(bench.plant.rig),
        load=0.060,
    )


def test_the_page_has_these_steps():
    (part,) = re.findall(r"## First use\n(.*?)\n## ", DOCS.read_text(encoding="utf-8"), re.DOTALL)
    assert len(re.findall(r"^\d+\. ", part, re.MULTILINE)) == STEPS


@pytest.mark.slow
def test_1_without_hardware(tmp_path):
    run = CliRunner()
    sequence = tmp_path / "staircase.toml"
    options = ["--mass", "0.139", "--out", str(sequence)]
    assert run.invoke(app, ["sequence", "staircase", *options]).exit_code == 0
    short = sequence.read_text().replace("format = 1", "format = 1\nstop.duration = 3.0", 1)
    sequence.write_text(short)
    told = run.invoke(app, ["record", str(sequence), "--out", str(tmp_path), "--simulate"])
    assert told.exit_code == 0, told.output
    assert (tmp_path / "staircase-139g.csv").exists()


def test_2_boards_tell_who_they_are(bench):
    for link, role in ((bench.sensor_board, b"SENSOR"), (bench.heater_board, b"HEATER")):
        link.plug()  # a terminal opens the port
        bench.clock.sleep(0.3)
        assert re.fullmatch(rb"!BOOT [\d ]+ " + role + rb"\*[0-9A-F]{4}\nw\r\n", link.read(200))


@pytest.mark.parametrize(("pin", "duties"), [(b"6", (255, 0)), (b"5", (0, 255))])
def test_3_and_4_dead_man_and_reset_button(bench, pin, duties):
    for number in (b"1", pin):
        bench.heater_board.write(number)
        bench.clock.sleep(0.02)
    assert bench.heater.duties == duties
    assert bench.heater.peek(PORTB) & LAMP
    bench.clock.sleep(0.4)
    assert bench.heater.duties == (0, 0)
    assert not bench.heater.peek(PORTB) & LAMP
    bench.heater_board.plug()  # the reset button
    assert bench.heater.duties == (0, 0)
    bench.clock.sleep(0.3)
    assert bench.heater.duties == (0, 0)


def test_5_angle():
    told = CliRunner().invoke(app, ["calibrate", "--simulate", "--cycles", "2"])
    assert told.exit_code == 0, told.output
    (scale,) = re.findall(r"radians_per_count = (\S+)", told.output)
    assert float(scale) == pytest.approx(0.0058, rel=0.01)


def test_6_each_heater_warms_its_own_thermocouple(bench, devices, tmp_path):
    for side, other in (("a", "b"), ("b", "a")):
        stage = Stage.model_validate({f"setpoint_{side}": 35.0, "duration": 12.0})
        folder = tmp_path / side
        list(session(bench, devices, folder, stage).record())
        table = read_run(folder / "first.csv").table
        rise = {at: np.ptp(table[f"temperature_{at}"]) for at in "ab"}
        assert rise[side] > 7.0
        assert table[f"duty_{other}"].max() == 0


def test_6_a_pulled_cable_ends_the_heat(bench, devices, tmp_path):
    pulled = bench.clock.now() + 4.0
    last_on = 0.0

    def watch(milliseconds):
        nonlocal last_on
        if milliseconds == round(1000 * pulled):
            bench.heater_board.pull()
        if any(bench.heater.duties):
            last_on = milliseconds / 1000

    bench.listeners.append(watch)
    with pytest.raises(RecordingError, match=r"heater board.*within 0\.5 s"):
        list(session(bench, devices, tmp_path, Stage(setpoint_a=35.0, duration=20.0)).record())
    bench.listeners.remove(watch)
    assert pulled - 0.5 < last_on <= pulled + 0.5
    devices.close()
    bench.heater_board.plug()
    bench.clock.sleep(0.5)
    devices.open()


@pytest.mark.slow
def test_7_a_tube_has_to_be_calibrated_before_it_gets_hot(bench, devices, tmp_path):
    hot = Stage(setpoint_a=60.0, duration=45.0)
    with pytest.raises(RecordingError, match=r"not calibrated.*calibrate-heaters"):
        list(session(bench, devices, tmp_path / "before", hot).record())
    bench.clock.sleep(60.0)  # until they are cold
    board, meter = devices.heater.device, devices.meter.device
    for channel in range(2):
        fit = calibrate_tube(board, meter, bench.clock, channel, 25.0)
        assert fit.tube.rate == pytest.approx(4.5, rel=0.03)
        assert fit.tube.cooling_time == pytest.approx(48.0, rel=0.05)
    list(session(bench, devices, tmp_path / "after", hot).record())
    run = read_run(tmp_path / "after" / "first.csv")
    assert run.table["temperature_a"].iloc[-1] == pytest.approx(60.0, abs=1.5)
