"""A pulse of heat tells a tube's gain and cooling; what cannot be is refused and not stored."""

import json

import numpy as np
import pytest
from fake_bench import FakeBench
from typer.testing import CliRunner

from muscle_bayes.bench.boards.board import Board
from muscle_bayes.bench.heat.heat_model import TubeModel
from muscle_bayes.bench.heat.tube_calibration import (
    COOLED,
    DUTY,
    PULSE,
    STILL,
    Pulse,
    calibrate_tube,
    fit_pulse,
)
from muscle_bayes.bench.simulation import SimulatedBench
from muscle_bayes.cli import app
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin.plant.heater import HeaterTube


def pulse(rate=4.5, cooling=48.0, lag=0.4, share=1.0, beside=0.0, noise=0.05):
    """Readings of a meter that measures every 0.4 s, in 0.1 C."""
    random = np.random.default_rng(1)
    tube = HeaterTube(rate, cooling, 25.0)
    time = np.arange(0.0, STILL + PULSE + COOLED, 0.05)
    duty = np.where((time >= STILL) & (time < STILL + PULSE), DUTY, 0)
    true = np.array([tube.advance(float(d), 0.05) for d in duty])
    late = np.interp(0.4 * np.floor(time / 0.4) - lag, time, true)
    late = np.round(25.0 + share * (late - 25.0) + random.normal(0, noise, time.size), 1)
    return Pulse(time, late, 25.0 + beside * (true - 25.0), duty)


@pytest.mark.parametrize(("rate", "cooling"), [(4.5, 48.0), (2.0, 48.0), (9.0, 30.0), (3.0, 90.0)])
def test_gain_and_cooling_are_found(rate, cooling):
    found = fit_pulse(pulse(rate, cooling), "A")
    assert found.tube.rate == pytest.approx(rate, rel=0.02)
    assert found.tube.cooling_time == pytest.approx(cooling, rel=0.02)
    assert found.delay == pytest.approx(0.6, abs=0.1)


@pytest.mark.parametrize(
    ("shown", "says"),
    [
        (pulse(share=0.02), "rose by 0.6 C in 15 s"),
        (pulse(beside=0.5), "warms the other thermocouple"),
        (pulse(rate=13.0), "beyond 1 to 10 C/s"),
        (pulse(cooling=300.0), "beyond 1 to 10 C/s or 10 to 100 s"),
        (pulse(noise=2.0), "depart from heating and cooling"),
    ],
)
def test_what_cannot_be_is_refused(shown, says):
    with pytest.raises(MuscleBayesError, match=says):
        fit_pulse(shown, "A")


def test_a_tube_is_measured_and_stored():
    bench = FakeBench()
    devices = bench.devices()
    devices.open()
    bench.heater.tubes = (0, 0, 0, 0)
    board, meter = devices.heater.device, devices.meter.device
    fit = calibrate_tube(board, meter, bench.clock, 1, 25.0)
    assert (fit.tube.rate, fit.tube.cooling_time) == pytest.approx((4.5, 48.0), rel=0.02)
    assert bench.heater.tubes == (0, 0, fit.tube.gain, fit.tube.cooling)
    assert bench.heater.duties == (0, 0)


@pytest.mark.parametrize(
    ("what", "says"),
    [("open", "shows OL"), ("fault", "has switched off"), ("warm", "let the tubes cool")],
)
def test_trouble_ends_it_with_the_heaters_off(what, says):
    bench = FakeBench()
    devices = bench.devices()
    devices.open()
    board, meter = devices.heater.device, devices.meter.device
    if what == "open":
        bench.at(12.0, lambda: setattr(bench.meter, "forced", (None, 25.0)))
    elif what == "warm":
        bench.tubes[0] = 55.0
    else:
        bench.at(12.0, lambda: setattr(bench.heater, "faults", 4))
    with pytest.raises(MuscleBayesError, match=says):
        calibrate_tube(board, meter, bench.clock, 0, 25.0)
    bench.clock.sleep(0.1)
    assert bench.heater.duties == (0, 0)


@pytest.mark.slow
def test_the_command_stores_it_on_the_board(firmware, tmp_path, monkeypatch):
    """The board comes uncalibrated from its maker; 15 s of heat are within its own caution."""
    benches = []

    class Kept(SimulatedBench):
        def __init__(self, *arguments, **named):
            super().__init__(*arguments, **named)
            benches.append(self)

        def close(self):
            pass

    monkeypatch.setattr("muscle_bayes.bench.simulation.SimulatedBench", Kept)
    path = tmp_path / "tubes.json"
    arguments = ["calibrate-heaters", "--simulate", "--side", "b", "--json", str(path)]
    told = CliRunner().invoke(app, arguments)
    assert told.exit_code == 0, told.output
    assert "tube B: 4.5" in told.output
    report = json.loads(path.read_text())
    assert report["B"]["tube"]["gain"] == pytest.approx(450, rel=0.02)
    (bench,) = benches
    board = Board(bench.heater_board, bench.clock)
    first, second = board.tubes()
    assert first is None
    assert second == TubeModel(**report["B"]["tube"])
    SimulatedBench.close(bench)
