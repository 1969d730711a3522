"""Whether a run that its metadata call released from rest already moves in its first row."""

import numpy as np

from muscle_bayes.data.run import Run

FEWEST, MOST = 6, 12
"""Rows that tell a first speed, with acceleration and its change beside it."""


def moves_at_release(
    run: Run, share: float = 0.3, sureness: float = 6.0, longest: float = 0.25
) -> bool:
    """Whether the first rows show a speed that no release from rest has.

    A cubic through the first rows, at most `longest` s of them. A rotor at rest may be accelerated at
    once, so only its value and slope at the first row count.

    Args:
        run: with a position.
        share: of the run's high speed (95th percentile) that a first speed must exceed.
        sureness: number of its standard errors that it must exceed.
        longest: time that the first rows may take, s.
    """
    time, q = run.table["time"].to_numpy(), run.coordinate
    rows = int(np.clip(np.searchsorted(time, longest), FEWEST, MOST))
    if time.size < 3 * rows or time[rows - 1] > 2.0 * longest:
        return False
    powers = np.vander(time[:rows] - time[0], 4, increasing=True)
    coefficients = np.linalg.lstsq(powers, q[:rows], rcond=None)[0]
    rest = q[:rows] - powers @ coefficients
    level = max(float(rest @ rest) / (rows - 4), run.output_sensor.coordinate_resolution**2 / 12.0)
    error = np.sqrt(level * np.linalg.inv(powers.T @ powers)[1, 1])
    fast = float(np.quantile(np.abs(np.diff(q) / np.diff(time)), 0.95))
    return bool(abs(coefficients[1]) > max(sureness * error, share * fast))
