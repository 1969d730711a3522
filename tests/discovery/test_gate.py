"""Whether an effect passes the gate."""

import numpy as np
import pytest

from muscle_bayes.discovery.gate import Gate, gate_of


def test_gain_and_error_are_those_of_blocks() -> None:
    difference = np.array([1.0, 2.0, 3.0, 6.0, 9.0])
    blocks = np.array([0, 0, 1, 4, -1])
    found = gate_of(difference, blocks, "blocks")
    sums = np.array([3.0, 3.0, 6.0])
    assert found.gain == pytest.approx(sums.sum())
    assert found.se == pytest.approx(np.sqrt(3.0) * sums.std(ddof=1))


def test_one_clear_part_is_enough_unless_the_other_speaks_against_it() -> None:
    clear, dim, against = (
        Gate(20.0, 4.0, "runs"),
        Gate(100.0, 65.0, "blocks"),
        Gate(-9.0, 3.0, "runs"),
    )
    assert clear.weighed_with(dim) is clear
    assert dim.weighed_with(clear).passed
    assert not dim.passed
    assert clear.weighed_with(against) is against
    assert not against.passed
