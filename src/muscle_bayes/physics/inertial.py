"""Fast motion: full inertia, dry friction that really sticks, reversals resolved inside the step."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.plant import Drive, Plant
from muscle_bayes.physics.schedule import Schedule

REVERSAL_ITERATIONS = 6
"""Newton iterations on a cubic from a regula-falsi start: more change nothing in double precision."""


class FastState(NamedTuple):
    """State of fast motion."""

    q: Scalar
    """Coordinate [rad or m]."""
    speed: Scalar
    """dq/dt [rad/s or m/s]."""
    hyst: Float[Array, "2"]
    """sigma_hyst of sides A and B."""


class Forces(NamedTuple):
    """Generalised forces [N m or N]."""

    smooth: Scalar
    """Of all but dry friction."""
    dry: Scalar
    """Magnitude of dry friction."""


def _forces(plant: Plant, state: FastState, drive: Drive) -> Forces:
    at = state.q, state.speed, state.hyst, drive
    return Forces(plant.force(*at), plant.dry_friction(*at))


def _rk4(
    plant: Plant,
    state: FastState,
    forces: Forces,
    sign: Scalar,
    drives: Callable[[float], Drive],
    duration: Scalar,
) -> FastState:
    """Classical Runge-Kutta step with the sign of the dry friction held; sign 0 means stuck.

    `forces` are those at its start.
    """
    inertia = plant.inertia(drives(0.0).load)
    moving = sign != 0.0

    def rate(y: FastState, forces: Forces, fraction: float) -> FastState:
        force = forces.smooth - sign * forces.dry
        hyst = plant.hyst_rate(y.q, y.speed, y.hyst, drives(fraction))
        speed = jnp.where(moving, y.speed, 0.0)
        return FastState(speed, jnp.where(moving, force / inertia, 0.0), hyst)

    def ahead(y: FastState, slope: FastState, step) -> FastState:
        return FastState(*(a + step * b for a, b in zip(y, slope, strict=True)))

    def rate_ahead(slope: FastState, fraction: float) -> FastState:
        y = ahead(state, slope, fraction * duration)
        return rate(y, _forces(plant, y, drives(fraction)), fraction)

    k1 = rate(state, forces, 0.0)
    k2 = rate_ahead(k1, 0.5)
    k3 = rate_ahead(k2, 0.5)
    k4 = rate_ahead(k3, 1.0)
    mean = FastState(
        *((a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
    )
    return ahead(state, mean, duration)


def _slip_sign(state: FastState, forces: Forces) -> Scalar:
    """Direction in which dry friction is overcome at this state, 0 if it sticks."""
    # So written, a force that is not finite moves the rotor instead of passing for a stuck one.
    breaks_away = jnp.where(jnp.abs(forces.smooth) <= forces.dry, 0.0, jnp.sign(forces.smooth))
    return jnp.where(state.speed == 0.0, breaks_away, jnp.sign(state.speed))


def _reversal(duration, v0, a0, v1, a1):
    """Time in (0, duration) at which the cubic through both ends' speeds and accelerations is zero."""
    rise = v1 - v0
    c2 = 3.0 * rise - duration * (2.0 * a0 + a1)
    c3 = duration * (a0 + a1) - 2.0 * rise
    x = v0 / jnp.where(rise == 0.0, 1.0, -rise)
    for _ in range(REVERSAL_ITERATIONS):
        value = v0 + x * (duration * a0 + x * (c2 + x * c3))
        slope = duration * a0 + x * (2.0 * c2 + 3.0 * x * c3)
        newton = x - value / jnp.where(slope == 0.0, 1.0, slope)
        x = jnp.where((slope == 0.0) | (newton < 0.0) | (newton > 1.0), x, newton)
    return x * duration


class _Leg(NamedTuple):
    """A part of an interval, slipped in one direction or stuck."""

    kind: Int[Array, ""]
    """Which of those below, or NONE_LEFT."""
    begun: FastState
    forces: Forces
    """At its start."""
    sign: Scalar
    """Of the dry friction."""
    start: Scalar
    """Share of the interval that lies before it."""
    span: Scalar
    """Its share of the interval."""
    ended: FastState
    """Where the leg before this one ended."""


WHOLE, TO_REVERSAL, FROM_REVERSAL, NONE_LEFT = range(4)


def fast_step(
    plant: Plant, state: FastState, schedule: Schedule, index: Int[Array, ""]
) -> FastState:
    """One interval: slip to its end or to the reversal of speed; from there slip back or stick.

    Fourth order in the interval's length, through one reversal; the drive must be smooth inside.
    Breaking away from rest waits for the next node, which is second order where heat causes it.
    """
    duration = schedule.time[index + 1] - schedule.time[index]
    before, after = schedule.temperature[index], schedule.temperature[index + 1]
    load, applied = schedule.load[index], schedule.applied[index]
    inertia = plant.inertia(load)

    def drive_at(fraction) -> Drive:
        return Drive(before + fraction * (after - before), load, applied)

    def next_leg(leg: _Leg) -> _Leg:
        ended = _rk4(
            plant,
            leg.begun,
            leg.forces,
            leg.sign,
            lambda share: drive_at(leg.start + share * leg.span),
            leg.span * duration,
        )
        turned = leg.kind == TO_REVERSAL
        ended = ended._replace(speed=jnp.where(turned, 0.0, ended.speed))
        forces = _forces(plant, ended, drive_at(leg.start + leg.span))
        reverses = (leg.sign * ended.speed < 0.0) & (leg.begun.speed != 0.0) & (leg.kind == WHOLE)
        a0, a1 = ((one.smooth - leg.sign * one.dry) / inertia for one in (leg.forces, forces))
        when = _reversal(duration, leg.begun.speed, a0, ended.speed, a1)
        share = jnp.where(reverses, when / jnp.where(duration > 0.0, duration, 1.0), leg.span)

        def chosen(new, old):
            return jax.tree.map(lambda a, b: jnp.where(turned, a, b), new, old)

        return _Leg(
            jnp.where(reverses, TO_REVERSAL, jnp.where(turned, FROM_REVERSAL, NONE_LEFT)),
            chosen(ended, leg.begun),
            chosen(forces, leg.forces),
            chosen(_slip_sign(ended, forces), leg.sign),
            chosen(leg.span, leg.start),
            chosen(1.0 - leg.span, share),
            ended,
        )

    # A loop, for reversals are rare: what they take is only done where there are any.
    forces = _forces(plant, state, drive_at(0.0))
    nothing, everything = jnp.zeros_like(duration), jnp.ones_like(duration)
    sign = _slip_sign(state, forces)
    first = _Leg(jnp.asarray(WHOLE), state, forces, sign, nothing, everything, state)
    last = jax.lax.while_loop(lambda leg: leg.kind != NONE_LEFT, next_leg, first)
    return _at_stops(plant, last.ended)


def _at_stops(plant: Plant, state: FastState) -> FastState:
    """Endstops take all speed that points into them."""
    low, high = plant.stops
    into = ((state.q >= high) & (state.speed > 0.0)) | ((state.q <= low) & (state.speed < 0.0))
    speed = jnp.where(into, 0.0, state.speed)
    return state._replace(q=jnp.clip(state.q, low, high), speed=speed)
