"""33 Hz without a lost sample."""

import dataclasses

import pytest

from benchmarks.bench_test import streaming
from benchmarks.bench_test.streaming import expected_samples, stream

pytestmark = pytest.mark.usefixtures("firmware")


def check(report, duration):
    assert report.samples >= expected_samples(duration)
    assert report.lost == 0
    assert report.rate == pytest.approx(1000 / 30, rel=1e-6)
    assert report.jitter < 1e-4
    assert report.stamp_error < 1e-4
    assert report.jitter > 0
    assert 0.002 < report.latency_median < 0.01
    assert report.latency_most < 0.02


def test_one_minute_of_samples_is_whole():
    check(stream(60.0), 60.0)


@pytest.mark.slow
def test_thirty_minutes_of_samples_are_whole():
    check(stream(1800.0), 1800.0)


def test_a_lost_sample_would_be_counted(monkeypatch):
    class Lossy(streaming.Board):
        def poll(self):
            messages = super().poll()
            return [m for m in messages if getattr(m, "number", None) not in (20, 21, 40)]

    monkeypatch.setattr(streaming, "Board", Lossy)
    report = stream(3.0)
    assert report.lost == 3
    assert dataclasses.asdict(report)["jitter"] < 1e-4
