"""The window's drawing, without a window."""

import os

from fake_bench import RIG
from matplotlib.figure import Figure

from muscle_bayes.bench.recording.live_plot import SHOWN, draw, newest
from muscle_bayes.bench.recording.run_file import Row, RunFile
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
    above, below = figure.axes
    (angle,) = above.lines
    assert angle.get_xdata()[0] > 998.0 - SHOWN
    assert angle.get_xdata()[-1] == 998.0
    assert angle.get_ydata()[-1] == (549 - 512) * 0.0058
    assert len(below.lines) == 4


def test_the_run_written_last_is_taken(tmp_path):
    for age, name in enumerate(["x-again", "x", "other"]):
        path = write(tmp_path, name, 3, 0.03)
        os.utime(path, (1e9 - age, 1e9 - age))
    assert newest(tmp_path, ["x", "y"]).stem == "x-again"
    assert newest(tmp_path, ["y"]) is None
