"""The load schedule and the table it reports."""

from itertools import pairwise

import pytest

from muscle_bayes.twin.plant.loads import LoadSchedule


def test_table_is_relative_to_the_log_and_starts_with_what_hangs():
    loads = LoadSchedule(0.06)
    loads.change(5.0, 0.139, 0.0)
    loads.settle(5.0)
    loads.start_log(100.0)
    loads.change(112.0, 0.166, 0.0)
    assert loads.next_change() == 112.0
    assert not loads.settle(111.9)
    assert loads.settle(112.0)
    assert loads.table_until(1e9) == ([0.0, 12.0], [0.139, 0.166])
    assert loads.table_until(11.0) == ([0.0], [0.139])


def test_a_pour_is_a_fine_staircase_between_the_two_masses():
    loads = LoadSchedule(0.139)
    loads.start_log(0.0)
    loads.change(10.0, 0.166, 4.0)
    loads.settle(1e9)
    times, masses = loads.table_until(1e9)
    assert len(times) == 21
    assert times[1:] == pytest.approx([10.1 + 0.2 * n for n in range(20)])
    assert masses[0] == 0.139
    assert masses[-1] == 0.166
    steps = [after - before for before, after in pairwise(masses)]
    assert steps == pytest.approx([0.027 / 20] * 20, abs=1e-6)


def test_a_change_at_the_first_row_replaces_it():
    loads = LoadSchedule(0.1)
    loads.start_log(3.0)
    loads.change(3.0, 0.2, 0.0)
    loads.settle(3.0)
    assert loads.table_until(9.0) == ([0.0], [0.2])
