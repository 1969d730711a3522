"""How warm a heater tube is by what it was given: the board's own observer, to the last digit.

rise' = gain duty/255 - rise/cooling_time, in whole numbers every 20 ms (`firmware/src/thermal.c`). Two
questions are answered by it: how hot may a tube be, whatever its thermocouple shows (`most`); and has
the thermocouple shown the heat that was given (`unseen`)?
"""

from dataclasses import dataclass
from typing import Final

STEP_MS: Final = 20
MEAN_STEPS: Final = 1500
"""Steps over which the mean of late reaches, 30 s."""
TENTH: Final = 104858
"""Of the states in 0.1 C: 2^20 a degree."""
COLD: Final = 2.0
"""A tube that is warmer than its room by no more than this is cold, C."""
ROOM: Final = 25.0
"""A shown temperature above this counts as a rise, C."""
MUST_SHOW: Final = 15.0
"""Rise of the model above its mean of late, or in all, C, of which a third must have been shown."""
HOST_MUST_SHOW: Final = 12.0
"""The same for the host, which looks first, C."""
HOTTEST: Final = 115.0
"""What the heat model may say of a tube in its room, C: 5 C are left for the model's own error."""
MOST_RISE: Final = 90.0
"""The board's own limit of the rise, C."""


@dataclass(frozen=True)
class TubeModel:
    """A heater tube in the board's units."""

    gain: int
    """rate at full duty, 0.01 C/s"""
    cooling: int
    """time constant, 0.1 s"""

    @classmethod
    def of(cls, rate: float, cooling_time: float) -> "TubeModel":
        """From a rate [C/s at full duty] and a time constant [s]."""
        return cls(round(100 * rate), round(10 * cooling_time))

    @property
    def rate(self) -> float:
        """At full duty, C/s."""
        return self.gain / 100

    @property
    def cooling_time(self) -> float:
        """Time constant, s."""
        return self.cooling / 10

    @property
    def plausible(self) -> bool:
        """Whether a board takes it."""
        return (
            LEAST.gain <= self.gain <= MOST.gain and LEAST.cooling <= self.cooling <= MOST.cooling
        )


LEAST: Final = TubeModel(100, 100)
"""What an uncalibrated tube does at least; no tube may be calibrated to less."""
MOST: Final = TubeModel(1000, 1000)
"""What an uncalibrated tube does at most; no tube may be calibrated to more."""


class HeatModel:
    """One tube; `model` is None where it is not calibrated."""

    def __init__(self, model: TubeModel | None = None) -> None:
        self.model = model
        self.most = 0
        """rise above the room that the tube has at most; this and the next four in 0.1 C / TENTH"""
        self.least = 0
        """rise that it has at least"""
        self.least_mean = 0
        self.shown = 0
        """what its thermocouple shows"""
        self.shown_mean = 0
        self.cold = 0
        """what it showed, or would have shown, of the cold tube"""
        self.dose = 0
        """sum of the step's duties, one a millisecond"""
        self.ms = 0
        self.seen = False

    @property
    def highest_rise(self) -> float:
        """By how much the tube may be warmer than the room, C."""
        return self.most / TENTH / 10

    @property
    def expected(self) -> float:
        """Rise that the tube has at least, C."""
        return self.least / TENTH / 10

    def report(self, temperature: float) -> None:
        """The thermocouple shows a temperature [C]."""
        tenths = round(10 * temperature)
        self.shown = tenths * TENTH
        if not self.seen:
            self.seen, self.shown_mean = True, self.shown
        self.most = max(self.most, (tenths - round(10 * ROOM)) * TENTH)
        if self.least <= round(10 * COLD) * TENTH:
            self.cold = self.shown - (self.most - self.least)

    def cooled(self) -> None:
        """A fan blows: the tube may be as much colder than the model as its thermocouple shows."""
        self.cold = min(self.cold, self.shown - self.least)

    def advance(self, duty: int, milliseconds: int = 1) -> None:
        """Let time pass at a duty of 0-255."""
        while milliseconds > 0:
            passed = min(milliseconds, STEP_MS - self.ms)
            self.dose += duty * passed
            self.ms += passed
            milliseconds -= passed
            if self.ms == STEP_MS:
                self._step()

    def unseen(self, rise: float = MUST_SHOW) -> bool:
        """Whether the tube has warmed by more than `rise` [C], of late or in all, and a third of that
        was not shown."""
        enough = round(10 * rise) * TENTH
        expected = self.least - self.least_mean
        of_late = expected > enough and 3 * (self.shown - self.shown_mean) < expected
        in_all = self.least > enough and 3 * (self.shown - self.cold) < self.least
        return self.seen and (of_late or in_all)

    def above(self, rise: float) -> bool:
        """Whether the tube may be warmer than the room by more than a rise [C]."""
        return self.most > round(10 * rise) * TENTH

    def _step(self) -> None:
        self.most = _advanced(self.most, self.model or MOST, self.dose)
        self.least = _advanced(self.least, self.model or LEAST, self.dose)
        self.least_mean += _quotient(self.least - self.least_mean, MEAN_STEPS)
        self.shown_mean += _quotient(self.shown - self.shown_mean, MEAN_STEPS)
        self.dose = self.ms = 0


def _advanced(rise: int, model: TubeModel, dose: int) -> int:
    """2^20 gain dose 20 ms / (255 x 20) is gain dose / 24.319 = 16 gain dose / 389."""
    heat = model.gain * dose * 16 // 389
    return rise + heat - _quotient(rise, model.cooling * (100 // STEP_MS))


def _quotient(number: int, by: int) -> int:
    """Cut towards zero, as C does."""
    return number // by if number >= 0 else -(-number // by)
