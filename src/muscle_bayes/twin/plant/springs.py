"""What pulls between the pins of one side: reference spring (eq. 12) and muscle (eq. 13-17)."""

from collections.abc import Sequence
from math import expm1

from muscle_bayes.conventions import SPRING_INTERCEPT, SPRING_MIN_LENGTH, SPRING_RATE
from muscle_bayes.twin.effects import Effect
from muscle_bayes.twin.plant.parameters import MuscleParameters

DAMPER_FLOOR = 1e-3
"""Least B_hyst, N s/m: eq. 17 falls through zero at T = -T_hyst_offset, which no damper does."""


class Puller:
    """An element as the rotor sees it; one that has no state of its own need only pull."""

    def tension(self, length: float) -> float:
        """Tension at a pin-to-pin length [m], N."""
        raise NotImplementedError

    def begin(self, before: float, after: float, duration: float) -> None:
        """Announce an interval [s] of a temperature that goes linearly from before to after [C]."""

    def advance(self, step: float) -> None:
        """Advance the element's own state by a step [s] at the tension last computed."""

    def rewind(self, fraction: float) -> None:
        """Keep only that fraction of the last advance."""


class ReferenceSpring(Puller):
    """Massless, lossless spring of eq. 12; shorter than its least length it keeps that force."""

    def tension(self, length: float) -> float:
        return SPRING_RATE * max(length, SPRING_MIN_LENGTH) + SPRING_INTERCEPT


class Muscle(Puller):
    """MODULUS, OFFSET and HYST in series."""

    def __init__(
        self,
        parameters: MuscleParameters,
        base_length: float,
        *,
        hyst: float = 0.0,
        room: float = 25.0,
        effects: Sequence[Effect] = (),
    ) -> None:
        p = parameters
        self.parameters = p
        self.base_length = base_length
        self.hyst = hyst
        self.force = 0.0
        """Tension in the series chain, N: HYST feels this, not what effects add beside it."""
        self.offset = 0.0
        self._eps = p.epsilon
        self._modulus_rate = self._full_modulus_rate = base_length * p.K_modulus
        self._hyst_rate = base_length * p.K_hyst
        self._modulus_toe = p.F_modulus_min / p.epsilon
        self._hyst_toe = p.F_hyst_min / p.epsilon
        self._modulus_slope = 0.0
        self._offset_slope = 0.0
        self._mobility = 0.0
        self._hyst_before = hyst
        self._offset_before = 0.0
        self._tensions = [e.extra_tension for e in effects if e.overrides("extra_tension")]
        self._offsets = [e.extra_offset for e in effects if e.overrides("extra_offset")]
        self._dampers = [e.damper for e in effects if e.overrides("damper")]
        self._moduli = [e.modulus for e in effects if e.overrides("modulus")]
        self._stretches = [e.stretch for e in effects if e.overrides("stretch")]
        self._flows = [e.flow for e in effects if e.overrides("flow")]
        self._creeps = [creep for e in effects if (creep := e.creep(room)) is not None]
        self._temperature = room

    def offset_at(self, temperature: float) -> float:
        """sigma_offset (eq. 16)."""
        p = self.parameters
        offset = (p.A * temperature + p.B) * temperature + p.C
        for port in self._offsets:
            offset += port(temperature)
        return offset

    def damper_at(self, temperature: float) -> float:
        """B_hyst (eq. 17), N s/m."""
        p = self.parameters
        coefficient = p.H * (temperature + p.T_hyst_offset)
        for port in self._dampers:
            coefficient = port(coefficient, temperature)
        return max(coefficient, DAMPER_FLOOR)

    def begin(self, before: float, after: float, duration: float) -> None:
        self.offset = self.offset_at(before)
        self._offset_slope = (self.offset_at(after) - self.offset) / duration
        self._temperature = middle = 0.5 * (before + after)
        self._mobility = 1.0 / (self.damper_at(middle) * self.base_length)
        self._modulus_rate = self._full_modulus_rate
        for port in self._moduli:
            self._modulus_rate = port(self._modulus_rate, middle)

    def tension(self, length: float) -> float:
        strain = length / self.base_length - 1.0
        stretch = strain - self.offset - self.hyst
        for creep in self._creeps:
            stretch -= creep.strain
        for give in self._stretches:
            stretch = give(stretch)
        if stretch > self._eps:
            slope = self._modulus_rate
            force = slope * (stretch - self._eps) + self.parameters.F_modulus_min
        elif stretch > 0.0:
            slope = self._modulus_toe
            force = slope * stretch
        else:
            slope = force = 0.0
        self.force = force
        self._modulus_slope = slope
        for port in self._tensions:
            force += port(strain)
        return force

    def advance(self, step: float) -> None:
        """One Rosenbrock step of eq. 15, which is linear between the corners of eq. 13-14.

        Its factor (1 - exp(-z))/z is 1/(1 + z/2 + z^2/12) to 4th order, which serves for small z.
        """
        self._hyst_before = hyst = self.hyst
        self._offset_before = self.offset
        if hyst > self._eps:
            slope = self._hyst_rate
            spring = slope * (hyst - self._eps) + self.parameters.F_hyst_min
        elif hyst > 0.0:
            slope = self._hyst_toe
            spring = slope * hyst
        else:
            slope = spring = 0.0
        move = self._mobility * step
        z = move * (slope + self._modulus_slope)
        factor = 1.0 / (1.0 + z * (0.5 + z / 12.0)) if z < 0.1 else -expm1(-z) / z
        pull = self.force - spring
        for port in self._flows:
            pull = port(pull)
        for creep in self._creeps:
            creep.advance(step, self.force, self._temperature)
        self.hyst = hyst + factor * move * pull
        self.offset += self._offset_slope * step

    def rewind(self, fraction: float) -> None:
        self.hyst = self._hyst_before + fraction * (self.hyst - self._hyst_before)
        self.offset = self._offset_before + fraction * (self.offset - self._offset_before)
        for creep in self._creeps:
            creep.rewind(fraction)
