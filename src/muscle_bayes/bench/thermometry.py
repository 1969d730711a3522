"""Which temperature readings may be trusted with a heater, and for how long heat may go on by one."""

from dataclasses import dataclass
from enum import StrEnum
from math import inf
from typing import Final

ANSWERED_WITHIN: Final = 0.42
"""Age of the meter's answer from which heat waits for the next, s; it measures every 0.4 s or so."""
MOVED_WITHIN: Final = 0.38
"""Time for which hard heating goes on without a change of the digits, s."""
UNPROVEN: Final = 400.0
"""Duty times time for which heat goes on without a change of the digits, s: 1.6 s of full power."""
SILENT_AFTER: Final = 1.5
"""Age at which a reading is no longer one, s."""
STUCK_AFTER: Final = 5.0
"""s of hard heating without a change of 0.1 C that no heater does."""
STUCK_AFTER_WARM: Final = 60.0
"""s at any duty above zero without a change of 0.1 C that no thermocouple does."""
HALF_POWER: Final = 127
FAR: Final = 2.0
"""Above this duty and so far below its setpoint [C] a tube heats hard: all updates show other digits."""
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
    waits: bool = True
    """whether heat has to wait for the meter: for an answer, or for other digits"""
    _read: float | None = None
    """time of the newest reading, good or not, s"""
    _previous: tuple[float, float] | None = None
    """time and value of the reading before, C"""
    _changed: float = -inf
    """time of the newest change of digits, s"""
    _warm: float | None = None
    """s since when the heater has been wanted on"""
    _hard: float | None = None
    """s since when it has been heated hard"""
    _unproven: bool = False
    """whether there has been heat enough for other digits, and none have come"""

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
            self._changed, self._unproven = time, False
        if changed or self.verdict is not Verdict.STUCK:
            self.verdict = Verdict.GOOD
        self.temperature = value

    def check(self, time: float, duty: int, setpoint: float = inf) -> Verdict:
        """The verdict at a host time [s] at which `duty` is wanted of the heater for a setpoint [C]."""
        age = inf if self._read is None else time - self._read
        self.waits = age > ANSWERED_WITHIN
        if age > SILENT_AFTER:
            self.verdict = Verdict.SILENT
            self._previous = self._warm = self._hard = None
            return self.verdict
        self._warm = _since(self._warm, time, duty > 0)
        far = self.temperature is not None and setpoint - self.temperature > FAR
        self._hard = _since(self._hard, time, far and duty > HALF_POWER)
        self._unproven = duty > 0 and (
            self._unproven
            or self._still(self._hard, time) > MOVED_WITHIN
            or duty * self._still(self._warm, time) > UNPROVEN
        )
        self.waits = self.waits or self._unproven
        if self.verdict is Verdict.GOOD and (
            self._still(self._hard, time) > STUCK_AFTER
            or self._still(self._warm, time) > STUCK_AFTER_WARM
        ):
            self.verdict = Verdict.STUCK
        return self.verdict

    def _still(self, since: float | None, time: float) -> float:
        """s for which the digits have been the same while the heater was wanted so."""
        return 0.0 if since is None else time - max(since, self._changed)


def _since(start: float | None, time: float, holds: bool) -> float | None:
    if not holds:
        return None
    return time if start is None else start
