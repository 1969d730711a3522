"""What a case is judged against."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from benchmarks.trial.outcome import error_of_reading


@pytest.mark.parametrize("noise", [0.25, 0.8])
def test_the_error_of_a_reading_is_noise_and_rounding(noise: float) -> None:
    rng = np.random.default_rng(0)
    runs = []
    for period in (900.0, 2000.0, 5000.0):
        exact = 500.0 + 80.0 * np.sin(2.0 * np.pi * np.arange(20_000) / period)
        reading = np.round(exact + noise * rng.standard_normal(exact.size))
        table = pd.DataFrame({"reading": reading})
        runs.append(SimpleNamespace(table=table, output_sensor=SimpleNamespace(resolution=1.0)))
    expected = np.sqrt(noise**2 + 1.0 / 12.0)
    assert error_of_reading(runs) == pytest.approx(expected, rel=0.05)
