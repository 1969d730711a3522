"""Effects that the muscle remembers."""

from dataclasses import dataclass
from math import expm1
from typing import ClassVar

from muscle_bayes.twin.effects.base import Creep, Effect


class _Approach:
    """A strain that approaches a goal exponentially, both counted from where it begins."""

    def __init__(self, time_constant: float) -> None:
        self.strain = 0.0
        self._before = 0.0
        self._rate = 1.0 / time_constant

    def towards(self, goal: float, step: float) -> None:
        """Approach a goal for a step [s]."""
        self._before = self.strain
        self.strain -= (goal - self.strain) * expm1(-step * self._rate)

    def rewind(self, fraction: float) -> None:
        self.strain = self._before + fraction * (self.strain - self._before)


class _Voigt(_Approach):
    def __init__(self, effect: "SecondRelaxation") -> None:
        super().__init__(effect.time_constant)
        self._compliance = effect.compliance

    def advance(self, step: float, tension: float, temperature: float) -> None:
        self.towards(self._compliance * tension, step)


@dataclass(frozen=True, kw_only=True)
class SecondRelaxation(Effect):
    """A spring of 1/compliance [N per unit strain] beside a damper, in series with the muscle's others.

    It is unstretched when the protocol begins and relaxes with time_constant [s].
    """

    name: ClassVar[str] = "second-relaxation"
    compliance: float = 0.006
    time_constant: float = 15.0

    def creep(self, room: float) -> Creep:
        return _Voigt(self)


class _Set(_Approach):
    def __init__(self, effect: "FirstCycleSet", room: float) -> None:
        super().__init__(effect.time_constant)
        self._effect, self._room = effect, room

    def advance(self, step: float, tension: float, temperature: float) -> None:
        above = max(temperature - self._room, 0.0)
        goal = self._effect.gain * tension * above - self._effect.trained
        self.towards(max(goal, self.strain), step)


@dataclass(frozen=True, kw_only=True)
class FirstCycleSet(Effect):
    """Strain that a hot, taut muscle gains and keeps.

    It approaches gain [1/(N K)] times tension times temperature above the room with time_constant [s]
    and never returns. What is `trained` when the protocol begins counts towards it, but is part of the
    muscle's own length.
    """

    name: ClassVar[str] = "first-cycle-set"
    gain: float = 1e-4
    time_constant: float = 40.0
    trained: float = 0.0

    def creep(self, room: float) -> Creep:
        return _Set(self, room)
