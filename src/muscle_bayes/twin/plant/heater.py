"""Heater tube: heating proportional to PWM, Newton cooling."""

from math import exp

FULL_PWM = 255.0


class HeaterTube:
    """Temperature [C] of one heater tube, solved in closed form while the PWM is constant."""

    def __init__(self, full_rate: float, cooling_time: float, room: float) -> None:
        self.full_rate = full_rate
        self.cooling_time = cooling_time
        self.room = room
        self.temperature = room

    def advance(self, pwm: float, duration: float) -> float:
        """Advance by a duration [s] at a PWM of 0-255 and return the temperature."""
        settled = self.room + self.full_rate * self.cooling_time * pwm / FULL_PWM
        decay = exp(-duration / self.cooling_time)
        self.temperature = settled + (self.temperature - settled) * decay
        return self.temperature
