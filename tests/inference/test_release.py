"""A run that is called released, and moves already."""

import numpy as np
import pandas as pd
import pytest

import muscle_bayes as mb
from muscle_bayes.data import ArmElement, Columns, Metadata, Run
from muscle_bayes.data.run import COLUMNS
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.records.release import moves_at_release


def swing(first_speed: float, rate: float = 8.0, protocol: str = "spring", noise: float = 1e-3):
    """An arm that swings with `rate` [rad/s] from 0.4 rad at a first speed [rad/s]."""
    time = np.arange(0.0, 4.0, 0.02)
    q = 0.4 * np.cos(rate * time) + first_speed / rate * np.sin(rate * time)
    q += noise * np.random.default_rng(0).standard_normal(time.size)
    table = pd.DataFrame(0.0, index=range(time.size), columns=list(COLUMNS))
    table["time"], table["reading"] = time, q
    metadata = Metadata(
        protocol=protocol,
        origin="synthetic",
        columns=Columns(time="t", position="q", position_unit="rad"),
        element_a=ArmElement(mass=0.1, centre_distance=0.15),
    )
    return Run("swing", None, metadata, table)


@pytest.mark.parametrize("rate", [2.0, 8.0, 20.0])
@pytest.mark.parametrize("noise", [1e-4, 5e-3])
def test_a_release_from_rest_is_believed(rate: float, noise: float) -> None:
    assert not moves_at_release(swing(0.0, rate, noise=noise))


@pytest.mark.parametrize("speed", [-2.5, 3.0])
def test_motion_in_the_first_row_is_seen(speed: float) -> None:
    assert moves_at_release(swing(speed))


def test_the_thesis_spring_tests_start_at_rest() -> None:
    assert not any(moves_at_release(run) for run in mb.load_example("springs"))


def test_a_moving_run_that_is_called_released_is_refused() -> None:
    with pytest.raises(MuscleBayesError, match=r'swing.*already move.*Fix: set protocol = "free"'):
        pose([swing(3.0)])
    pose([swing(3.0, protocol="free")])
