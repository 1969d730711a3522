"""The recorder against the real firmware in simavr: what the boards do, the host meets."""

import numpy as np
import pytest

from muscle_bayes.bench.boards.messages import ResetCause
from muscle_bayes.bench.recording.guard import RecordingError
from muscle_bayes.bench.recording.run_file import read_events
from muscle_bayes.bench.recording.session import Session
from muscle_bayes.bench.sequences.sequence import Limits, Sequence, Stage
from muscle_bayes.bench.simulation import SimulatedBench, TwinPlant
from muscle_bayes.bench.simulation.recording import (
    SimulatedOperator,
    rig_tables,
    simulated_devices,
)
from muscle_bayes.data import read_run
from muscle_bayes.twin.plant.rig import Rig

pytestmark = pytest.mark.usefixtures("firmware")
SEQUENCE = Sequence(
    name="run",
    load=0.1,
    limits=Limits(reconnect_time=5.0),
    stage=(Stage(setpoint_a=85.0, duration=12.0),),
)


class Trial:
    """One recording on a simulated bench; `at` lets things happen to it."""

    def __init__(self, folder):
        self.folder = folder
        self.bench = SimulatedBench(TwinPlant(load=0.1))
        self.duties = []
        self.bench.listeners.append(
            lambda now: self.duties.append((now / 1000, max(self.bench.heater.duties)))
        )
        self.operator = SimulatedOperator(self.bench, 0.1)
        self.session = Session(
            SEQUENCE,
            folder / "sequence.toml",
            folder,
            simulated_devices(self.bench),
            self.operator,
            origin="synthetic",
            rig=rig_tables(Rig()),
            load=0.1,
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.bench.close()

    def at(self, time, act):
        def listen(milliseconds):
            if milliseconds == round(1000 * time):
                act()

        self.bench.listeners.append(listen)

    def record(self):
        self.session.devices.open()
        (outcome,) = self.session.record()
        return outcome

    @property
    def run(self):
        return read_run(self.folder / "run.csv")

    def events(self, kind):
        return [e for e in read_events(self.folder / "run.csv") if e["event"] == kind]

    def heated_between(self, start, end):
        return any(duty for now, duty in self.duties if start <= now <= end)


@pytest.fixture
def trial(tmp_path):
    with Trial(tmp_path) as built:
        yield built


@pytest.mark.parametrize(
    ("cause", "told"), [(ResetCause.BROWN_OUT, "sagged"), (ResetCause.WATCHDOG, "hung")]
)
def test_heater_board_that_failed_while_heating_ends_the_run(trial, cause, told):
    trial.at(5.0, lambda: trial.bench.heater.reset(cause))
    with pytest.raises(RecordingError, match=rf"{told}.*--clear-faults.*rows are kept"):
        trial.record()
    assert not trial.heated_between(5.05, 100.0)
    assert trial.run.duration > 4.0
    trial.session.devices.heater.device.clear()  # what --clear-faults does
    assert trial.session.devices.heater.device.faults == 0


def test_heater_board_that_hangs_is_reset_by_its_watchdog_and_ends_the_run(trial):
    trial.at(5.0, lambda: trial.bench.heater.hang(interrupts=True))
    with pytest.raises(RecordingError, match="hung and was reset"):
        trial.record()
    assert not trial.heated_between(5.5, 100.0)


def test_sensor_board_that_resets_is_told_and_goes_on(trial):
    trial.at(5.0, lambda: trial.bench.sensor.reset(ResetCause.EXTERNAL))
    outcome = trial.record()
    assert outcome.complete
    assert outcome.figures["resets"] == 1
    assert trial.events("sensor board reset")[0]["cause"] == "EXTERNAL"
    assert np.diff(trial.run.table["time"]).min() > 0
    assert trial.run.duration == pytest.approx(12.0, abs=0.2)


def test_host_that_stands_still_meets_the_dead_man_and_loses_no_sample(trial):
    poll, stood = trial.operator.poll, []

    def stand_still():
        if trial.bench.clock.now() > 6.0 and not stood:
            stood.append(trial.bench.clock.now())
            trial.bench.clock.sleep(1.0)
        return poll()

    trial.operator.poll = stand_still
    outcome = trial.record()
    assert outcome.complete
    assert outcome.figures["recoveries"] == 1
    assert outcome.figures["lost"] == 0
    assert trial.run.gaps == []
    (since,) = stood
    assert trial.heated_between(since, since + 0.3)
    assert not trial.heated_between(since + 0.5, since + 1.0)
    assert trial.heated_between(since + 2.0, since + 6.0)


def test_garbled_lines_are_survived(trial):
    rng = np.random.default_rng(11)

    def garble(data):
        return bytes(b ^ (1 << int(rng.integers(8))) if rng.random() < 2e-3 else b for b in data)

    for line in (trial.bench.heater_board, trial.bench.sensor_board):
        line.garble_to = line.garble_from = garble
    outcome = trial.record()
    assert outcome.complete
    figures = outcome.figures
    assert figures["garbled"] == pytest.approx(figures["lost"], abs=5)
    assert 5 < figures["lost"] < 60
    assert trial.run.repairs == ()


def test_pulled_and_plugged(trial):
    trial.at(5.0, trial.bench.heater_board.pull)
    trial.at(7.0, trial.bench.heater_board.plug)
    outcome = trial.record()
    assert outcome.complete
    assert not trial.heated_between(5.5, 6.9)
    assert trial.heated_between(9.0, 12.0)
    assert trial.run.gaps == []  # the sensor board was there all the time
    assert len(trial.events("heater board lost")) == 1
    assert len(trial.events("heater board is back")) == 1
