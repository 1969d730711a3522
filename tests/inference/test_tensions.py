"""Tensions under which muscles stood, against the balance of torques in the twin's own geometry."""

from types import SimpleNamespace

import numpy as np
import pytest

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.data import read_run
from muscle_bayes.inference.records.tensions import log_tensions
from muscle_bayes.twin.linkage import Side


def test_a_muscle_balances_its_load() -> None:
    run = read_run("data/staircase-139g.csv")
    fixture = run.metadata.fixture
    assert fixture.disc_radius is not None
    unit = SimpleNamespace(tension=lambda length: 1.0)
    side = Side(unit, fixture.rotor_radius_a, fixture.anchor_x_a, fixture.anchor_y_a)
    loaded = run.table[run.table["load"] > 0.0]
    found = np.exp(log_tensions(run))
    assert found.size == len(loaded)
    for row in range(0, found.size, 500):
        angle = float(run.sensor.coordinate(loaded["reading"].iloc[row]))
        pull = float(loaded["load"].iloc[row]) * GRAVITY * fixture.disc_radius
        assert found[row] * abs(side.torque(angle)) == pytest.approx(pull, rel=1e-12)


def test_another_element_that_pulls_leaves_tensions_unknown() -> None:
    assert log_tensions(read_run("data/spring-1.csv")).size == 0
