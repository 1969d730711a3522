"""Board time on the host's clock, against a simulated line whose delays are known."""

import numpy as np
import pytest

from muscle_bayes.bench.boards.clock import WRAP, BoardClock, RealClock

PERIOD = 0.03


def stamps(rng, *, rate=1.0, offset=0.0, duration=300.0, latency=0.004, pauses=()):
    """True times, stamps and latencies of samples of a board that runs `rate` times too fast."""
    clock = BoardClock()
    true = np.arange(0.0, duration, PERIOD)
    arrival = true + 0.001 + rng.exponential(latency, true.size)
    for start, length in pauses:
        held = (arrival >= start) & (arrival < start + length)
        arrival[held] = start + length
    arrival = np.maximum.accumulate(arrival)
    micros = np.rint(1e6 * (rate * true + offset)).astype(np.int64) % WRAP
    found = [clock.stamp(int(m), float(a)) for m, a in zip(micros, arrival, strict=True)]
    return clock, true, np.array([s.time for s in found]), found


@pytest.mark.parametrize("ppm", [-5000, -40, 0, 300, 5000])
def test_drift_is_followed_and_delays_do_not_enter_the_spacing(ppm):
    rng = np.random.default_rng(1)
    clock, true, time, found = stamps(rng, rate=1 + 1e-6 * ppm)
    settled = true > 60.0
    assert -1e6 * clock.rate == pytest.approx(ppm, abs=40)
    assert time[settled] - true[settled] == pytest.approx(0.001, abs=3e-3)
    assert np.diff(time)[settled[1:]] == pytest.approx(PERIOD, abs=0.011 * PERIOD)
    assert np.diff(time).min() > 0
    assert not any(stamp.step for stamp in found)


def test_wraps_are_unwrapped():
    _, true, time, found = stamps(np.random.default_rng(2), offset=WRAP / 1e6 - 50.0)
    assert time - true == pytest.approx(0.001, abs=0.02)
    assert not any(stamp.step for stamp in found)


def test_wrap_within_a_long_silence():
    clock = BoardClock()
    clock.stamp(1_000_000, 10.0)
    later = 2 * WRAP / 1e6 + 7.0
    stamp = clock.stamp(8_000_000, 10.0 + later)
    assert stamp.time == pytest.approx(10.0 + later, abs=0.1)


def test_a_host_that_was_stopped_stamps_what_had_waited_with_its_own_times():
    rng = np.random.default_rng(3)
    _, true, time, found = stamps(rng, duration=60.0, pauses=[(20.0, 5.0)])
    assert time - true == pytest.approx(0.001, abs=0.02)
    assert max(stamp.latency for stamp in found) == pytest.approx(5.0, abs=0.1)
    assert not any(stamp.step for stamp in found)


def test_board_that_was_reset_unseen_is_a_step_and_time_goes_on():
    clock = BoardClock()
    for n in range(1000):
        last = clock.stamp(round(30_000 * n) + 4_000_000, 0.03 * n)
    after = clock.stamp(50_000, 31.0)
    assert after.step != 0
    assert after.time == pytest.approx(31.0)
    assert clock.stamp(80_000, 31.03).time - after.time == pytest.approx(0.03)
    assert after.time > last.time


def test_restart_never_goes_back():
    clock = BoardClock()
    before = clock.stamp(0, 5.0)
    clock.restart()
    assert clock.stamp(0, 5.0).time > before.time


def test_real_clock_sleeps():
    clock = RealClock()
    start = clock.now()
    clock.sleep(0.01)
    clock.sleep(-1.0)
    assert clock.now() - start >= 0.01
