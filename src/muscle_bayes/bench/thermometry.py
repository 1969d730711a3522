"""Which temperature readings may be trusted with a heater."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

SILENT_AFTER: Final = 1.5
"""Age at which a reading is no longer one, s; the meter updates about every 0.4 s."""
STUCK_AFTER: Final = 5.0
"""s at full duty without a change of 0.1 C that no heater does."""
STUCK_AFTER_WARM: Final = 60.0
"""s at any duty above zero without a change of 0.1 C that no thermocouple does."""
NEARLY_FULL: Final = 250
LEAST: Final = 0.0
MOST: Final = 250.0
"""Ends of what a nylon muscle in a room can have, C; it melts at about 220 C."""
FASTEST: Final = 30.0
"""Change that no heater tube does, C/s."""


class Verdict(StrEnum):
    """What a channel's readings are."""

    GOOD = "good"
    SILENT = "silent"
    """no answer from the meter for 1.5 s"""
    OPEN = "open"
    """OL: no thermocouple, or a broken one"""
    ABSURD = "absurd"
    """out of reach, or changed faster than anything can"""
    STUCK = "stuck"
    """the same digits for too long while the heater is on"""


REMEDIES: Final = {
    Verdict.SILENT: "switch the meter and its link on, check its cable",
    Verdict.OPEN: "plug the thermocouple in, or replace it",
    Verdict.ABSURD: "check the thermocouple's place, plug and type",
    Verdict.STUCK: "release HOLD on the meter; check that the thermocouple sits in the heater tube "
    "and that the heater is connected",
}


@dataclass
class Watch:
    """Judges one channel. A reading after a bad one counts once the next agrees with it."""

    verdict: Verdict = Verdict.SILENT
    temperature: float | None = None
    """the newest reading that was good, C"""
    _read: float | None = None
    """time of the newest reading, good or not, s"""
    _previous: tuple[float, float] | None = None
    """time and value of the reading before, C"""
    _same: float | None = None
    """s since when the digits are the same while the heater was on"""
    _full: float | None = None
    """s since when, at nearly full duty"""

    def read(self, time: float, value: float | None) -> None:
        """Take a reading [C, None = open] that came at a host time [s]."""
        before, self._read = self._previous, time
        if value is None:
            self.verdict, self._previous = Verdict.OPEN, None
            return
        self._previous = (time, value)
        if not LEAST <= value <= MOST:
            self.verdict = Verdict.ABSURD
            return
        if before is None:
            if self.verdict in (Verdict.OPEN, Verdict.ABSURD):
                return  # the first after a fault has nothing to agree with
        elif abs(value - before[1]) > FASTEST * max(time - before[0], 0.1):
            self.verdict = Verdict.ABSURD
            return
        changed = before is None or value != before[1]
        if changed:
            self._same = self._full = None
        if changed or self.verdict is not Verdict.STUCK:
            self.verdict = Verdict.GOOD
        self.temperature = value

    def check(self, time: float, duty: int) -> Verdict:
        """The verdict at a host time [s] at which the heater is at `duty`."""
        if self._read is None or time - self._read > SILENT_AFTER:
            self.verdict = Verdict.SILENT
            self._previous = self._same = self._full = None
            return self.verdict
        self._same = _since(self._same, time, duty > 0)
        self._full = _since(self._full, time, duty >= NEARLY_FULL)
        if self.verdict is Verdict.GOOD and (
            (self._full is not None and time - self._full > STUCK_AFTER)
            or (self._same is not None and time - self._same > STUCK_AFTER_WARM)
        ):
            self.verdict = Verdict.STUCK
        return self.verdict


def _since(start: float | None, time: float, holds: bool) -> float | None:
    if not holds:
        return None
    return time if start is None else start
