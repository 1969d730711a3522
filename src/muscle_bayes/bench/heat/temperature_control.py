"""Heater control of the thesis' bench (App. B): temperature in, duty out, one law a channel."""

from dataclasses import dataclass
from typing import Final

PERIOD: Final = 0.03
"""Control period for which the law's integral gain is stated, s."""
FULL_DUTY: Final = 255


@dataclass(frozen=True, kw_only=True)
class HeaterLaw:
    """output = gain (constant + feedforward setpoint + proportional e + integral sum(e)), 0 to 255.

    e = setpoint - temperature [C]; sum(e) grows by e every PERIOD and is clamped to
    +-integral_limit. The defaults are the thesis' constants, k_I = 25 x PERIOD.
    """

    gain: float = 0.55
    constant: float = -55.4
    feedforward: float = 1.5
    """1/C"""
    proportional: float = 30.0
    """1/C"""
    integral: float = 25.0 * PERIOD
    """1/(C period)"""
    integral_limit: float = 500.0
    """C periods"""

    def output(self, setpoint: float, error: float, integral: float) -> float:
        """Duty, not rounded, 0 to 255."""
        total = (
            self.constant
            + self.feedforward * setpoint
            + self.proportional * error
            + self.integral * integral
        )
        return min(max(self.gain * total, 0.0), float(FULL_DUTY))


STABLE_BAND: Final = 1.0
STABLE_TIME: Final = 10.0
"""Stable: within STABLE_BAND [C] of the setpoint for more than STABLE_TIME [s]."""


class TemperatureControl:
    """One channel under the law. Without a setpoint it is off: duty 0, never stable."""

    def __init__(self) -> None:
        self.law = HeaterLaw()
        self.setpoint: float | None = None
        """C, None = off"""
        self.integral = 0.0
        """sum(e), C periods"""
        self.duty = 0
        self.stable = False
        self._in_band_since: float | None = None

    def aim(self, setpoint: float | None) -> None:
        """Take a setpoint [C]; the wait for stability starts anew, the integral goes on."""
        self.setpoint = setpoint
        self.unsettle()

    def unsettle(self) -> None:
        """Let the wait for stability start anew, as after any time without control."""
        self.stable = False
        self._in_band_since = None

    def off(self) -> None:
        """Duty 0 until the next update; the integral is forgotten with the heat."""
        self.duty = 0
        self.integral = 0.0
        self.unsettle()

    def update(self, temperature: float, time: float) -> int:
        """Duty 0 to 255 for a temperature [C] at a time [s]; call it once every PERIOD."""
        if self.setpoint is None:
            self.off()
            return 0
        error = self.setpoint - temperature
        limit = self.law.integral_limit
        self.integral = min(max(self.integral + error, -limit), limit)
        self._watch(error, time)
        self.duty = round(self.law.output(self.setpoint, error, self.integral))
        return self.duty

    def _watch(self, error: float, time: float) -> None:
        if abs(error) > STABLE_BAND:
            self.unsettle()
            return
        if self._in_band_since is None:
            self._in_band_since = time
        self.stable = time - self._in_band_since > STABLE_TIME
