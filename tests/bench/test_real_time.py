"""`muscle-bayes record` as a process on ptys and a socket, in real time."""

import json
import os
import pty
import select
import signal
import subprocess
import sys
import termios

import numpy as np
import pytest
from fake_bench import RIG
from served_bench import ServedBench

from muscle_bayes.bench.recording.run_file import read_events
from muscle_bayes.bench.sequences.sequence import Repeat, Sequence, Stage
from muscle_bayes.bench.sequences.sequence_file import to_toml
from muscle_bayes.data import read_run

MAIN = "from muscle_bayes.cli import main; main()"


@pytest.fixture
def served():
    with ServedBench() as bench:
        yield bench


@pytest.fixture
def record(tmp_path, served):
    """Starts the command on the served bench; it is ended with the test."""
    started = []
    # A shell starts background jobs deaf to SIGINT, and children would stay so.
    usual = signal.signal(signal.SIGINT, signal.default_int_handler)

    def start(stages, pipes=subprocess.PIPE, **options):
        sequence = Sequence(load=0.1, stage=stages, **options, **RIG)
        (tmp_path / "trial.toml").write_text(to_toml(sequence))
        arguments = ["record", "trial.toml", "--out", "runs", "--json", "j"]
        arguments += ["--meter", served.meter]
        for port in served.ports:
            arguments += ["--port", port]
        process = subprocess.Popen(
            [sys.executable, "-c", MAIN, *arguments],
            cwd=tmp_path,
            stdin=pipes,
            stdout=pipes,
            stderr=pipes,
            env=os.environ | {"COLUMNS": "200"},
        )
        started.append(process)
        return process

    yield start
    signal.signal(signal.SIGINT, usual)
    for process in started:
        process.kill()
        process.wait()
        for pipe in filter(None, (process.stdin, process.stdout, process.stderr)):
            pipe.close()


def press(process):
    process.stdin.write(b" ")
    process.stdin.flush()


def asked(process, words):
    """Read the command's stderr up to a line with some words."""
    return any(words in line.decode() for line in process.stderr)


HOLD = Stage(setpoint_a=85.0, duration=60.0)


def test_records_with_keys_from_a_person(tmp_path, served, record):
    stages = (
        Stage(setpoint_a=60.0, duration=3.0),
        Repeat(repeat=1, stages=(Stage(setpoint_a=60.0, duration=1.5, load=0.166),)),
    )
    process = record(stages)
    assert asked(process, "Hang 100 g")
    assert not served.heating
    press(process)
    assert asked(process, "Hang 166 g")
    # Not at every instant: a host that the machine holds up for half a second loses its heat for as long.
    assert served.wait(lambda: served.heating, 5.0)
    press(process)
    assert process.wait(20) == 0
    assert not served.heating
    run = read_run(tmp_path / "runs" / "trial.csv")
    told = json.loads((tmp_path / "j").read_text())
    (outcome,) = told["runs"]
    assert outcome["complete"]
    assert outcome["rows"] == len(run.table)
    assert outcome["figures"]["lost"] == 0
    assert np.median(np.diff(run.table["time"])) == pytest.approx(0.03, abs=0.001)
    assert run.duration > 4.4
    assert run.metadata.load.mass == (0.1, 0.166)
    assert run.metadata.load.time[1] > 3.0 - 0.03
    start = read_events(run.path)[0]
    assert start["unix_time"] > 1.5e9


def test_in_a_terminal(tmp_path, served, record):
    """The panel is drawn, a key needs no Enter, q ends the run, the terminal is given back."""
    far, near = pty.openpty()
    before = termios.tcgetattr(near)
    process = record((HOLD,), pipes=near)
    shown = bytearray()

    def sees(words):
        while select.select([far], [], [], 0)[0]:
            shown.extend(os.read(far, 1 << 16))
        return words in shown

    assert served.wait(lambda: sees(b"press a key to begin"))
    os.write(far, b" ")
    assert served.wait(lambda: served.heating)
    assert served.wait(lambda: sees(b"setpoint"))
    assert served.wait(lambda: sees(b"85.0 C"))
    assert served.wait(lambda: (tmp_path / "runs" / "trial.csv").exists())
    os.write(far, b"q")
    assert served.wait(lambda: not served.heating, 2.0)
    assert served.wait(lambda: sees(b"stopped by the operator"))
    assert process.wait(10) == 2
    assert termios.tcgetattr(near) == before
    os.close(far)
    os.close(near)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_signals_switch_off_and_keep_the_run(tmp_path, served, record, number):
    process = record((HOLD,))
    press(process)
    assert served.wait(lambda: served.heating)
    assert served.wait(lambda: (tmp_path / "runs" / "trial.csv").exists())
    process.send_signal(number)
    assert served.wait(lambda: not served.heating, 1.0)
    assert process.wait(10) == 130
    assert served.bench.heater.faults == 0  # it was switched off, the dead-man had no need
    assert read_events(tmp_path / "runs" / "trial.csv")[-1]["reason"] == "interrupted"
    assert len(read_run(tmp_path / "runs" / "trial.csv").table) >= 2


def test_killed_host_is_the_dead_man_s_to_notice(tmp_path, served, record):
    process = record((HOLD,))
    press(process)
    assert served.wait(lambda: served.heating)
    assert served.wait(lambda: (tmp_path / "runs" / "trial.csv").exists())
    process.kill()
    assert served.wait(lambda: not served.heating, 1.0)
    read_run(tmp_path / "runs" / "trial.csv")


def test_pulled_cable_ends_in_a_message(tmp_path, served, record):
    process = record((HOLD,), limits={"reconnect_time": 1.0})
    press(process)
    assert served.wait(lambda: served.heating)
    assert served.wait(lambda: (tmp_path / "runs" / "trial.csv").exists())
    served.pull("sensor")
    assert served.wait(lambda: not served.heating, 1.0)
    _, told = process.communicate(timeout=20)
    message = told.decode()
    assert process.returncode == 2
    assert "the sensor board is away" in message
    assert "Heaters are off" in message
    assert "rows are kept in runs/trial.csv" in message
    assert "Traceback" not in message
    assert "error" in json.loads((tmp_path / "j").read_text())


def test_no_board_there_ends_in_a_message(tmp_path, served, record):
    served.bench.sensor.silent = True
    process = record((HOLD,))
    press(process)
    _, told = process.communicate(timeout=30)
    assert process.returncode == 2
    assert "no sensor board was found" in told.decode()
    assert not (tmp_path / "runs").exists()
