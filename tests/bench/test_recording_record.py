"""What a run's files say of how it was recorded: duties, faults, what broke off, what is missing."""

import json

import numpy as np
import pytest
from fake_bench import RIG, FakeBench
from typer.testing import CliRunner

from muscle_bayes.bench.recording.log_row import Row
from muscle_bayes.bench.recording.run_file import RunFile
from muscle_bayes.bench.recording.session import Session
from muscle_bayes.bench.sequences.sequence import Sequence, Stage
from muscle_bayes.bench.sequences.sequence_file import parse_sequence
from muscle_bayes.cli import app
from muscle_bayes.data import (
    Load,
    RunError,
    complete_attempt,
    read_run,
    recording_of,
    without_broken_off,
)


def record(folder, name, *, end=None, rows=12, states=(((200, 0), 0),)):
    """A run with these heater states by turns; `end` are the facts of its last event."""
    metadata = Sequence(stage=(Stage(duration=1.0),)).metadata("measured", RIG, 0.139, "")
    file = RunFile(folder, name, metadata)
    file.event("start", time=None, stages=3)
    for number in range(rows):
        duties, faults = states[number % len(states)]
        file.append(
            Row(
                0.03 * number, 25.0 + number, 60.0, False, None, None, False, True, 500 + number,
                duties, faults, None if faults is None else faults > 0,
            )
        )  # fmt: skip
    file.event("stage over", number=1)
    file.event("gap", start=0.1, end=2.6, causes=["thermocouple A: open"])
    file.event("gap", start=3.0, end=4.0, causes=[])
    file.event("samples lost", count=7)
    if end is not None:
        file.event("end", **end)
    file.close()
    return file.path


def test_duty_and_faults_of_every_row_are_read(tmp_path):
    states = (((200, 0), 0), (None, None), ((0, 31), 33))
    table = read_run(record(tmp_path, "x", states=states)).table
    assert table["duty_a"].tolist()[0::3] == [200.0] * 4
    assert table["duty_b"].tolist()[2::3] == [31.0] * 4
    assert table["fan"].tolist()[2::3] == [1.0] * 4
    assert table["faults"].tolist()[2::3] == [33.0] * 4
    assert np.isnan(table[["duty_a", "duty_b", "faults", "fan"]].to_numpy()[1::3]).all()


def test_a_log_without_these_columns_reads_as_unknown(tmp_path):
    path = record(tmp_path, "x")
    lines = path.read_text().splitlines()
    path.write_text("\n".join(",".join(line.split(",")[:9]) for line in lines) + "\n")
    table = read_run(path).table
    assert len(table) == 12
    assert table[["duty_a", "duty_b", "faults"]].isna().to_numpy().all()
    assert table["reading"].tolist()[:2] == [500.0, 501.0]


@pytest.mark.parametrize("cut", range(2, 14))
def test_a_last_row_that_is_cut_short_anywhere_is_dropped(tmp_path, cut):
    path = record(tmp_path, "x")
    path.write_bytes(path.read_bytes()[:-cut])
    assert len(read_run(path).table) == 11


def test_a_killed_run_says_that_no_end_was_written(tmp_path):
    made = recording_of(record(tmp_path, "x"))
    assert not made.complete
    assert (made.stages, made.planned, made.lost) == (1, 3, 7)
    assert (made.gaps, made.longest_gap, made.missing) == (2, 2.5, 3.5)
    assert str(made) == (
        "BROKEN OFF: no end was written: it was killed, or the disk was full; 1 of 3 stages were "
        "passed; 3.5 s are missing in 2 gaps, the longest 2.5 s; 7 samples lost"
    )


def test_a_run_that_broke_off_says_why(tmp_path):
    made = recording_of(record(tmp_path, "x", end={"complete": False, "reason": "interrupted"}))
    assert str(made).startswith("BROKEN OFF: interrupted; 1 of 3 stages")


def test_a_whole_run_and_one_of_another_logger(tmp_path):
    path = record(tmp_path, "x", end={"complete": True, "reason": "all stages done"})
    assert str(recording_of(path)).startswith("complete; 3.5 s are missing")
    path.with_suffix(".events.jsonl").unlink()
    assert recording_of(path) is None


def test_events_that_were_damaged_are_left_out(tmp_path):
    path = record(tmp_path, "x", end={"complete": True})
    events = path.with_suffix(".events.jsonl")
    events.write_text('7\n"x"\n{"event"\n' + events.read_text())
    assert recording_of(path).complete


BROKEN, WHOLE = {"complete": False, "reason": "q"}, {"complete": True, "reason": "done"}


def test_an_attempt_that_broke_off_gives_way_to_the_next(tmp_path):
    logs = [
        record(tmp_path, name, end=end)
        for name, end in (
            ("a", BROKEN), ("a-again", None), ("a-again-2", WHOLE), ("b", BROKEN), ("c", WHOLE),
            ("ab-again", BROKEN),
        )
    ]  # fmt: skip
    kept, left_out = without_broken_off(logs)
    assert [log.stem for log in kept] == ["a-again-2", "b", "c", "ab-again"]
    assert len(left_out) == 2
    assert "a.csv: BROKEN OFF: q" in left_out[0]
    assert "left out, a-again-2 is its later attempt" in left_out[1]
    assert complete_attempt(tmp_path, "a") == "a-again-2"
    assert complete_attempt(tmp_path, "b") is None


def test_inspect_says_what_is_missing(tmp_path):
    path = record(tmp_path, "x", rows=40)
    report = tmp_path / "report.json"
    figure = tmp_path / "x.png"
    arguments = ["inspect", str(path), "--json", str(report), "--figure", str(figure)]
    told = CliRunner().invoke(app, arguments, env={"COLUMNS": "300"})
    assert told.exit_code == 0, told.output
    assert "BROKEN OFF: no end was written" in told.output
    assert "1 of 3 stages were passed; 3.5 s are missing" in told.output
    assert json.loads(report.read_text())["runs"][0]["recording"]["lost"] == 7


@pytest.mark.parametrize(
    ("asked", "expected"), [((), ["x-again"]), (("--broken-off",), ["x", "x-again"])]
)
def test_fit_leaves_out_what_was_recorded_again(tmp_path, monkeypatch, asked, expected):
    record(tmp_path, "x", end=BROKEN)
    record(tmp_path, "x-again", end=WHOLE)
    fitted = []

    def stop(runs, *_, **__):
        fitted.extend(run.name for run in runs)
        raise RunError("enough")

    monkeypatch.setattr("muscle_bayes.inference.sampling.fit.fit", stop)
    told = CliRunner().invoke(app, ["fit", str(tmp_path), "--out", str(tmp_path / "p.nc"), *asked])
    assert sorted(fitted) == expected, told.output
    assert "x.csv: BROKEN OFF: q" in told.output


@pytest.mark.parametrize("text", ["load = 139.0", "[[stage]]\nduration = 1.0\nload = 139.0"])
def test_a_load_in_grams_is_refused(text):
    tail = "" if "stage" in text else "\n[[stage]]\nduration = 1.0"
    with pytest.raises(RunError, match=r"load: 139 kg are more than 20 kg.*write 0\.139 if 139 g"):
        parse_sequence(f"format = 1\n{text}{tail}\n".encode(), "s.toml")


def test_so_is_one_in_a_run_s_sheet(tmp_path):
    with pytest.raises(ValueError, match=r"mass: 139 kg are more than 20 kg"):
        Load(time=(0.0,), mass=(139.0,))
    assert Load(time=(0.0,), mass=(20.0,)).mass == (20.0,)
    path = record(tmp_path, "x")
    about = path.with_suffix(".toml")
    about.write_text(about.read_text().replace("mass = [0.139]", "mass = [139.0]"))
    with pytest.raises(RunError, match=r"key load.mass: 139 kg.*Fix: masses are in kg"):
        read_run(path)


def test_an_unknown_delay_is_not_taken_for_a_known_zero(tmp_path):
    run = read_run(record(tmp_path, "x"))
    assert run.metadata.thermometer.delay is None
    assert run.metadata.thermometer.delay_uncertainty > 0.0
    assert run.heat_time.tolist() == run.table["time"].tolist()
    assert "delay =" not in run.path.with_suffix(".toml").read_text()


def test_readings_are_in_eighths_and_the_noise_model_knows(tmp_path):
    path = record(tmp_path, "x")
    lines = path.read_text().splitlines()
    finer = [lines[0]] + [
        ",".join([*line.split(",")[:8], f"{500 + n / 8:g}", *line.split(",")[9:]])
        for n, line in enumerate(lines[1:])
    ]
    path.write_text("\n".join(finer) + "\n")
    run = read_run(path)
    assert run.repairs == ()
    assert run.table["reading"].tolist()[:3] == [500.0, 500.125, 500.25]
    assert run.sensor.resolution == 0.125
    about = path.with_suffix(".toml")
    about.write_text(about.read_text().replace("resolution = 0.125\n", ""))
    with pytest.raises(RunError, match="no 10-bit count"):
        read_run(path)


def test_the_fan_is_switched_by_stages_and_logged(tmp_path):
    """Also after the board has been reset, which switches it off."""
    bench = FakeBench()
    stages = (
        Stage(setpoint_a=30.0, duration=1.0),
        Stage(fan=True, duration=3.0),
        Stage(duration=1.0),
    )
    session = Session(
        Sequence(name="fan", stage=stages), tmp_path / "s.toml", tmp_path, bench.devices(),
        bench.operator, rig=RIG, load=0.0,
    )  # fmt: skip
    session.devices.open()
    bench.at(3.0, bench.heater.reset)
    list(session.record())
    table = read_run(tmp_path / "fan.csv").table
    on = table["fan"].to_numpy() == 1.0
    assert bench.heater.fan == 0
    assert 3.0 < 0.03 * on.sum() < 6.0  # the reset lets the stage begin anew
    assert set(np.diff(np.flatnonzero(on))) - {1}  # off for a moment after the reset
    assert table["fan"].notna().mean() > 0.95
