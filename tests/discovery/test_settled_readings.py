"""Which readings of a slow run are judged."""

import numpy as np

from muscle_bayes.discovery.conditions import is_settled

SETTLING = 30.0
TIME = np.arange(0.0, 200.0, 5.0)
LOAD = np.where((TIME >= 60.0) & (TIME < 120.0), 0.2, 0.1)
WARM = 25.0 + TIME


def test_seconds_after_each_change_of_load_are_left_out() -> None:
    after = [(change <= TIME) & (change + SETTLING >= TIME) for change in (60.0, 120.0)]
    assert np.array_equal(is_settled(TIME, LOAD, WARM), ~(after[0] | after[1]))


def test_runs_of_one_load_or_without_heat_are_judged_whole() -> None:
    assert is_settled(TIME, np.full(TIME.size, 0.1), WARM).all()
    assert is_settled(TIME, LOAD, np.full(TIME.size, 25.0)).all()
