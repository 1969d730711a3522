"""Full inertia, dry friction that really sticks, reversals located inside the step."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import diffrax
import equinox.internal as eqxi
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.materialise import materialise
from muscle_bayes.physics.schedule import Segment
from muscle_bayes.physics.solvers.exponential_midpoint import (
    Memory,
    exponential_step,
    paired,
    stacked,
)
from muscle_bayes.physics.solvers.plant_solver import PlantSolver
from muscle_bayes.physics.solvers.play import Stops
from muscle_bayes.physics.state import Pair, PlantState


class StickSlip(PlantSolver):
    """dv/dt = a(t, y) - d(t, y) sign(v), v = 0 while |a| <= d at rest: fourth order.

    A classical Runge-Kutta step with the sign of dry friction held. If the speed has reversed at its
    end, a cubic is laid through both ends' speeds and accelerations, and the step ends at its zero. The
    coordinate there is that cubic's integral; HYST is the cubic through its own values and rates. From
    there a second Runge-Kutta step slips back, or sticks, until the end. Breaking away from rest waits
    for the next node, which is second order where heat causes it. A second reversal in one step is not
    seen, so steps should be no longer than a twentieth of the rotor's period. States of effects with
    memory move by the exponential midpoint rule, second order.

    `stops`: endstops; None: those of the plant that `simulate` is given, or none without it.
    `newton_steps`: of the search for the reversal, from a regula-falsi start; more than 6 change
    nothing in double precision.
    """

    stops: Stops | None = None
    newton_steps: int = 6

    def order(self, terms: Any) -> int:
        return 4

    def advance(
        self, terms: diffrax.MultiTerm, drive: Segment, y: PlantState, first: Bool[Array, ""]
    ) -> PlantState:
        if not y.memory:
            return self._crossed(terms, drive, y)
        smooth, duration = terms.terms[0].vf, drive.t1 - drive.t0
        begin = y._replace(memory=paired(y.memory))

        def moved(t: Scalar, at: PlantState, over: Scalar) -> Memory:
            def rates(memory: Memory) -> Mapping[str, Array | Pair]:
                return smooth(t, at._replace(memory=memory), drive).memory

            return materialise(exponential_step(rates, at.memory, begin.memory, over))

        half = begin._replace(memory=moved(drive.t0, begin, 0.5 * duration))
        end = materialise(self._crossed(terms, drive, half))
        middle = jax.tree.map(lambda a, b: 0.5 * (a + b), half, end)
        memory = moved(0.5 * (drive.t0 + drive.t1), middle, duration)
        return end._replace(memory=stacked(memory))

    def _crossed(self, terms: diffrax.MultiTerm, drive: Segment, y: PlantState) -> PlantState:
        """The state at the drive's end, memory being held."""
        leg = _Leg(terms, drive)

        def to_reversal(now: _Underway) -> _Underway:
            t, left, y = now
            slope = leg.first_slope(t, y)
            whole = leg.end(t, y, slope, left)
            reverses = (slope.sign * whole.speed < 0.0) & (y.speed != 0.0)
            arrived = _Underway(t + left, jnp.zeros_like(left), whole)

            def turned() -> _Underway:
                after = leg.slope(t + left, whole, slope.sign)
                share, there = self._reversal(y, slope.rate, whole, after.rate, left, reverses)
                turned = materialise(_Underway(t + share * left, (1.0 - share) * left, there))
                return jax.tree.map(lambda a, b: jnp.where(reverses, a, b), turned, arrived)

            # Reversals are rare: what they take is only done where any of a batch has one.
            return jax.lax.cond(eqxi.unvmap_any(reverses), turned, lambda: arrived)

        def one_leg(now: _Underway, _: None) -> tuple[_Underway, None]:
            onward = eqxi.unvmap_any(now.left > 0.0)
            return jax.lax.cond(onward, to_reversal, lambda now: now, now), None

        # To the reversal and back: a loop, so that a leg is compiled once.
        begin = _Underway(drive.t0, drive.t1 - drive.t0, y)
        return self._at_stops(jax.lax.scan(one_leg, begin, length=2)[0].y)

    def _reversal(
        self,
        begin: PlantState,
        before: PlantState,
        end: PlantState,
        after: PlantState,
        duration: Scalar,
        reverses: Bool[Array, ""],
    ) -> tuple[Scalar, PlantState]:
        """Share of the step after which speed is 0, and the state then."""
        v0, a0, v1, a1 = begin.speed, before.speed * duration, end.speed, after.speed * duration
        rise = v1 - v0
        c2, c3 = 3.0 * rise - 2.0 * a0 - a1, a0 + a1 - 2.0 * rise
        start = jnp.where(reverses, v0 / jnp.where(reverses, -rise, 1.0), 0.5)

        def closer(x: Scalar, speed: tuple[Scalar, ...]) -> Scalar:
            v0, a0, c2, c3 = speed
            value = v0 + x * (a0 + x * (c2 + x * c3))
            slope = jax.lax.stop_gradient(a0 + x * (2.0 * c2 + 3.0 * x * c3))
            newton = x - value / jnp.where(slope == 0.0, 1.0, slope)
            return jnp.where((slope == 0.0) | (newton < 0.0) | (newton > 1.0), x, newton)

        speed = v0, a0, c2, c3
        still, x = jax.lax.stop_gradient((speed, start))
        x = jax.lax.fori_loop(0, self.newton_steps, lambda _, x: closer(x, still), x)
        # One more step with the slope held fixed carries the derivative of the implicit equation.
        x = materialise(closer(x, speed))
        travelled = x * (v0 + x * (a0 / 2.0 + x * (c2 / 3.0 + x * c3 / 4.0)))

        def cubic(y0: Scalar, rate0: Scalar, y1: Scalar, rate1: Scalar) -> Scalar:
            rise = y1 - y0
            curved = (1.0 - x) * (duration * rate0 - rise) + x * (rise - duration * rate1)
            return y0 + x * rise + x * (1.0 - x) * curved

        hyst = jax.tree.map(cubic, begin.hyst, before.hyst, end.hyst, after.hyst)
        q, rest = begin.q + duration * travelled, jnp.zeros_like(v0)
        return x, begin._replace(q=q, speed=rest, hyst=hyst)

    def _at_stops(self, y: PlantState) -> PlantState:
        """Endstops take all speed that points into them."""
        if self.stops is None:
            return y
        low, high = self.stops
        into = ((y.q >= high) & (y.speed > 0.0)) | ((y.q <= low) & (y.speed < 0.0))
        return y._replace(q=jnp.clip(y.q, low, high), speed=jnp.where(into, 0.0, y.speed))


class _Underway(NamedTuple):
    """A state within a step."""

    t: Scalar
    left: Scalar
    """Of the step [s]."""
    y: PlantState


class _Slope(NamedTuple):
    """Derivative of a state, memory held."""

    rate: PlantState
    sign: Scalar
    """Of the motion that dry friction opposes; 0 while the rotor sticks."""


class _Leg(NamedTuple):
    """Motion in one direction, or rest."""

    terms: diffrax.MultiTerm
    drive: Segment

    def _accelerations(self, t: Scalar, y: PlantState) -> tuple[PlantState, Scalar]:
        smooth, dry = self.terms.terms
        return smooth.vf(t, y, self.drive), dry.vf(t, y, self.drive).speed

    def first_slope(self, t: Scalar, y: PlantState) -> _Slope:
        """The derivative where a leg begins."""
        smooth, dry = self._accelerations(t, y)
        # So written, a force that is not finite moves the rotor instead of passing for a stuck one.
        breaks_away = jnp.where(jnp.abs(smooth.speed) <= dry, 0.0, jnp.sign(smooth.speed))
        sign = jnp.where(y.speed == 0.0, breaks_away, jnp.sign(y.speed))
        return _held(smooth, dry, sign)

    def slope(self, t: Scalar, y: PlantState, sign: Scalar) -> _Slope:
        """The derivative while the sign of dry friction is held; sign 0 means stuck."""
        return _held(*self._accelerations(t, y), sign)

    def end(self, t: Scalar, y: PlantState, first: _Slope, duration: Scalar) -> PlantState:
        """State after `duration`, by the classical Runge-Kutta rule from its first slope."""
        half = 0.5 * duration

        def ahead(rate: PlantState, step: Scalar) -> PlantState:
            return jax.tree.map(lambda a, b: a + step * b, y, rate)

        def rate(rate: PlantState, step: Scalar) -> PlantState:
            return self.slope(t + step, ahead(rate, step), first.sign).rate

        k1 = first.rate
        k2 = rate(k1, half)
        k3 = rate(k2, half)
        k4 = rate(k3, duration)
        return ahead(
            jax.tree.map(lambda a, b, c, d: (a + 2 * b + 2 * c + d) / 6, k1, k2, k3, k4), duration
        )


def _held(smooth: PlantState, dry: Scalar, sign: Scalar) -> _Slope:
    moves = sign != 0.0
    rate = PlantState(
        q=jnp.where(moves, smooth.q, 0.0),
        speed=jnp.where(moves, smooth.speed - sign * dry, 0.0),
        hyst=smooth.hyst,
        memory=jax.tree.map(jnp.zeros_like, smooth.memory),
    )
    return _Slope(rate, sign)
