"""The way through the stages, step by step."""

import pytest

from muscle_bayes.bench.sequences.course import Course
from muscle_bayes.bench.sequences.sequence import Repeat, RunPlan, Stage
from muscle_bayes.errors import MuscleBayesError


def course(*blocks, load=0.1, timeout=100.0):
    return Course(RunPlan(name="x", load=load, stage=blocks), stage_timeout=timeout)


def passed(way, readings):
    """Stages passed through when each ends with the next of these readings."""
    stages, now = [], 0.0
    for reading in readings:
        stage = way.advance(now)
        if stage is None:
            return stages
        stages.append(stage.setpoint_a)
        now += 50.0
        assert way.is_over(now, True, reading) or way.is_over(now + 1.0, True, reading)
    return stages


def test_duration_counts_from_the_start():
    way = course(Stage(duration=5.0))
    way.advance(100.0)
    assert not way.is_over(104.9, True, 0.0)
    assert way.is_over(105.0, False, 0.0)
    assert way.advance(105.0) is None


def test_stable_then_wait():
    way = course(Stage(setpoint_a=50.0, wait=3.0))
    way.advance(0.0)
    assert not way.is_over(50.0, False, 0.0)
    assert not way.is_over(60.0, True, 0.0)
    assert not way.is_over(62.9, False, 0.0)  # noise after it was stable does not start it anew
    assert way.is_over(63.0, True, 0.0)


def test_never_stable():
    way = course(Stage(setpoint_a=50.0), timeout=30.0)
    way.advance(0.0)
    with pytest.raises(MuscleBayesError, match=r"stage 1 \(A 50 C until stable\).*30 s"):
        way.is_over(30.1, False, 0.0)


def test_a_long_wait_is_no_failure_to_settle():
    way = course(Stage(setpoint_a=50.0, wait=600.0), timeout=30.0)
    way.advance(0.0)
    assert not way.is_over(20.0, True, 0.0)
    assert not way.is_over(500.0, True, 0.0)
    assert way.is_over(620.0, True, 0.0)


def test_restart_counts_anew():
    way = course(Stage(duration=5.0))
    way.advance(0.0)
    way.restart(3.0)
    assert not way.is_over(7.9, True, 0.0)
    assert way.is_over(8.0, True, 0.0)


def test_load_is_waited_for_and_the_time_counts_from_the_key():
    way = course(Stage(duration=2.0, load=0.2))
    way.advance(0.0)
    assert way.waiting
    assert way.question.startswith("Hang 200 g")
    assert not way.is_over(50.0, True, 0.0)
    assert way.confirm(60.0).load == way.load == 0.2
    assert not way.waiting
    assert not way.is_over(61.9, True, 0.0)
    assert way.is_over(62.0, True, 0.0)


def test_pour_is_asked_for_in_its_own_words():
    way = course(Stage(duration=5.0, load=0.2, pour_time=4.0))
    way.advance(0.0)
    assert way.question == "Press a key as you begin to pour, over 4 s, up to 200 g"


def test_load_that_hangs_already_is_not_asked_for():
    way = course(Stage(duration=2.0, load=0.1))
    way.advance(0.0)
    assert not way.waiting


def test_logging_begins_with_the_first_logged_stage_and_stays():
    way = course(Stage(duration=1.0, logged=False), Stage(duration=1.0), Stage(duration=1.0))
    found = []
    for now in range(3):
        way.advance(float(now))
        found.append(way.logging)
    assert found == [False, True, True]


CYCLE = (Stage(setpoint_a=90.0), Stage(setpoint_a=25.0))


def test_repeats():
    way = course(Repeat(repeat=3, stages=CYCLE), Stage(setpoint_a=40.0))
    assert passed(way, [0.0] * 99) == [90, 25, 90, 25, 90, 25, 40]


def test_repeats_end_when_the_motion_repeats():
    way = course(Repeat(repeat=9, until_within=3.0, stages=CYCLE), Stage(setpoint_a=40.0))
    readings = [500, 450, 510, 455, 512, 456, 600, 700]
    assert passed(way, readings) == [90, 25, 90, 25, 90, 25, 40]
    assert way.total == 7


def test_repeats_end_at_their_number_where_it_never_does():
    way = course(Repeat(repeat=3, until_within=3.0, stages=CYCLE))
    assert passed(way, [500, 450, 510, 455, 520, 460, 0.0]) == [90, 25, 90, 25, 90, 25]


def test_time_to_go_shrinks_to_nothing():
    way = course(Stage(duration=10.0), Stage(setpoint_a=90.0), Stage(setpoint_a=25.0))
    way.advance(0.0)
    left = [way.time_to_go(0.0, 25.0), way.time_to_go(5.0, 25.0)]
    assert left[0] - left[1] == pytest.approx(5.0)
    way.advance(10.0)
    left.append(way.time_to_go(10.0, 25.0))
    way.advance(50.0)
    left.append(way.time_to_go(50.0, 90.0))
    assert left == sorted(left, reverse=True)
    assert 100 < left[-1] < 400
