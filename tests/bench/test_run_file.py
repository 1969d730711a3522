"""Rows on disk: the format, and what is left when writing fails."""

import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from fake_bench import RIG

from muscle_bayes.bench.recording.log_row import LOG_HEADER, Row, format_row
from muscle_bayes.bench.recording.run_file import (
    RESOLUTION,
    UNKNOWN_DELAY,
    RunFile,
    RunFileError,
    free_name,
    read_events,
)
from muscle_bayes.bench.sequences.sequence import Sequence, Stage
from muscle_bayes.data import complete_attempt, read_metadata, read_run


def row(number, **changes):
    values = {
        "time": 0.03 * number,
        "temperature_a": 25.04,
        "setpoint_a": 40.0,
        "stable_a": False,
        "temperature_b": None,
        "setpoint_b": None,
        "stable_b": True,
        "update": True,
        "reading": 512 + number,
    }
    return Row(**(values | changes))


@pytest.fixture
def metadata():
    return Sequence(stage=(Stage(duration=1.0),)).metadata("measured", RIG, 0.139, "by hand")


def test_row_in_the_header_s_order():
    assert format_row(row(1)) == b"0.030,25.04,40.0,0,,0.0,1,1,513,,,,\n"
    told = row(1, duties=(200, 0), faults=5, fan=True)
    assert format_row(told) == b"0.030,25.04,40.0,0,,0.0,1,1,513,200,0,5,1\n"
    assert len(LOG_HEADER) == format_row(row(1)).count(b",") + 1


def test_metadata_comes_first_and_the_log_with_two_rows(tmp_path, metadata):
    file = RunFile(tmp_path, "x", metadata)
    written = read_metadata(tmp_path / "x.toml")
    assert written.thermometer.delay is None  # unknown, as long as nobody has measured it
    assert written.thermometer.delay_uncertainty == UNKNOWN_DELAY
    assert written.potentiometer.resolution == RESOLUTION == 0.125
    assert (
        written.model_copy(update={"thermometer": None, "potentiometer": metadata.potentiometer})
        == metadata
    )
    file.append(row(0))
    assert not file.path.exists()
    file.append(row(1))
    assert file.rows == len(read_run(file.path).table) == 2
    file.append(row(2))
    assert file.rows == len(read_run(file.path).table) == 3  # before anything is closed
    file.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["x.csv", "x.events.jsonl", "x.toml"]


def test_load_changes_and_notes_replace_the_metadata_whole(tmp_path, metadata):
    file = RunFile(tmp_path, "x", metadata)
    file.change_load(0.0, 0.150)
    file.change_load(12.3456, 0.166)
    file.change_load(12.3457, 0.167)  # the same millisecond
    file.note("And so on.")
    file.tell_delay(0.04149)
    found = read_metadata(tmp_path / "x.toml")
    assert found.load.time == (0.0, 12.346)
    assert found.load.mass == (0.150, 0.167)
    assert found.notes == "by hand And so on."
    assert found.thermometer.delay == 0.041
    assert found.thermometer.delay_uncertainty > 0.0
    file.close()


def test_pour_is_told_in_steps(tmp_path, metadata):
    file = RunFile(tmp_path, "x", metadata)
    file.change_load(10.0, 0.239, 0.25)
    load = read_metadata(tmp_path / "x.toml").load
    assert load.time == (0.0, 10.025, 10.075, 10.125, 10.175, 10.225)
    assert load.mass == (0.139, 0.159, 0.179, 0.199, 0.219, 0.239)
    file.close()


def test_events(tmp_path, metadata):
    file = RunFile(tmp_path, "x", metadata)
    file.event("gap", start=1.0, causes=["é"])
    file.close()
    with (tmp_path / "x.events.jsonl").open("a") as events:
        events.write('{"event": "cut sho')
    assert read_events(file.path) == [{"event": "gap", "start": 1.0, "causes": ["é"]}]


def test_names(tmp_path, metadata):
    assert free_name(tmp_path, "x") == "x"
    for expected in ("x", "x-again", "x-again-2", "x-again-3"):
        assert free_name(tmp_path, "x") == expected
        file = RunFile(tmp_path, expected, metadata)
        assert complete_attempt(tmp_path, "x") is None
        for number in range(2):
            file.append(row(number))
        file.event("end", complete=expected == "x-again-3")
        file.close()
    assert complete_attempt(tmp_path, "x") == "x-again-3"
    assert complete_attempt(tmp_path, "x-a") is None


def test_folder_that_cannot_be_written(tmp_path, metadata):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFileError, match="cannot be written"):
        RunFile(tmp_path / "file", "x", metadata)


_FILLING = """
    import resource, sys
    sys.path.insert(0, {tests!r})
    from fake_bench import RIG
    from test_run_file import row
    from muscle_bayes.bench.recording.run_file import RunFile, RunFileError
    from muscle_bayes.bench.sequences.sequence import Sequence, Stage
    from pathlib import Path

    metadata = Sequence(stage=(Stage(duration=1.0),)).metadata("measured", RIG, 0.139, "")
    file = RunFile(Path({folder!r}), "x", metadata)
    resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))
    try:
        for number in range(10**6):
            file.append(row(number % 500, time=0.03 * number))
    except RunFileError as error:
        print(file.rows, error)
    try:
        file.change_load(1.0, 0.2)
    except RunFileError as error:
        print("metadata kept")
    file.close()
"""


@pytest.mark.parametrize("limit", range(1500, 1560, 7))
def test_no_more_room_leaves_whole_rows(tmp_path, limit):
    """The system refuses to let the file grow, at various places within a row."""
    tests = str(Path(__file__).parent)
    script = textwrap.dedent(_FILLING.format(tests=tests, folder=str(tmp_path), limit=limit))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    told = done.stdout.splitlines()
    rows = int(told[0].split()[0])
    assert "File too large" in told[0]
    assert "Fix: free space" in told[0]
    content = (tmp_path / "x.csv").read_bytes()
    assert content.endswith(b"\n")
    assert content.count(b"\n") == rows + 1
    assert len(content) > limit - 40
    run = read_run(tmp_path / "x.csv")
    assert len(run.table) == rows
    assert run.repairs == ()
