"""Which temperature readings may be trusted with a heater, and for how long heat may go on by one."""

from dataclasses import dataclass
from enum import StrEnum
from math import inf
from typing import Final

from muscle_bayes.bench.meters.meter import FASTEST, Reading
from muscle_bayes.errors import MuscleBayesError

ANSWERED_WITHIN: Final = 0.42
"""Age of the meter's answer from which heat waits for the next, s; it measures every 0.4 s or so."""
UNPROVEN: Final = 400.0
"""Duty times time for which heat goes on without a change of the digits, s: 1.6 s of full power."""
SILENT_AFTER: Final = 1.5
"""Age at which a reading is no longer one, s."""
STUCK_AFTER: Final = 8.0
"""s for which heat that is wanted has waited for other digits: a sound meter shows some by then."""
HALF_POWER: Final = 127
FAR: Final = 2.0
"""Above this duty and so far below its setpoint [C] a tube heats hard: all updates show other digits."""
LEAST: Final = 0.0
MOST: Final = 250.0
"""Ends of what a nylon muscle in a room can have, C; it melts at about 220 C."""
_LONGEST_CHECK: Final = 0.4
"""Most time between two checks that counts as heated, s: the board's dead-man ends it then."""


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
    """the same digits for too long while heat is wanted"""


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

    moved_within: float = 0.38
    """time of hard heating, pauses left out, after which the digits must have changed, s"""
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
    _checked: float | None = None
    """time of the last check, s"""
    _duty: int = 0
    """wanted since then"""
    _is_hard: bool = False
    """whether that heats hard"""
    _hard: float = 0.0
    """s of hard heating that was wanted since the digits last changed; no pause makes it less"""
    _heat: float = 0.0
    """duty times time that was wanted since then, s"""
    _waited: float = 0.0
    """s for which heat has waited for other digits"""

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
            self._changed = time
            self._hard = self._heat = self._waited = 0.0
        if changed or self.verdict is not Verdict.STUCK:
            self.verdict = Verdict.GOOD
        self.temperature = value

    def check(self, time: float, duty: int, setpoint: float = inf) -> Verdict:
        """The verdict at a host time [s] at which `duty` is wanted of the heater for a setpoint [C]."""
        since = time if self._checked is None else max(self._checked, self._changed)
        passed = min(time - since, _LONGEST_CHECK)
        self._checked = time
        age = inf if self._read is None else time - self._read
        self.waits = age > ANSWERED_WITHIN
        if age > SILENT_AFTER:
            self.verdict, self._previous = Verdict.SILENT, None
            self._duty, self._is_hard = 0, False
            return self.verdict
        self._heat += self._duty * passed
        self._hard += passed if self._is_hard else 0.0
        unproven = self._hard > self.moved_within or self._heat > UNPROVEN
        self._waited += passed if unproven and self._duty > 0 else 0.0
        self.waits = self.waits or unproven
        far = self.temperature is not None and setpoint - self.temperature > FAR
        self._duty, self._is_hard = duty, far and duty > HALF_POWER
        if self.verdict is Verdict.GOOD and self._waited > STUCK_AFTER:
            self.verdict = Verdict.STUCK
        return self.verdict


NEAR: Final = 10.0
"""A cold tube shows its room's temperature to within this, C; rooms are seldom known better."""
_NEAR_IN_FAHRENHEIT: Final = 6.0


def far_from_room(reading: Reading, room: float) -> str:
    """What the operator has to confirm before heat is given to tubes in a room [C]; empty if nothing.

    Raises MuscleBayesError where the meter shows Fahrenheit.
    """
    shown = {
        name: value
        for name, value in zip(("T1", "T2"), reading.temperatures, strict=True)
        if value is not None
    }
    if all(abs(value - room) <= NEAR for value in shown.values()):
        return ""
    told = " and ".join(f"{name} {value:.1f}" for name, value in shown.items())
    if all(abs((value - 32.0) / 1.8 - room) <= _NEAR_IN_FAHRENHEIT for value in shown.values()):
        raise MuscleBayesError(
            f"the meter shows {told}: that is a room of {room:g} C in Fahrenheit. Fix: set the "
            "meter to C. If the tubes really are that warm, wait until they have cooled."
        )
    return f"The meter shows {told} C, and the room has {room:g} C"
