"""Sensors that lie and hosts that heat on: no tube gets hotter than 120 C."""

import pytest

from benchmarks.bench_test.overheating import HOTTEST, TRIALS, Outcome, run
from muscle_bayes.bench.boards.messages import Fault

pytestmark = pytest.mark.usefixtures("firmware")

BY_NAME = {trial.name: trial for trial in TRIALS}
HOT_ENOUGH = 45.0
"""C that a tube may reach from the room by 15 C of heat that does not show, and what is under way."""


@pytest.mark.parametrize(
    "name",
    [
        "board: stuck at 25.0 C, full duty",
        "board: stuck, 30 ms pause every 6 s",
        "board: flickers by 0.1 C, full duty",
        "board: readings fall, full duty",
        "board: stuck, half duty",
        "board: thermocouples swapped, full duty",
    ],
)
def test_a_board_notices_that_heat_does_not_show(name):
    outcome = run(BY_NAME[name], watched=11.0)
    assert outcome.faults == Fault.SENSOR
    assert 35.0 < outcome.peak < HOT_ENOUGH


def test_a_meter_in_fahrenheit_gets_no_heat():
    outcome = run(BY_NAME["host: meter in Fahrenheit"])
    assert "in Fahrenheit" in outcome.stopped
    assert outcome.heated == 0.0


def test_a_meter_off_its_tubes_ends_the_host_s_heating():
    outcome = run(BY_NAME["host: meter off its tubes, flickers by 0.1 C"], watched=12.0)
    assert "does not show the heat" in outcome.stopped
    assert outcome.peak < HOT_ENOUGH


@pytest.mark.slow
@pytest.mark.parametrize("trial", TRIALS, ids=lambda trial: trial.name)
def test_no_tube_gets_too_hot(trial):
    for seed in range(2):
        outcome = run(trial, seed)
        print(outcome)
        assert outcome.safe, outcome


def test_what_is_safe():
    assert Outcome("x", 0, HOTTEST, 1.0, 0, "").safe
    assert not Outcome("x", 0, HOTTEST + 0.1, 1.0, 0, "").safe
    assert len(BY_NAME) == len(TRIALS)
