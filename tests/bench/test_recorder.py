"""The recorder on fake boards: rows, loads, faults of every kind, and how it ends."""

import json

import numpy as np
import pytest
from fake_bench import RIG, FakeBench

from muscle_bayes.bench.heat.settling import settlings
from muscle_bayes.bench.recording.guard import RecordingError
from muscle_bayes.bench.recording.loop import StoppedError
from muscle_bayes.bench.recording.run_file import RunFileError, _Lines, read_events
from muscle_bayes.bench.recording.session import Session
from muscle_bayes.bench.sequences.sequence_file import parse_sequence
from muscle_bayes.data import read_run

HOLD = "[[stage]]\nsetpoint_a = 85.0\nduration = {}\n"


class Trial:
    """A sequence recorded on a fake bench."""

    def __init__(self, folder, toml, bench=None):
        self.bench = bench or FakeBench()
        self.folder = folder
        self.duties = []
        self.bench.clock.listeners.append(
            lambda now: self.duties.append((now, max(self.bench.heater.duties)))
        )
        named = toml if "[[run]]" in toml else f'name = "trial"\n{toml}'
        sequence = parse_sequence(named.encode(), "sequence.toml")
        self.session = Session(
            sequence,
            folder / "sequence.toml",
            folder,
            self.bench.devices(),
            self.bench.operator,
            rig=RIG,
            load=sequence.load,
        )

    def record(self):
        self.session.devices.open()
        return list(self.session.record())

    @property
    def run(self):
        return read_run(self.folder / "trial.csv")

    def events(self, kind):
        events = read_events(self.folder / "trial.csv")
        return [event for event in events if event["event"] == kind]

    def heated_between(self, start, end):
        return any(duty > 0 for now, duty in self.duties if start <= now <= end)

    @property
    def heated_after_end(self):
        clock = self.bench.clock
        before = len(self.duties)
        clock.sleep(1.0)
        return any(duty > 0 for _, duty in self.duties[before:])


def test_every_sample_is_a_row_with_the_board_s_spacing(tmp_path):
    trial = Trial(tmp_path, HOLD.format(20.0))
    (outcome,) = trial.record()
    run = trial.run
    assert outcome.complete
    assert outcome.rows == len(run.table) == pytest.approx(20.0 / 0.03, abs=3)
    assert np.diff(run.table["time"]) == pytest.approx(0.03, abs=1.1e-3)
    assert run.repairs == ()
    assert outcome.figures["lost"] == 0
    assert not trial.heated_after_end


def test_temperatures_in_the_log_are_those_that_the_meter_showed(tmp_path):
    trial = Trial(tmp_path, HOLD.format(10.0))
    shown = set()
    trial.bench.clock.listeners.append(lambda now: shown.add(trial.bench.meter._reading))
    trial.record()
    table = trial.run.table
    logged = set(zip(table["temperature_a"], table["temperature_b"], strict=True))
    assert logged <= shown
    assert len(logged) > 15


def test_the_metadata_tell_how_late_temperatures_are_logged(tmp_path):
    trial = Trial(tmp_path, HOLD.format(90.0))
    trial.record()
    found = trial.run.metadata.thermometer
    assert found is not None
    # Half a turn of question and answer until the meter is asked, and its answer.
    assert 0.0 < found.delay < 0.1
    time = trial.run.table["time"].to_numpy()
    np.testing.assert_allclose(time - trial.run.heat_time, found.delay)


def test_settles_and_moves_on(tmp_path):
    trial = Trial(tmp_path, "[[stage]]\nsetpoint_a = 40.0\n[[stage]]\nsetpoint_a = 60.0\n")
    trial.record()
    low, high = settlings(trial.run)
    assert (low.setpoint, high.setpoint) == (40.0, 60.0)
    assert low.settled
    assert high.settled


def test_load_is_asked_for_and_stands_in_the_metadata_at_the_key_press(tmp_path):
    later = "[[stage]]\nduration = 2.0\nload = 0.166\n"
    trial = Trial(tmp_path, f"load = 0.139\n{HOLD.format(3.0)}{later}")
    trial.record()
    load = trial.run.metadata.load
    assert trial.bench.operator.asked == [0.166]
    assert load.mass == (0.139, 0.166)
    assert load.time[1] == pytest.approx(3.0 + trial.bench.operator.delay, abs=0.1)
    (asked,), (hangs,) = trial.events("load asked for"), trial.events("load")
    assert hangs["time"] - asked["time"] == pytest.approx(0.3, abs=0.05)


def test_the_first_load_is_asked_for_before_the_run(tmp_path):
    trial = Trial(tmp_path, f"load = 0.139\n{HOLD.format(1.0)}")
    trial.session.load = None
    trial.record()
    assert trial.bench.operator.asked == [0.139]
    assert trial.run.metadata.load.mass == (0.139,)


def test_nobody_there_to_hang_the_load_switches_off_until_somebody_is(tmp_path):
    later = "[[stage]]\nsetpoint_a = 85.0\nduration = 5.0\nload = 0.166\n"
    limits = "[limits]\noperator_timeout = 10.0\n"
    trial = Trial(tmp_path, f"{limits}{HOLD.format(3.0)}{later}")
    trial.bench.operator.delay = 20.0
    (outcome,) = trial.record()
    assert outcome.complete
    assert trial.heated_between(4.0, 12.0)
    assert not trial.heated_between(14.0, 23.0)
    assert trial.heated_between(24.0, 28.0)
    assert trial.run.duration == pytest.approx(28.0, abs=0.2)
    assert trial.run.gaps == []


def test_stages_before_the_first_logged_one_write_nothing(tmp_path):
    trial = Trial(tmp_path, f"[[stage]]\nduration = 5.0\nlogged = false\n{HOLD.format(2.0)}")
    trial.record()
    assert trial.run.duration == pytest.approx(2.0, abs=0.1)
    assert trial.run.table["setpoint_a"].unique().tolist() == [85.0]


def test_load_poured_before_the_first_row_hangs_from_the_first_row_on(tmp_path):
    pour = "[[stage]]\nduration = 5.0\nlogged = false\nload = 0.166\npour_time = 2.0\n"
    trial = Trial(tmp_path, f"load = 0.06\n{pour}{HOLD.format(2.0)}")
    trial.record()
    load = trial.run.metadata.load
    assert (load.time, load.mass) == ((0.0,), (0.166,))


def test_pulled_sensor_cable_is_a_gap_and_switches_off(tmp_path):
    trial = Trial(tmp_path, HOLD.format(12.0))
    sensor = trial.bench.sensor
    trial.bench.at(5.0, lambda: setattr(sensor, "pulled", True))
    trial.bench.at(9.0, lambda: setattr(sensor, "pulled", False))
    (outcome,) = trial.record()
    assert outcome.complete
    assert trial.heated_between(3.0, 5.0)
    assert not trial.heated_between(5.1, 8.9)
    assert trial.heated_between(11.0, 15.0)
    ((start, end),) = trial.run.gaps
    (gap,) = trial.events("gap")
    assert (gap["start"], gap["end"]) == pytest.approx((start, end))
    assert 3.9 < end - start < 5.5
    assert "gaps" in trial.run.metadata.notes
    assert not trial.heated_after_end


@pytest.mark.parametrize("name", ["sensor", "heater", "meter"])
def test_line_that_stays_away_ends_the_run_with_the_rows_kept(tmp_path, name):
    trial = Trial(tmp_path, f"[limits]\nreconnect_time = 5.0\n{HOLD.format(60.0)}")
    trial.bench.at(6.0, lambda: setattr(getattr(trial.bench, name), "pulled", True))
    with pytest.raises(RecordingError, match=r"away.*; \d+ rows are kept in .*trial.csv") as caught:
        trial.record()
    silent = "The heater board does not answer: it switches its heaters off by itself"
    assert (silent if name == "heater" else "Heaters are off") in str(caught.value)
    assert trial.run.duration > 5.0
    assert trial.events("end")[0]["complete"] is False
    assert "ended early" in trial.run.metadata.notes
    assert not trial.heated_between(7.0, 100.0)  # a lost heater board's own dead-man: 0.4 s


def test_sensor_board_that_reboots_is_told_and_goes_on(tmp_path):
    trial = Trial(tmp_path, HOLD.format(10.0))
    trial.bench.at(4.0, lambda: trial.bench.sensor.reset())
    (outcome,) = trial.record()
    assert outcome.complete
    assert outcome.figures["resets"] == 1
    (reset,) = trial.events("sensor board reset")
    assert reset["time"] == pytest.approx(3.9, abs=0.2)
    time = trial.run.table["time"].to_numpy()
    assert np.diff(time).min() > 0
    assert time[-1] == pytest.approx(10.0, abs=0.2)  # the board's clock began anew, the log's not
    assert "resets of the sensor board" in trial.run.metadata.notes


def test_lost_samples_are_counted(tmp_path):
    trial = Trial(tmp_path, HOLD.format(6.0))
    trial.bench.at(3.0, lambda: setattr(trial.bench.sensor, "drop", 7))
    (outcome,) = trial.record()
    assert outcome.figures["lost"] == 7
    assert trial.events("samples lost")[0]["count"] == 7
    assert "7 samples lost" in trial.run.metadata.notes


def test_heater_board_that_reboots_gets_its_limits_again(tmp_path):
    trial = Trial(tmp_path, f"[limits]\nmax_duty = 200\n{HOLD.format(10.0)}")
    trial.bench.at(4.0, lambda: trial.bench.heater.reset())
    (outcome,) = trial.record()
    assert outcome.complete
    assert outcome.figures["recoveries"] == 1
    assert trial.bench.heater.limits == (200, 900, 1100)
    assert trial.heated_between(5.0, 9.0)


def test_tighter_limits_of_the_board_are_told(tmp_path):
    trial = Trial(tmp_path, HOLD.format(5.0))
    trial.bench.heater.tightest = (180, 900, 700)
    with pytest.raises(RecordingError, match=r"tighter limits.*duty 180, 70 C.*reset button"):
        trial.record()


def test_dead_man_is_cleared_a_few_times_only(tmp_path):
    trial = Trial(tmp_path, HOLD.format(30.0))
    for number in range(5):
        trial.bench.at(3.0 + 3.0 * number, lambda: setattr(trial.bench.heater, "faults", 1))
    with pytest.raises(RecordingError, match="more than 3 times"):
        trial.record()
    assert len(trial.events("heater faults")) == 4


@pytest.mark.parametrize(("fault", "told"), [(2, "above the limit"), (8, "hung"), (16, "sagged")])
def test_faults_that_a_person_has_to_look_at_end_the_run(tmp_path, fault, told):
    trial = Trial(tmp_path, HOLD.format(30.0))
    trial.bench.at(4.0, lambda: trial.bench.heater.reset(faults=fault))
    with pytest.raises(RecordingError, match=f"{told}.*--clear-faults"):
        trial.record()
    assert trial.bench.heater.faults == fault  # not cleared
    assert not trial.heated_between(4.1, 100.0)
    assert trial.run.duration > 3.0


def test_fault_at_the_start_is_not_cleared_either(tmp_path):
    trial = Trial(tmp_path, HOLD.format(5.0))
    trial.bench.heater.faults = 8
    with pytest.raises(RecordingError, match=r"hung.*no row was recorded"):
        trial.record()
    assert trial.bench.heater.faults == 8


FAULTY = {
    "silent": lambda meter: setattr(meter, "silent", True),
    "open": lambda meter: setattr(meter, "forced", (None, 25.0)),
    "absurd": lambda meter: setattr(meter, "forced", (260.0, 25.0)),
    "no reading": lambda meter: setattr(meter, "garble", lambda data: data[:-1]),
}


@pytest.mark.parametrize("fault", FAULTY)
def test_meter_that_cannot_be_trusted_switches_off_and_leaves_no_row(tmp_path, fault):
    trial = Trial(tmp_path, HOLD.format(12.0))
    meter = trial.bench.meter
    trial.bench.at(5.0, lambda: FAULTY[fault](meter))

    def mend():
        meter.silent, meter.forced, meter.garble = False, None, lambda data: data

    trial.bench.at(9.0, mend)
    (outcome,) = trial.record()
    assert outcome.complete
    assert not trial.heated_between(5.5, 9.0)
    assert trial.heated_between(11.0, 15.0)
    (trouble,) = trial.events("trouble")
    assert ("no reading" if fault == "silent" else fault) in trouble["what"][0]
    (gap,) = trial.run.gaps
    assert gap[1] - gap[0] > 2.0
    assert trial.run.table["temperature_a"].max() < 100.0


def test_stuck_meter_ends_the_run(tmp_path):
    trial = Trial(tmp_path, f"[limits]\nreconnect_time = 3.0\n{HOLD.format(100.0)}")
    trial.bench.at(3.0, lambda: setattr(trial.bench.meter, "frozen", True))
    with pytest.raises(RecordingError, match=r"stuck.*HOLD"):
        trial.record()
    assert not trial.heated_between(3.5, 20.0)
    assert max(trial.bench.tubes) < 42.0


def test_hotter_than_the_limit_ends_the_run(tmp_path):
    limits = "[limits]\nmax_temperature = 100.0\n"
    trial = Trial(tmp_path, limits + HOLD.format(60.0))
    trial.bench.at(8.0, lambda: trial.bench.tubes.__setitem__(0, 100.5))
    with pytest.raises(RecordingError, match=r"above limits\.max_temperature"):
        trial.record()
    assert not trial.heated_after_end


def test_side_without_thermocouple_stays_blank(tmp_path):
    trial = Trial(tmp_path, HOLD.format(5.0))
    trial.bench.meter.forced = (25.0, None)
    trial.record()
    assert trial.run.table["temperature_b"].unique().tolist() == [25.0]  # the reader's room
    assert trial.bench.heater.temperatures == ("250", "-")
    assert b",,0.0,0," in (tmp_path / "trial.csv").read_bytes()


def test_thermocouple_that_a_run_needs_must_be_there(tmp_path):
    trial = Trial(tmp_path, HOLD.format(5.0))
    trial.bench.meter.forced = (None, 25.0)
    with pytest.raises(RecordingError, match=r"thermocouple A: open.*plug"):
        trial.record()


def test_garbling_line_is_survived_and_counted(tmp_path):
    trial = Trial(tmp_path, HOLD.format(20.0))
    rng = np.random.default_rng(1)

    def garble(data):
        return bytes(
            byte ^ int(rng.integers(1, 256)) if rng.random() < 0.01 else byte for byte in data
        )

    trial.bench.sensor.garble = garble
    (outcome,) = trial.record()
    figures = outcome.figures
    assert outcome.complete
    assert figures["garbled"] > 50
    assert figures["lost"] > 50
    readings = trial.run.table["reading"]
    assert readings.between(449, 590).all()  # no wrong reading got through


def test_garbled_heater_line_is_survived(tmp_path):
    trial = Trial(tmp_path, HOLD.format(20.0))
    rng = np.random.default_rng(2)
    trial.bench.heater.garble = lambda data: data if rng.random() < 0.7 else data[:-3] + b"#~\n"
    (outcome,) = trial.record()
    assert outcome.complete
    assert outcome.figures["lost"] == 0


def test_operator_stops(tmp_path):
    trial = Trial(tmp_path, HOLD.format(60.0))
    trial.bench.operator.stop_at = 5.0
    with pytest.raises(StoppedError, match="stopped by the operator"):
        trial.record()
    assert trial.run.duration == pytest.approx(4.9, abs=0.2)
    assert not trial.heated_after_end


def test_interrupt_switches_off_and_keeps_the_run(tmp_path):
    trial = Trial(tmp_path, HOLD.format(60.0))

    def interrupt():
        raise KeyboardInterrupt

    trial.bench.at(5.0, interrupt)
    with pytest.raises(KeyboardInterrupt):
        trial.record()
    assert trial.bench.heater.duties == (0, 0)
    assert trial.events("end")[0]["reason"] == "interrupted"
    assert trial.run.duration > 4.0


def test_full_disk_ends_the_run_with_whole_rows(tmp_path, monkeypatch):
    trial = Trial(tmp_path, HOLD.format(60.0))
    write = _Lines.write

    def full(lines, content):
        if trial.bench.clock.now() > 5.0:
            raise OSError(28, "No space left on device")
        write(lines, content)

    monkeypatch.setattr(_Lines, "write", full)
    with pytest.raises(RecordingError, match=r"No space left.*rows.*kept.*Heaters are off"):
        trial.record()
    assert not trial.heated_after_end
    assert trial.run.repairs == ()
    assert trial.run.duration == pytest.approx(4.9, abs=0.2)


def test_stop_conditions(tmp_path):
    rest = Trial(tmp_path / "rest", "[stop]\nrest_time = 3.0\n[[stage]]\nduration = 60.0\n")
    (outcome,) = rest.record()
    assert outcome.complete
    assert outcome.reason == "at rest for 3 s"
    brief = Trial(tmp_path / "brief", f"[stop]\nduration = 4.0\n{HOLD.format(60.0)}")
    assert brief.record()[0].duration == pytest.approx(4.0, abs=0.05)
    angle = Trial(tmp_path / "angle", f"[stop]\nangle = [-1.0, -0.3]\n{HOLD.format(60.0)}")
    assert "beyond [-1.0, -0.3] rad" in angle.record()[0].reason


def test_setpoint_out_of_reach_ends_the_run(tmp_path):
    limits = "[limits]\nstage_timeout = 20.0\n"
    trial = Trial(tmp_path, f"{limits}[[stage]]\nsetpoint_a = 20.0\n")
    with pytest.raises(RecordingError, match=r"stage 1 \(A 20 C until stable\) was not stable"):
        trial.record()


def test_recorded_runs_are_left_out_and_broken_ones_recorded_again(tmp_path):
    runs = "".join(
        f'[[run]]\nname = "part-{n}"\nstage = [{{ duration = 2.0 }}]\n' for n in range(3)
    )
    first = Trial(tmp_path, runs)
    first.bench.operator.stop_at = 3.5  # within the second
    with pytest.raises(StoppedError):
        first.record()
    second = Trial(tmp_path, runs)
    assert second.session.recorded() == {"part-0": "part-0"}
    assert [outcome.name for outcome in second.record()] == ["part-1-again", "part-2"]
    third = Trial(tmp_path, runs)
    assert tuple(third.session.recorded()) == ("part-0", "part-1", "part-2")
    assert third.record() == []


def test_name_that_is_taken_is_refused(tmp_path):
    from muscle_bayes.bench.recording.run_file import RunFile

    trial = Trial(tmp_path, HOLD.format(1.0))
    trial.record()
    with pytest.raises(RunFileError, match="never replaced"):
        RunFile(tmp_path, "trial", trial.run.metadata)


def test_board_clock_off_by_half_a_percent_is_reconciled(tmp_path):
    trial = Trial(tmp_path, HOLD.format(200.0))
    trial.bench.sensor.rate = 1.005
    trial.bench.sensor.offset = 4294.0  # wraps within the run
    (outcome,) = trial.record()
    rows = len(trial.run.table)
    assert outcome.duration == pytest.approx(rows * 0.03, abs=0.05)  # the host's, not the board's
    assert outcome.figures["board_clock_ppm"] == pytest.approx(5000, abs=150)
    assert trial.events("board clock set anew") == []


def test_events_are_json_lines(tmp_path):
    trial = Trial(tmp_path, HOLD.format(2.0))
    trial.record()
    lines = (tmp_path / "trial.events.jsonl").read_text().splitlines()
    kinds = [json.loads(line)["event"] for line in lines]
    assert kinds[0] == "start"
    assert kinds[-1] == "end"
