"""Meter, potentiometer and row clock."""

import numpy as np
import pytest

from muscle_bayes.twin import Logger, Meter, Potentiometer
from muscle_bayes.twin.sensors import AngleSensor, RowClock, ThermocoupleMeter


def generator(seed: int = 1) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


def test_meter_has_tenths_of_a_degree_and_holds_them():
    meter = ThermocoupleMeter(Meter(), generator())
    seen, updates = [], []
    for tick in range(20_000):
        meter.poll(tick * 0.03, (60.04, 25.0))
        seen.append(meter.readings[0])
        updates.append(meter.updated)
        meter.updated = False
    tenths = np.array(seen) * 10
    assert tenths == pytest.approx(np.rint(tenths), abs=1e-9)
    changed = np.diff(seen) != 0
    assert not np.any(changed & ~np.array(updates[1:]))
    gaps = np.diff(np.flatnonzero(updates)) * 0.03
    assert gaps.mean() == pytest.approx(0.4, abs=0.03)
    assert gaps.min() > 0.3
    kept = np.array(seen)[updates]
    assert kept.mean() == pytest.approx(60.04, abs=0.01)
    assert kept.std() == pytest.approx(np.hypot(0.05, 0.1 / np.sqrt(12)), rel=0.15)


def test_readings_are_rounded_noisy_counts():
    sensor = AngleSensor(Potentiometer(), 511.3, generator())
    angles = np.linspace(0.1, 0.2, 20_000)
    reads = np.array([sensor.read(angle) for angle in angles.tolist()])
    assert reads.dtype.kind == "i"
    errors = reads - (511.3 + angles / 0.0058)
    assert errors.mean() == pytest.approx(0.0, abs=0.02)
    assert errors.std() == pytest.approx(np.hypot(0.4, 1 / np.sqrt(12)), rel=0.03)


def test_without_noise_only_rounding_is_left():
    sensor = AngleSensor(Potentiometer(count_noise=0.0), 512.0, generator())
    assert [sensor.read(0.0058 * c) for c in (-3.0, 0.4, 0.6)] == [509, 512, 513]


def test_readings_end_at_the_converters_range():
    sensor = AngleSensor(Potentiometer(), 512.0, generator())
    assert sensor.read(9.0) == 1023
    assert sensor.read(-9.0) == 0


def test_rows_are_uneven_rising_and_sometimes_late():
    clock = RowClock(Logger(), 0.03, generator())
    times = [0.0]
    for _ in range(20_000):
        times.append(clock.after(times[-1]))
    gaps = np.diff(times)
    assert gaps.min() > 0.0
    usual = gaps[gaps < 0.08]
    assert usual.mean() == pytest.approx(0.03, rel=0.01)
    assert usual.std() == pytest.approx(0.12 * 0.03, rel=0.1)
    late = gaps[gaps > 0.1]
    assert 5 < len(late) < 60
    assert late.max() < 0.6
