"""Zero and scale from endstops, against a known potentiometer."""

from itertools import pairwise

import numpy as np
import pytest

from muscle_bayes.bench.boards.calibration import EndstopFinder, calibrate
from muscle_bayes.errors import MuscleBayesError

STOPS = (-1.2, 1.0)


def turned(zero, scale, cycles, noise, rng, start=0.1):
    """Readings of a rotor turned to the lower stop first, held a second at each, at 50 Hz."""
    corners = [start] + [STOPS[0], STOPS[1]] * cycles + [start]
    angle = np.concatenate(
        [np.r_[np.linspace(a, b, 80), np.full(50, b)] for a, b in pairwise(corners)]
    )
    return np.rint(zero + angle / scale + rng.normal(0, noise, angle.size)).astype(int)


@pytest.mark.parametrize(("zero", "scale"), [(512.3, 0.0058), (498.8, -0.0061)])
def test_known_potentiometer_is_found(zero, scale):
    finder = EndstopFinder()
    for reading in turned(zero, scale, 4, 0.4, np.random.default_rng(6)):
        finder.feed(int(reading))
    assert len(finder.found) == 8
    found = calibrate(finder.found, STOPS)
    assert found.zero_reading == pytest.approx(zero, abs=3 * found.zero_error)
    assert found.radians_per_count == pytest.approx(scale, abs=3 * found.scale_error)
    assert found.zero_error < 0.5
    assert found.scale_error < 1e-5


def test_errors_are_the_propagated_ones():
    """Against the spread over many calibrations with endstop readings that scatter."""
    rng = np.random.default_rng(7)
    found = []
    for _ in range(400):
        ends = np.empty(8)
        ends[::2] = 300 + rng.normal(0, 0.8, 4)
        ends[1::2] = 700 + rng.normal(0, 0.8, 4)
        found.append(calibrate(ends.tolist(), STOPS))
    zeros = [one.zero_reading for one in found]
    scales = [one.radians_per_count for one in found]
    claimed = np.sqrt(np.mean([one.zero_error**2 for one in found]))
    rounding = np.sqrt(1 / 12)  # of each endstop's reading
    assert claimed == pytest.approx(np.hypot(np.std(zeros), 0.711 * rounding), rel=0.1)
    claimed = np.sqrt(np.mean([one.scale_error**2 for one in found]))
    share = np.mean(scales) / 400 * np.sqrt(2)
    assert claimed == pytest.approx(np.hypot(np.std(scales), share * rounding), rel=0.1)


def test_first_may_be_the_upper_endstop():
    ends = [700.0, 300.0, 700.0, 300.0]
    assert calibrate(ends, STOPS, "upper").radians_per_count == pytest.approx(2.2 / 400)
    assert calibrate(ends, STOPS, "lower").radians_per_count == pytest.approx(-2.2 / 400)


def test_where_it_begins_is_no_endstop():
    finder = EndstopFinder()
    for reading in [512] * 50 + list(range(512, 300, -1)) + [300] * 50 + list(range(300, 700)):
        finder.feed(reading)
    assert finder.found == [300.0]


@pytest.mark.parametrize(
    ("ends", "told"),
    [
        ([300.0, 700.0, 300.0], "4 are needed"),
        ([300.0, 700.0, 340.0, 700.0], "lower endstop was read as 300, 340"),
        ([300.0, 1023.0, 300.0, 1023.0], "upper endstop reads 1023"),
        ([300.0, 310.0, 300.0, 310.0], "10 counts apart"),
    ],
)
def test_refused(ends, told):
    with pytest.raises(MuscleBayesError, match=told):
        calibrate(ends, STOPS)
