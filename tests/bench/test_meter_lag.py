"""The lag of a log's temperatures against meters whose digits are known."""

import numpy as np
import pytest

from muscle_bayes.bench.meters.meter import Reading
from muscle_bayes.bench.recording.rows import LEAST, LONGEST, MeterLag
from muscle_bayes.inference.records.thermometer import updates


def logged(cycle, answer, seed, changes=400):
    """Rows of a meter asked every `cycle` s that takes `answer` s; its digits change every 0.4 s or so."""
    random = np.random.default_rng(seed)
    changed = np.cumsum(random.normal(0.4, 0.02, changes))
    asked = np.arange(0.0, changed[-1], cycle)
    shown = np.searchsorted(changed, asked)  # digits: number of changes so far
    rows = np.arange(asked[1] + answer, changed[-1], 0.0301)
    newest = np.searchsorted(asked + answer, rows, side="right") - 1
    lag = MeterLag()
    for time, one in zip(rows, newest, strict=True):
        temperatures = (float(shown[one]), 25.0)
        lag.row(time, Reading(asked[one] + answer, temperatures, asked[one]))
    return lag, changed, rows, shown[newest].astype(float)


@pytest.mark.parametrize(("cycle", "answer"), [(0.031, 0.027), (0.012, 0.005), (0.09, 0.08)])
def test_is_what_the_reader_of_the_log_gets_wrong(cycle, answer):
    lag, changed, rows, values = logged(cycle, answer, seed=1)
    dated, value = updates(rows, values)
    wrong = [
        at - changed[int(number) - 1] for at, number in zip(dated, value, strict=True) if number
    ]
    assert lag.mean == pytest.approx(np.mean(wrong), abs=2e-3)
    assert lag.mean == pytest.approx(answer + 0.5 * cycle, abs=3e-3)


def test_is_not_told_from_few_changes():
    lag = MeterLag()
    for number in range(LEAST):
        lag.row(0.03 * number, Reading(0.03 * number, (20.0 + number, 25.0), 0.03 * number - 0.02))
    assert lag.mean is None  # one change fewer than rows
    lag.row(0.03 * LEAST, Reading(0.03 * LEAST, (90.0, 25.0), 0.03 * LEAST - 0.02))
    assert lag.mean == pytest.approx(0.02)


def test_gaps_readings_without_request_and_open_channels_do_not_count():
    lag = MeterLag()
    time = 0.0
    for number in range(5 * LEAST):
        time += 2.0 * LONGEST if number % 2 else 0.03
        asked = None if number % 3 == 0 else time - 0.02
        lag.row(time, Reading(time, (20.0 + number, None), asked))
    lag.row(time + 0.03, None)
    assert lag.mean is None
