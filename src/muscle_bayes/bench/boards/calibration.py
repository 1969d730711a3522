"""Zero and radians per count of the potentiometer, from turning the rotor between its endstops."""

from dataclasses import dataclass
from math import sqrt
from statistics import mean, median, stdev
from typing import Final, Literal

from muscle_bayes.errors import MuscleBayesError

TURN: Final = 40
"""Counts that the rotor has to come back from an extreme before it counts as an endstop."""
AT_STOP: Final = 2
"""Counts within which readings belong to an extreme."""
MOST_SPREAD: Final = 3.0
"""Standard deviation of an endstop's readings, counts, above which it was not reached each time."""
FULL_SCALE: Final = 1023
ENCODER_BITS: Final = 16


@dataclass(frozen=True)
class Calibration:
    """theta = radians_per_count (reading - zero_reading); standard errors from repetition and rounding."""

    zero_reading: float
    zero_error: float
    """counts"""
    radians_per_count: float
    scale_error: float
    """rad per count"""
    lower: tuple[float, ...]
    """readings at the lower endstop, counts"""
    upper: tuple[float, ...]


class EndstopFinder:
    """Follows readings and keeps that of every endstop: alternately lowest and highest.

    The readings with which it begins are no endstop, wherever the rotor is then.
    """

    def __init__(self) -> None:
        self.found: list[float] = []
        """readings at the endstops, in the order in which they were reached, counts"""
        self._rising: bool | None = None
        self._start: tuple[float, float] | None = None
        self._extreme = 0.0
        self._leg: list[float] = []

    def feed(self, reading: float) -> None:
        """Take one reading [counts]."""
        if self._rising is None:
            self._begin(reading)
            return
        ahead = reading > self._extreme if self._rising else reading < self._extreme
        if ahead:
            self._extreme = reading
        self._leg.append(reading)
        if abs(reading - self._extreme) >= TURN:
            near = [r for r in self._leg if abs(r - self._extreme) <= AT_STOP]
            self.found.append(float(median(near)))
            self._rising, self._extreme, self._leg = not self._rising, reading, [reading]

    def _begin(self, reading: float) -> None:
        low, high = self._start or (reading, reading)
        self._start = (min(low, reading), max(high, reading))
        if reading - low >= TURN or high - reading >= TURN:
            self._rising = reading - low >= TURN
            self._extreme, self._leg = reading, [reading]


def calibrate(
    readings: list[float],
    stops: tuple[float, float],
    first: Literal["lower", "upper"] = "lower",
    full_scale: float = FULL_SCALE,
) -> Calibration:
    """Calibration from readings [counts] at alternate endstops, `first` being where they begin.

    With the endstops at theta_l and theta_u [rad] and mean readings l and u,
    radians_per_count = (theta_u - theta_l)/(u - l), zero_reading = l - theta_l/radians_per_count.
    Raises MuscleBayesError.
    """
    even, odd = tuple(readings[::2]), tuple(readings[1::2])
    lower, upper = (even, odd) if first == "lower" else (odd, even)
    if len(odd) < 2:
        raise MuscleBayesError(
            f"{len(readings)} endstops were reached, 4 are needed. Fix: turn the rotor to and fro."
        )
    for name, side in (("lower", lower), ("upper", upper)):
        if min(side) <= AT_STOP or max(side) >= full_scale - AT_STOP:
            raise MuscleBayesError(
                f"the {name} endstop reads {mean(side):.0f}, an end of the converter's range. "
                "Fix: turn the potentiometer on its shaft, or check its wiring."
            )
        if stdev(side) > MOST_SPREAD:
            told = ", ".join(f"{reading:g}" for reading in side)
            raise MuscleBayesError(
                f"the {name} endstop was read as {told} counts. Fix: turn the rotor against both "
                "endstops each time and hold it there for a second."
            )
    span = mean(upper) - mean(lower)
    if abs(span) < TURN:
        raise MuscleBayesError(f"the endstops lie {span:.0f} counts apart. Fix: check the shaft.")
    scale = (stops[1] - stops[0]) / span
    # Rounding to whole counts is the same at every return, and so no repetition averages it out.
    errors = [sqrt(stdev(side) ** 2 / len(side) + 1 / 12) for side in (lower, upper)]
    scale_error = abs(scale / span) * sqrt(errors[0] ** 2 + errors[1] ** 2)
    # zero = l - theta_l (u - l)/(theta_u - theta_l): weights of both means.
    share = -stops[0] / (stops[1] - stops[0])
    zero_error = sqrt(((1 - share) * errors[0]) ** 2 + (share * errors[1]) ** 2)
    zero = mean(lower) - stops[0] / scale
    return Calibration(zero, zero_error, scale, scale_error, lower, upper)
