"""The window's drawing, without a window."""

import os

import pytest
from fake_bench import RIG
from matplotlib.figure import Figure

from muscle_bayes.bench.recording.live_plot import SHOWN, draw, newest
from muscle_bayes.bench.recording.log_row import Row
from muscle_bayes.bench.recording.run_file import RunFile
from muscle_bayes.bench.sequences.sequence import Sequence, Stage
from muscle_bayes.data import read_run


def write(folder, name, rows, period):
    metadata = Sequence(stage=(Stage(duration=1.0),)).metadata("measured", RIG, 0.1, "")
    file = RunFile(folder, name, metadata)
    for n in range(rows):
        file.append(
            Row(n * period, 25.0 + n % 3, 40.0, False, None, None, False, True, 500 + n // 10)
        )
    file.close()
    return file.path


def test_newest_part_is_drawn(tmp_path):
    path = write(tmp_path, "x", 500, 2.0)
    figure = Figure()
    draw(figure, read_run(path))
    above, below, duty = figure.axes
    (angle,) = above.lines
    assert angle.get_xdata()[0] > 998.0 - SHOWN
    assert angle.get_xdata()[-1] == 998.0
    assert angle.get_ydata()[-1] == (549 - 512) * 0.0058
    assert [line.get_label() for line in below.lines] == ["A: 26.0 °C", "setpoint A"]
    assert duty.get_ylabel() == "duty [0-255]"
    assert figure.get_suptitle() == "x, 16:38"


@pytest.mark.parametrize(
    ("events", "running", "state", "trouble"),
    [
        (
            [{"event": "stage", "time": 900.0, "number": 2, "what": "A 64 C", "to_go": 200.0}],
            True,
            "x, 16:38, stage 2: A 64 C, about 1:42 to go",
            "",
        ),
        ([], False, "x, 16:38, no rows are written any more", ""),
        (
            [{"event": "end", "reason": "all stages done"}],
            False,
            "x, 16:38, over: all stages done",
            "",
        ),
        ([{"event": "trouble", "what": ["no meter"]}], True, "x, 16:38", "heaters off: no meter"),
        (
            [{"event": "trouble", "what": ["no meter"]}, {"event": "trouble over"}],
            True,
            "x, 16:38",
            "",
        ),
    ],
)
def test_state_and_trouble_stand_above(tmp_path, events, running, state, trouble):
    figure = Figure()
    draw(figure, read_run(write(tmp_path, "x", 500, 2.0)), events, running=running)
    assert figure.get_suptitle() == state
    assert figure.axes[0].get_title() == trouble


def test_a_latched_fault_and_the_fan_are_shown(tmp_path):
    metadata = Sequence(stage=(Stage(duration=1.0),)).metadata("measured", RIG, 0.1, "")
    file = RunFile(tmp_path, "y", metadata)
    for n in range(20):
        row = Row(n, 25.0, 40.0, False, None, None, False, True, 500, (n, 0), 4, n > 9)
        file.append(row)
    file.close()
    figure = Figure()
    draw(figure, read_run(file.path))
    angle, _, duty = figure.axes
    assert "by the heat model" in angle.get_title()
    assert [text.get_text() for text in duty.texts] == ["grey: fan"]


def test_the_run_written_last_is_taken(tmp_path):
    for age, name in enumerate(["x-again", "x", "other"]):
        path = write(tmp_path, name, 3, 0.03)
        os.utime(path, (1e9 - age, 1e9 - age))
    assert newest(tmp_path, ["x", "y"]).stem == "x-again"
    assert newest(tmp_path, ["y"]) is None
