"""Heater controller of the bench (thesis, App. B): one per channel, called every 0.03 s."""

PERIOD = 0.03
"""Control period, s."""

STABLE_BAND = 1.0
"""Distance from the setpoint that counts as reached, C."""

STABLE_TIME = 10.0
"""Time within the band after which the channel is stable, s."""

_GAIN = 0.55
_CONSTANT = -55.4
_FEEDFORWARD = 1.5
_PROPORTIONAL = 30.0
_INTEGRAL = 25.0 * PERIOD
_INTEGRAL_LIMIT = 500.0


class HeaterController:
    """output = 0.55 (k_C + k_F setpoint + k_P e + k_I sum(e)), clamped to 0-255.

    The integral is the sum of the errors, one a period, clamped to +-500; k_I holds the period.
    A channel without setpoint is off: output 0, never stable.
    """

    def __init__(self) -> None:
        self.setpoint: float | None = None
        self.integral = 0.0
        self.in_band_since: float | None = None
        self.stable = False

    def aim(self, setpoint: float | None) -> None:
        """Take a new setpoint [C]; the wait for stability starts anew."""
        self.setpoint = setpoint
        self.in_band_since = None
        self.stable = False

    def update(self, temperature: float, time: float) -> float:
        """PWM for a meter reading [C] at a time [s]."""
        if self.setpoint is None:
            return 0.0
        error = self.setpoint - temperature
        self.integral = min(max(self.integral + error, -_INTEGRAL_LIMIT), _INTEGRAL_LIMIT)
        if abs(error) > STABLE_BAND:
            self.in_band_since = None
        elif self.in_band_since is None:
            self.in_band_since = time
        self.stable = self.in_band_since is not None and time - self.in_band_since > STABLE_TIME
        output = _GAIN * (
            _CONSTANT
            + _FEEDFORWARD * self.setpoint
            + _PROPORTIONAL * error
            + _INTEGRAL * self.integral
        )
        return min(max(output, 0.0), 255.0)
