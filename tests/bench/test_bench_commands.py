"""`record --simulate`, `calibrate --simulate` and `sequence` from outside, on the real firmware."""

import json
import os
import subprocess
import sys
import time

import numpy as np
import pytest
from typer.testing import CliRunner

from muscle_bayes.bench.recording.run_file import read_events
from muscle_bayes.bench.sequences.sequence_file import parse_sequence, read_sequence
from muscle_bayes.cli import app
from muscle_bayes.data import read_run

BRIEF = """
protocol = "staircase"
load = 0.06

[[stage]]
setpoint_a = 25.0
duration = 3.0

[[stage]]
setpoint_a = 34.0
load = 0.139
pour_time = 1.0
"""


def run(*arguments):
    return CliRunner().invoke(app, list(map(str, arguments)), env={"COLUMNS": "200"})


@pytest.fixture
def brief(tmp_path):
    path = tmp_path / "brief.toml"
    path.write_text(BRIEF)
    return path


@pytest.fixture(scope="module")
def recorded(firmware, tmp_path_factory):
    """Folder, output and JSON of one recording."""
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "brief.toml").write_text(BRIEF)
    facts = folder / "facts.json"
    options = ("--simulate", "--seed", 5, "--json", facts)
    result = run("record", folder / "brief.toml", "--out", folder / "runs", *options)
    assert result.exit_code == 0, result.output
    return folder, result.output, json.loads(facts.read_text())


def test_simulated_recording(recorded):
    folder, output, facts = recorded
    found = read_run(folder / "runs" / "brief.csv")
    (told,) = facts["runs"]
    assert told["complete"]
    assert told["rows"] == len(found.table)
    assert told["figures"]["lost"] == told["figures"]["gaps"] == told["figures"]["garbled"] == 0
    assert found.metadata.origin == "synthetic"
    assert "simavr" in found.metadata.notes
    load = found.metadata.load
    assert (load.mass[0], load.mass[-1], len(load.mass)) == (0.06, 0.139, 21)
    assert load.time[-1] - load.time[1] == pytest.approx(0.95)
    assert found.repairs == ()
    assert np.diff(found.table["time"]) == pytest.approx(0.03, abs=1.1e-3)
    assert facts["truth"]["rotor"]["D"] == 0.0054594
    cold, warm = told["setpoints"]
    assert (cold["setpoint"], warm["setpoint"]) == (25.0, 34.0)
    assert warm["settled"]
    assert 0.0 < warm["overshoot"] < 6.0
    assert "overshoot" in output


def test_the_rotor_answers_to_the_load_at_its_logged_time(recorded):
    folder, *_ = recorded
    found = read_run(folder / "runs" / "brief.csv")
    angle, time = found.coordinate, found.table["time"].to_numpy()
    poured = found.load_steps[-1]
    before = angle[time < found.load_steps[0]][-30:]
    loaded = angle[(time > poured) & (time < poured + 0.5)]
    assert loaded.mean() > before.mean() + 0.05
    assert np.ptp(before) < 0.02  # nothing moves before the pour that the metadata tell


def test_recorded_already_is_left_out(recorded):
    folder, *_ = recorded
    before = (folder / "runs" / "brief.csv").read_bytes()
    result = run("record", folder / "brief.toml", "--out", folder / "runs", "--simulate")
    assert result.exit_code == 0
    assert "recorded already, left out" in result.output
    assert (folder / "runs" / "brief.csv").read_bytes() == before


def test_equal_seeds_write_equal_runs(recorded, brief, tmp_path):
    folder, *_ = recorded
    out = tmp_path / "again"
    assert run("record", brief, "--out", out, "--simulate", "--seed", 5).exit_code == 0
    for name in ("brief.csv", "brief.toml", "brief.events.jsonl"):
        assert (out / name).read_bytes() == (folder / "runs" / name).read_bytes()


def test_rig_of_the_sequence_is_simulated(firmware, tmp_path):
    path = tmp_path / "long.toml"
    rig = '[element_a]\nkind = "muscle"\nbase_length = 0.09\n[potentiometer]\n'
    rig += "zero_reading = 300.0\nradians_per_count = -0.005\n"
    path.write_text(f"{rig}[[stage]]\nduration = 1.0\n")
    refused = run("record", path, "--out", tmp_path, "--simulate")
    assert refused.exit_code == 2
    assert "would go by the name of this file" in refused.stderr
    result = run("record", path, "--out", tmp_path / "runs", "--simulate")
    assert result.exit_code == 0, result.output
    found = read_run(tmp_path / "runs" / "long.csv")
    assert found.metadata.element_a.base_length == 0.09
    assert found.metadata.fixture.rotor_radius_a == 0.03  # the default rig's
    assert found.metadata.potentiometer.zero_reading == 300.0


def test_inspect_works_while_a_run_is_recorded(firmware, tmp_path):
    path = tmp_path / "hold.toml"
    path.write_text("[[stage]]\nsetpoint_a = 60.0\nduration = 400.0\n")
    main = "from muscle_bayes.cli import main; main()"
    command = [sys.executable, "-c", main, "record", str(path), "--out", "runs", "--simulate"]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        log, rows = tmp_path / "runs" / "hold.csv", []
        try:
            while len(rows) < 4 and process.poll() is None:
                time.sleep(0.3)
                if not log.exists():
                    continue
                facts = tmp_path / "facts.json"
                result = run("inspect", log, "--json", facts, "--out", tmp_path / "figures")
                assert result.exit_code == 0, result.output
                (told,) = json.loads(facts.read_text())["runs"]
                assert told["repairs"] == []
                rows.append(told["rows"])
        finally:
            process.terminate()
    assert len(rows) == 4
    assert rows == sorted(set(rows))
    assert process.returncode == 130
    assert read_events(log)[-1]["reason"] == "interrupted"


@pytest.mark.parametrize(
    ("text", "options", "told"),
    [
        ("setpoint_c = 1", (), "key setpoint_c: unknown key"),
        ("load = 1.0", (), "key stage: missing"),
        (BRIEF, ("--simulate", "--port", "x"), "--simulate has no ports"),
        (BRIEF, (), "key element_a: missing"),
        ('[element_a]\nkind = "arm"\nmass = 1.0\ncentre_distance = 0.1\n'
         "[[stage]]\nduration = 1.0", ("--simulate",), "an arm cannot be simulated"),
    ],
)  # fmt: skip
def test_mistakes_end_in_a_message(tmp_path, text, options, told):
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    result = run("record", path, "--out", tmp_path / "runs", *options)
    assert result.exit_code == 2
    assert told in result.stderr
    assert "Fix" in result.stderr
    assert not (tmp_path / "runs").exists()


def test_full_disk_ends_in_a_message(firmware, tmp_path):
    """On a file system of 64 KiB, where the system lets one be made."""
    disk = tmp_path / "disk"
    disk.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64k", "none", disk], capture_output=True
    )
    if made.returncode:
        pytest.skip("file systems cannot be mounted here")
    try:
        path = tmp_path / "hold.toml"
        path.write_text("[[stage]]\nsetpoint_a = 60.0\nduration = 400.0\n")
        result = run("record", path, "--out", disk, "--simulate")
        assert result.exit_code == 2
        assert "No space left on device" in result.stderr
        assert "Heaters are off" in result.stderr
        found = read_run(disk / "hold.csv")
        assert found.repairs == ()
        assert len(found.table) > 500
        assert sorted(os.listdir(disk)) == ["hold.csv", "hold.events.jsonl", "hold.toml"]
    finally:
        subprocess.run(["umount", disk], check=True)


def test_calibration_finds_the_simulated_potentiometer(firmware, tmp_path):
    facts = tmp_path / "facts.json"
    result = run("calibrate", "--simulate", "--seed", 3, "--cycles", 3, "--json", facts)
    assert result.exit_code == 0, result.output
    assert "[potentiometer]" in result.stdout
    found = json.loads(facts.read_text())
    from muscle_bayes.bench.simulation import TwinPlant

    plant = TwinPlant(seed=3)
    zero, scale = plant.zero_reading, plant.rig.potentiometer.radians_per_count
    assert found["zero_reading"] == pytest.approx(zero, abs=3 * found["zero_error"])
    assert found["radians_per_count"] == pytest.approx(scale, abs=3 * found["scale_error"])
    assert len(found["lower"]) == len(found["upper"]) == 3


def test_calibration_needs_the_stops():
    result = run("calibrate", "--port", "socket://127.0.0.1:1")
    assert result.exit_code == 2
    assert "--stops LOWER UPPER" in result.stderr


@pytest.mark.parametrize(
    ("name", "runs"), [("staircase", 3), ("sawtooth", 1), ("training", 1), ("t1", 6), ("t2", 256)]
)
def test_sequences(tmp_path, name, runs):
    printed = run("sequence", name, "--room", 22.0)
    assert len(parse_sequence(printed.stdout.encode(), name).runs(name)) == runs
    path = tmp_path / f"{name}.toml"
    written = run("sequence", name, "--room", 22.0, "--out", path)
    assert written.stdout.endswith(f": {runs} runs\n" if runs > 1 else ": 1 run\n")
    assert path.read_text() == printed.stdout
    again = run("sequence", name, "--out", path)
    assert again.exit_code == 2
    assert "exists" in again.stderr


def test_sequence_with_a_rig(recorded, tmp_path):
    folder, *_ = recorded
    path = tmp_path / "with-rig.toml"
    result = run("sequence", "training", "--rig", folder / "runs" / "brief.toml", "--out", path)
    assert result.exit_code == 0, result.output
    assert read_sequence(path).element_a.base_length == 0.1
