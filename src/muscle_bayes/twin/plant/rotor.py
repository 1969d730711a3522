"""Rotor with true stick-slip: J theta'' = tau - friction, which at rest holds anything up to D.

While it slips, velocity Verlet steps run up to the instant at which the velocity crosses zero.
While it sticks, the elements relax at a constant angle, and the instant at which the torque leaves
[-D, D] is found inside the interval. Endstops are inelastic.
"""

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass
from math import ceil, inf

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.twin.plant.linkage import Side


@dataclass
class Rotor:
    """State and laws of motion; angles in rad, torques in N m."""

    sides: Sequence[Side]
    _: KW_ONLY
    inertia: float
    dry_friction: float
    viscous_friction: float
    disc_radius: float
    stops: tuple[float, float]
    slip_step: float
    extra_torques: Sequence[Callable[[float, float], float]] = ()
    friction_laws: Sequence[Callable[[float, float, float, float], float]] = ()
    load_scales: Sequence[Callable[[float], float]] = ()
    angle: float = 0.0
    velocity: float = 0.0
    slipping: bool = False

    def __post_init__(self) -> None:
        self.hang(0.0)

    def hang(self, mass: float) -> None:
        """Put a mass [kg] on the cable: torque m g R_d and inertia m R_d^2."""
        self.load_torque = mass * GRAVITY * self.disc_radius
        for scale in self.load_scales:
            self.load_torque = scale(self.load_torque)
        self.total_inertia = self.inertia + mass * self.disc_radius**2

    def torque(self, angle: float, velocity: float = 0.0) -> float:
        """All torque but friction."""
        total = self.load_torque
        for side in self.sides:
            total += side.torque(angle)
        for extra in self.extra_torques:
            total += extra(angle, velocity)
        return total

    def friction_at(self, speed: float, angle: float) -> float:
        """Magnitude of dry friction at a speed without sign; at rest, the most that it holds."""
        level = self.dry_friction
        if self.friction_laws:
            pull = abs(self.load_torque) + sum(abs(side.torque(angle)) for side in self.sides)
            for law in self.friction_laws:
                level = law(level, speed, pull, angle)
        return level

    def advance(self, duration: float) -> None:
        """Advance by a duration [s] whose temperatures the elements have been told."""
        left = duration
        while left > 0.0:
            left = self._slip(left) if self.slipping else self._stick(left)

    def _held_range(self) -> tuple[float, float]:
        """Torques that leave the rotor at rest: friction holds, and so does a stop it leans on."""
        lower, upper = self.stops
        static = self.friction_at(0.0, self.angle)
        return (
            -inf if self.angle <= lower else -static,
            inf if self.angle >= upper else static,
        )

    def _stick(self, left: float) -> float:
        """Rest until the torque breaks away or the time is over; returns the time left."""
        angle = self.angle
        lower, upper = self._held_range()
        before = self.torque(angle)
        if not lower <= before <= upper:
            self.slipping = True
            return left
        for side in self.sides:
            side.element.advance(left)
        after = self.torque(angle)
        least, most = self._held_range()
        if least <= after <= most:
            return 0.0
        bound, moved = (upper, most - upper) if after > most else (lower, least - lower)
        fraction = (bound - before) / (after - before - moved)
        for side in self.sides:
            side.element.rewind(fraction)
        self.slipping = True
        return left * (1.0 - fraction)

    def _slip(self, left: float) -> float:
        """Slip until the rotor stops or the time is over; returns the time left.

        From rest the direction is that of the torque; under way it is that of the velocity.
        """
        elements = [side.element for side in self.sides]
        extras = self.extra_torques
        torque_at = self.torque
        lower, upper = self.stops
        dry = self.friction_at(abs(self.velocity), self.angle)
        sticks = self.friction_at(0.0, self.angle) > 0.0
        viscous = self.viscous_friction
        count = ceil(left / self.slip_step)
        step = left / count
        half = 0.5 * step / self.total_inertia
        damping = 1.0 + half * viscous
        angle = self.angle
        velocity = self.velocity
        torque = torque_at(angle, velocity)
        ahead = velocity if velocity != 0.0 else torque
        sign = 1.0 if ahead > 0.0 else -1.0
        friction = sign * dry
        for index in range(count):
            if self.friction_laws:
                friction = sign * self.friction_at(abs(velocity), angle)
            middle = velocity + half * (torque - friction - viscous * velocity)
            angle_new = angle + step * middle
            for element in elements:
                element.advance(step)
            if not lower < angle_new < upper:
                stop = upper if angle_new >= upper else lower
                moved = angle_new - angle
                fraction = (stop - angle) / moved if moved != 0.0 else 1.0
                return self._stop_at(stop, fraction, left, index, step)
            torque = torque_at(angle_new, 2.0 * middle - velocity if extras else 0.0)
            velocity_new = (middle + half * (torque - friction)) / damping
            if sticks and velocity_new * sign <= 0.0:
                # The velocity falls linearly through zero inside the step.
                span = velocity - velocity_new
                fraction = velocity / span if span != 0.0 else 0.0
                if fraction < 1e-9:  # it never got going: rest for the whole step
                    return self._stop_at(angle, 1.0, left, index, step)
                stop = angle + 0.5 * fraction * step * velocity
                return self._stop_at(stop, fraction, left, index, step)
            angle = angle_new
            velocity = velocity_new
        self.angle = angle
        self.velocity = velocity
        return 0.0

    def _stop_at(
        self, angle: float, fraction: float, left: float, index: int, step: float
    ) -> float:
        """Come to rest at an angle, a fraction of step number index having passed."""
        for side in self.sides:
            side.element.rewind(fraction)
        self.angle = angle
        self.velocity = 0.0
        self.slipping = False
        remaining = left - (index + fraction) * step
        return remaining if remaining > 1e-12 else 0.0
