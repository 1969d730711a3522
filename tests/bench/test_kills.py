"""The logger killed at random moments: every run readable, at most one row lost, none damaged."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from fake_bench import RIG, FakeBench
from killed_logger import SEQUENCE
from typer.testing import CliRunner

from muscle_bayes.bench.recording.loop import StoppedError
from muscle_bayes.bench.recording.run_file import UNKNOWN_DELAY, read_events
from muscle_bayes.bench.recording.session import Session
from muscle_bayes.cli import app
from muscle_bayes.data import read_metadata, read_runs, recording_of

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def unkilled(tmp_path_factory) -> bytes:
    """The log of the same recording, let alone for longer than any trial."""
    folder = tmp_path_factory.mktemp("unkilled")
    bench = FakeBench()
    bench.operator.delay = 0.05
    bench.operator.stop_at = 150.0
    session = Session(
        SEQUENCE, folder / "s.toml", folder, bench.devices(), bench.operator, rig=RIG, load=0.1
    )
    session.devices.open()
    with pytest.raises(StoppedError):
        list(session.record())
    return (folder / "killed.csv").read_bytes()


def kill(folder: Path, trials: int, seed: int) -> list[dict]:
    command = [sys.executable, str(HERE / "killed_logger.py"), str(folder), str(trials), str(seed)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def inspected(folder: Path) -> tuple[int, str]:
    """Exit code of `muscle-bayes inspect` of a folder, and what it says, in one line."""
    told = CliRunner().invoke(app, ["inspect", str(folder)], env={"COLUMNS": "200"})
    return told.exit_code, " ".join(told.output.split())


def check(trials: list[dict], unkilled: bytes, every: int) -> dict[str, int]:
    """Assert it of every trial, of one in `every` also what `inspect` says; what the trials met."""
    met = {
        "before the log": 0,
        "within it": 0,
        "one row lost": 0,
        "load changed": 0,
        "inspected": 0,
    }
    for number, trial in enumerate(trials):
        assert trial["killed"]
        folder = Path(trial["folder"])
        log = folder / "killed.csv"
        for kept in folder.glob("*.toml"):
            read_metadata(kept)  # never half a file
        if not log.exists():
            assert trial["rows"] <= 2  # the second may have been on its way
            met["before the log"] += 1
            if number % every == 0 and folder.exists():
                code, told = inspected(folder)
                assert code == 2
                assert "Fix:" in told
                assert "Traceback" not in told
            continue
        content = log.read_bytes()
        made = recording_of(log)
        assert "no end was written" in str(made)
        assert not made.complete
        assert unkilled.startswith(content)  # not a byte of an earlier row differs
        (run,) = read_runs([folder])
        lost = trial["rows"] - len(run.table)
        assert lost in (0, 1)
        assert run.repairs == ()
        if number % every == 0:
            code, told = inspected(folder)
            assert code == 0
            assert "BROKEN OFF: no end was written" in told
            assert f"{made.stages} of {made.planned} stages were passed" in told
            met["inspected"] += 1
        if run.duration < 59.0:
            assert run.metadata.thermometer.delay is None  # not known, which is not zero
            assert run.metadata.thermometer.delay_uncertainty == UNKNOWN_DELAY
        changes = len(run.metadata.load.mass) - 1
        assert trial["changes"] - changes in (0, 1)
        times = run.metadata.load.time
        hung = [e for e in read_events(log) if e["event"] == "load"]
        assert changes - len(hung) in (0, 1)
        assert len(times) == changes + 1
        met["within it"] += 1
        met["one row lost"] += lost
        met["load changed"] += changes > 0
    return met


def test_kills(tmp_path, unkilled):
    met = check(kill(tmp_path, 24, 8), unkilled, every=4)
    assert met["within it"] >= 6
    assert met["inspected"] >= 2


@pytest.mark.slow
def test_two_hundred_kills(tmp_path, unkilled, capsys):
    trials = kill(tmp_path, 200, 9)
    assert len(trials) == 200
    met = check(trials, unkilled, every=10)
    with capsys.disabled():
        print(f"\n200 kills: {met}")
    assert met["within it"] >= 80
    assert met["before the log"] >= 8  # how many depends on how quickly the machine begins
    assert met["load changed"] >= 40
