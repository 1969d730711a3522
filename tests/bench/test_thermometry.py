"""Silent, open, absurd and stuck readings are told apart, and good ones are none of them."""

import numpy as np
import pytest

from muscle_bayes.bench.thermometry import (
    ANSWERED_WITHIN,
    HALF_POWER,
    MOVED_WITHIN,
    REMEDIES,
    SILENT_AFTER,
    STUCK_AFTER,
    STUCK_AFTER_WARM,
    UNANSWERED,
    Verdict,
    Watch,
)

UPDATE = 0.4


def follow(watch, values, duty=0, start=0.0):
    """Verdict after each reading, and the time after the last."""
    found = []
    for number, value in enumerate(values):
        time = start + number * UPDATE
        watch.read(time, value)
        found.append(watch.check(time, duty))
    return found, start + len(values) * UPDATE


def test_a_heating_tube_is_good():
    rng = np.random.default_rng(5)
    time = np.arange(0, 60, UPDATE)
    rise = 25 + 65 * (1 - np.exp(-time / 15)) + rng.normal(0, 0.05, time.size)
    found, _ = follow(Watch(), np.round(rise, 1), duty=200)
    assert set(found) == {Verdict.GOOD}


def test_a_quiet_tube_at_its_setpoint_is_good_for_a_minute():
    found, _ = follow(Watch(), [90.0] * int(0.9 * STUCK_AFTER_WARM / UPDATE), duty=77)
    assert set(found) == {Verdict.GOOD}


def test_a_cold_tube_may_stay_as_it_is():
    found, _ = follow(Watch(), [25.0] * 1000, duty=0)
    assert set(found) == {Verdict.GOOD}


def test_nothing_read_is_silent():
    assert Watch().check(0.0, 0) is Verdict.SILENT


def test_no_new_reading_becomes_silent_and_comes_back():
    watch = Watch()
    watch.read(0.0, 25.0)
    assert watch.check(SILENT_AFTER - 0.01, 0) is Verdict.GOOD
    assert watch.check(SILENT_AFTER + 0.01, 0) is Verdict.SILENT
    watch.read(10.0, 80.0)
    assert watch.check(10.0, 0) is Verdict.GOOD  # long enough for any change


@pytest.mark.parametrize("value", [-0.1, 251.0, 1372.0])
def test_out_of_reach_is_absurd(value):
    watch = Watch()
    found, _ = follow(watch, [25.0, value])
    assert found == [Verdict.GOOD, Verdict.ABSURD]
    assert watch.temperature == 25.0


def test_a_jump_is_absurd_until_two_agree():
    found, _ = follow(Watch(), [25.0, 60.0, 25.1, 25.0])
    assert found == [Verdict.GOOD, Verdict.ABSURD, Verdict.ABSURD, Verdict.GOOD]


def test_open_is_open_until_two_agree():
    found, _ = follow(Watch(), [25.0, None, None, 25.2, 25.3])
    open_ = Verdict.OPEN
    assert found == [Verdict.GOOD, open_, open_, open_, Verdict.GOOD]


@pytest.mark.parametrize(("duty", "after"), [(255, STUCK_AFTER), (80, STUCK_AFTER_WARM)])
def test_the_same_digits_while_heating_are_stuck_until_they_change(duty, after):
    watch = Watch()
    readings = int(after / UPDATE) + 3
    found, time = follow(watch, [40.0] * readings, duty=duty)
    assert found[-1] is Verdict.STUCK
    assert found.index(Verdict.STUCK) * UPDATE == pytest.approx(after, abs=2 * UPDATE)
    found, time = follow(watch, [40.0] * 20, duty=0, start=time)
    assert set(found) == {Verdict.STUCK}  # heaters off do not make it trustworthy
    found, _ = follow(watch, [40.1], start=time)
    assert found == [Verdict.GOOD]


def held(value, duty):
    """A watch that has shown a tube moving up to `value` at time 0, with `duty` wanted all along."""
    watch = Watch()
    follow(watch, [value - 2.0, value - 1.0, value], duty=duty, start=-2 * UPDATE)
    return watch


def test_heat_waits_for_an_answer():
    watch = held(60.0, duty=50)
    assert not watch.overdue(ANSWERED_WITHIN - 0.01, 0.0)
    assert watch.overdue(ANSWERED_WITHIN + 0.01, 0.0)
    assert Watch().overdue(0.0, 0.0)


@pytest.mark.parametrize(
    ("duty", "error", "after"),
    [
        (HALF_POWER + 1, 0.0, MOVED_WITHIN),
        (255, 50.0, MOVED_WITHIN),
        (HALF_POWER, 1.0, MOVED_WITHIN + UNANSWERED),
        (50, 0.1, MOVED_WITHIN + UNANSWERED / 0.1),
        (50, 0.0, np.inf),
        (50, -1.0, np.inf),
    ],
)
def test_heat_waits_for_other_digits(duty, error, after):
    watch = held(60.0, duty)
    for time in np.arange(0.0, 30.0, 0.03):
        watch.read(time, 60.0)
        watch.check(time, duty)
        assert watch.overdue(time, error) is (time > after + 1e-9)
        if time > after:
            break
    watch.read(time, 60.1)
    assert not watch.overdue(time, error)


def test_a_first_burst_of_heat_is_given_without_proof():
    watch = Watch()
    follow(watch, [25.0] * 100, duty=0)
    watch.read(40.0, 25.0)
    watch.check(40.0, 255)
    assert not watch.overdue(40.0, 50.0)
    watch.read(40.4, 25.0)
    watch.check(40.4, 255)
    assert watch.overdue(40.4, 50.0)


def test_every_fault_has_a_remedy():
    assert set(REMEDIES) == set(Verdict) - {Verdict.GOOD}
