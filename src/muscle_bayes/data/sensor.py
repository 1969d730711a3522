"""The position sensor: log readings <-> rotor coordinate."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from muscle_bayes.data.describing.metadata import Metadata
from muscle_bayes.data.units import unit_of

_MOST_DIGITS = 12
"""After which a number counts as printed in full."""
_FEWEST_LEVELS = 8
"""That tell a grid from significant digits: of few, the large may end in zeros by chance."""
ZERO_UNCERTAINTY = 2.0
"""Standard uncertainty of a sensor's zero where none is told, steps of its readings."""
_ROUNDING = 1e-12
"""Of numbers that fill all their digits, relative to the largest."""


@dataclass(frozen=True)
class Sensor:
    """q = sign scale (reading - zero), q in rad or m; its rate, where a velocity is measured."""

    unit: str
    """unit of the readings"""
    zero: float
    """reading at q = 0"""
    scale: float
    """rad or m per unit of reading, positive"""
    sign: int
    """1, or -1 where the readings count against q"""
    resolution: float
    """step of the readings' grid, in units of reading; 0 where they lie on none"""
    zero_uncertainty: float
    """standard uncertainty of `zero`, in units of reading; 0 where it is exact"""

    def coordinate(self, reading: ArrayLike) -> NDArray[np.float64]:
        """Rotor coordinate q [rad or m] of readings, same shape."""
        return self.sign * self.scale * (np.asarray(reading, dtype=np.float64) - self.zero)

    def reading(self, coordinate: ArrayLike) -> NDArray[np.float64]:
        """Readings, not rounded to the grid, of coordinates q [rad or m], same shape."""
        return self.zero + self.sign * np.asarray(coordinate, dtype=np.float64) / self.scale

    @property
    def coordinate_resolution(self) -> float:
        """Step of the grid in q, rad or m."""
        return self.scale * self.resolution


def sensor_of(metadata: Metadata, readings: ArrayLike) -> Sensor:
    """The sensor that a run's metadata describe; its resolution is found from the readings."""
    unit = metadata.position_unit
    sign = 1 if metadata.columns is None else int(metadata.columns.position_sign)
    if unit != "counts":
        columns = metadata.columns
        assert columns is not None, "Metadata guarantees columns where the unit is not counts"
        step = grid_step(readings)
        # What rests has no rate: the zero of a velocity is exact where nobody doubts it.
        loose = step if metadata.measured == "position" else 0.0
        uncertainty = _zero_uncertainty(columns.position_zero_uncertainty, loose)
        zero = columns.position_zero or 0.0
        return Sensor(unit, zero, metadata.output.factor, sign, step, uncertainty)
    potentiometer = metadata.potentiometer
    assert potentiometer is not None, "Metadata guarantees a potentiometer where the unit is counts"
    if potentiometer.radians_per_count < 0:
        sign = -sign
    scale = abs(potentiometer.radians_per_count)
    uncertainty = _zero_uncertainty(potentiometer.zero_uncertainty, 1.0)
    step = potentiometer.resolution or 1.0
    return Sensor(unit, potentiometer.zero_reading, scale, sign, step, uncertainty)


def force_sensor_of(metadata: Metadata, readings: ArrayLike) -> Sensor:
    """The sensor of force that a run's metadata describe: force = sign scale (reading - zero)."""
    columns = metadata.columns
    assert columns is not None, "Metadata guarantees columns where a force is measured"
    unit = unit_of(metadata.force_unit, ("force", "torque"))
    assert unit is not None, "Metadata guarantees a unit of force"
    step = grid_step(readings)
    uncertainty = _zero_uncertainty(columns.force_zero_uncertainty, step)
    zero = columns.force_zero or 0.0
    return Sensor(unit.text, zero, unit.factor, columns.force_sign, step, uncertainty)


def _zero_uncertainty(told: float | None, step: float) -> float:
    """That of the metadata, else some steps of the readings."""
    return ZERO_UNCERTAINTY * step if told is None else told


def grid_step(readings: ArrayLike) -> float:
    """Step of the grid on which all readings lie to within their rounding, else 0.

    They are printed with so many decimals, with so many significant digits, or in full.
    """
    levels = np.unique(np.asarray(readings, dtype=np.float64))
    if levels.size < 3:
        return 0.0
    decimals, digits = _printed_decimals(levels), _printed_digits(levels)
    if decimals is not None:
        unit = 10.0**-decimals
        if step := _grid(levels, np.full(levels.shape, unit), 0.5 * unit):
            return step
    if digits is not None and levels.size >= _FEWEST_LEVELS:
        units = 10.0 ** (_magnitudes(levels) - digits + 1)
        if step := _grid(levels, units, 2.0 * float(units.max())):
            return step
    if decimals is not None:
        return 0.0
    unit = _ROUNDING * float(np.abs(levels).max())
    levels = levels[np.diff(levels, prepend=-np.inf) > 4 * unit]
    return _grid(levels, np.full(levels.shape, unit), 1e4 * unit)


def _grid(levels: NDArray[np.float64], rounding: NDArray[np.float64], least: float) -> float:
    """Step, above the least, of the grid on which levels lie to within the rounding of each, else 0."""
    if levels.size < 3:
        return 0.0
    steps = np.diff(levels)
    smallest = float(np.mean(steps[steps < 1.5 * steps.min()]))
    # Distance of each level from the first in whole steps, then the step by weighted least squares.
    whole = np.concatenate([[0.0], np.cumsum(np.rint(steps / smallest))])
    line = np.polynomial.Polynomial.fit(whole, levels, 1, w=1.0 / rounding)
    step, start = line.convert().coef[::-1]
    fits = np.all(np.abs(levels - start - step * whole) <= 0.75 * rounding)
    return float(f"{step:.6g}") if fits and step > least else 0.0


def _printed_decimals(levels: NDArray[np.float64]) -> int | None:
    """Fewest decimals that hold every level; None where floats fill all their digits."""
    for decimals in range(_MOST_DIGITS + 1):
        if np.allclose(np.round(levels, decimals), levels, rtol=1e-14, atol=1e-15):
            return decimals
    return None


def _printed_digits(levels: NDArray[np.float64]) -> int | None:
    """Fewest significant digits that hold every level; None where floats fill all of theirs."""
    for digits in range(1, _MOST_DIGITS + 1):
        scale = 10.0 ** (digits - 1 - _magnitudes(levels))
        if np.allclose(np.round(levels * scale) / scale, levels, rtol=1e-14, atol=0.0):
            return digits
    return None


def _magnitudes(levels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Powers of ten of the levels' first digits; of 0, that of the largest."""
    sizes = np.abs(levels)
    return np.floor(np.log10(np.where(sizes > 0.0, sizes, max(float(sizes.max()), 1e-300))))
