"""Silent, open, absurd and stuck readings are told apart, and good ones are none of them."""

import numpy as np
import pytest

from muscle_bayes.bench.heat.thermometry import (
    ANSWERED_WITHIN,
    FAR,
    HALF_POWER,
    REMEDIES,
    SILENT_AFTER,
    STUCK_AFTER,
    UNPROVEN,
    Verdict,
    Watch,
)

UPDATE = 0.4

MOVED_WITHIN = Watch().moved_within


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


def test_a_quiet_tube_near_the_room_is_good_for_minutes():
    found, _ = follow(Watch(), [27.0] * int(200.0 / UPDATE), duty=2)
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


@pytest.mark.parametrize(
    ("duty", "after"), [(255, MOVED_WITHIN + STUCK_AFTER), (80, UNPROVEN / 80 + STUCK_AFTER)]
)
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


def held(duty):
    """A watch that has shown a tube moving up to 60 C at time 0, with `duty` wanted all along."""
    watch = Watch()
    follow(watch, [58.0, 59.0, 60.0], duty=duty, start=-2 * UPDATE)
    return watch


def stands_still(watch, duty, start=0.0):
    """s at which heat begins to wait, where the meter answers for half a minute and shows 60 C."""
    for time in start + np.arange(0.0, 30.0, 0.03):
        watch.read(time, 60.0)
        watch.check(time, duty)
        if watch.waits:
            return time
    return np.inf


def test_heat_waits_for_an_answer():
    watch = held(50)
    watch.check(ANSWERED_WITHIN - 0.01, 50)
    assert not watch.waits
    watch.check(ANSWERED_WITHIN + 0.01, 50)
    assert watch.waits
    watch.read(0.5, 60.0)
    watch.check(0.5, 50)
    assert not watch.waits
    assert Watch().waits


@pytest.mark.parametrize(
    ("duty", "after"),
    [
        (255, MOVED_WITHIN),
        (HALF_POWER + 1, MOVED_WITHIN),
        (HALF_POWER, UNPROVEN / HALF_POWER),
        (20, UNPROVEN / 20),
        (10, np.inf),
        (0, np.inf),
    ],
)
def test_heat_waits_for_other_digits(duty, after):
    watch = held(duty)
    waited = stands_still(watch, duty)
    assert waited == after or 0.0 < waited - after <= 0.03 + 1e-9
    watch.read(30.0, 60.1)
    watch.check(30.0, duty)
    assert not watch.waits


def test_a_tube_near_its_setpoint_is_not_heated_hard():
    """A weak heater needs more than half power to hold, and then the digits may stand still."""
    watch = held(200)
    for time in np.arange(0.0, 1.5, 0.03):
        watch.read(time, 60.0)
        watch.check(time, 200, 60.0 + FAR)
    assert not watch.waits
    for time in np.arange(1.5, 2.1, 0.03):
        watch.read(time, 60.0)
        watch.check(time, 200, 60.0 + FAR)
    assert watch.waits  # 400 duty seconds and more


def test_less_heat_waits_on():
    """A stuck meter does not get its heat back because less of it is wanted, or none for a while."""
    watch = held(255)
    assert stands_still(watch, 255) < 0.5
    for duty in (10, 0, 255):
        watch.check(0.6, duty)
        assert watch.waits


@pytest.mark.parametrize("pause", [0, 50])
def test_pauses_are_no_proof_of_life(pause):
    """Hard heating with a pause in every fifth look: what counts is the heat since the digits moved."""
    watch = held(255)
    waited = None
    for number, time in enumerate(np.arange(0.0, 3.0, 0.03)):
        watch.read(time, 60.0)
        watch.check(time, pause if number % 5 == 0 else 255)
        if watch.waits and waited is None:
            waited = time
    assert waited == pytest.approx(MOVED_WITHIN * 5 / 4, abs=0.07)


def test_a_cold_tube_gets_one_burst_of_heat():
    watch = Watch()
    follow(watch, [60.0] * 100, duty=0)
    waited = stands_still(watch, 255, start=40.0)
    assert 40.0 + MOVED_WITHIN < waited <= 40.03 + MOVED_WITHIN


def test_every_fault_has_a_remedy():
    assert set(REMEDIES) == set(Verdict) - {Verdict.GOOD}
