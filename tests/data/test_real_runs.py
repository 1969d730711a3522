"""The real measurements, read as they are."""

import numpy as np
import pytest

from muscle_bayes.data import read_run, read_runs

pytestmark = pytest.mark.real


def test_encoder_grid_of_the_drops(real_data):
    runs = read_runs([real_data / "xl330-drop"])
    assert [run.name for run in runs] == ["drop-1", "drop-2", "drop-3", "drop-4"]
    for run in runs:
        assert run.repairs == ()
        assert run.unit == "rad"
        assert run.sensor.resolution == pytest.approx(2 * np.pi / 4096, rel=1e-4)
        assert set(run.table["temperature_a"]) == {25.0}


def test_axis_driven_by_a_known_force(real_data):
    run = read_run(real_data / "emps" / "training.csv")
    assert len(run.table) == 24841
    assert run.duration == pytest.approx(24.84)
    assert run.table["applied"][0] == 89.234432
    assert run.coordinate.max() == pytest.approx(0.24637775)
    assert run.repairs == ()


def test_late_blocks_of_the_heating_wire(real_data):
    run = read_run(real_data / "heating-wire" / "two-cycles-200g.toml")
    time = run.table["time"].to_numpy()
    (repair,) = run.repairs
    assert (repair.rule, repair.count, repair.first_row) == ("displaced block", 7, 15762)
    # Only the late blocks move: the clock elsewhere is the log's own.
    assert time[-1] == 317.208
    assert np.diff(time).min() > 0.0045
    assert np.diff(time).max() == pytest.approx(0.047)
    assert run.sensor.sign == -1
    assert set(run.table["load"]) == {0.2}
    assert run.table["setpoint_a"].isna().all()
