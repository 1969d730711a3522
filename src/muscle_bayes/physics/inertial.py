"""Fast motion: full inertia, dry friction that really sticks, reversals resolved inside the step."""

from typing import NamedTuple

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


def _rk4(plant: Plant, state: FastState, sign: Scalar, drives, duration: Scalar) -> FastState:
    """Classical Runge-Kutta step with the sign of the dry friction held; sign 0 means stuck."""
    inertia = plant.inertia(drives(0.0).load)
    moving = sign != 0.0

    def rate(y: FastState, fraction: float) -> FastState:
        drive = drives(fraction)
        dry = plant.dry_friction(y.q, y.speed, y.hyst, drive)
        force = plant.force(y.q, y.speed, y.hyst, drive) - sign * dry
        hyst = plant.hyst_rate(y.q, y.speed, y.hyst, drive)
        speed = jnp.where(moving, y.speed, 0.0)
        return FastState(speed, jnp.where(moving, force / inertia, 0.0), hyst)

    def ahead(y: FastState, slope: FastState, step) -> FastState:
        return FastState(*(a + step * b for a, b in zip(y, slope, strict=True)))

    k1 = rate(state, 0.0)
    k2 = rate(ahead(state, k1, 0.5 * duration), 0.5)
    k3 = rate(ahead(state, k2, 0.5 * duration), 0.5)
    k4 = rate(ahead(state, k3, duration), 1.0)
    mean = FastState(
        *((a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
    )
    return ahead(state, mean, duration)


def _forces(plant: Plant, state: FastState, drive: Drive) -> tuple[Scalar, Scalar]:
    """Generalised force of all but dry friction, and the magnitude of that."""
    at = state.q, state.speed, state.hyst, drive
    return plant.force(*at), plant.dry_friction(*at)


def _slip_sign(state: FastState, force: Scalar, dry: Scalar) -> Scalar:
    """Direction in which dry friction is overcome at this state, 0 if it sticks."""
    # So written, a force that is not finite moves the rotor instead of passing for a stuck one.
    breaks_away = jnp.where(jnp.abs(force) <= dry, 0.0, jnp.sign(force))
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

    def drive_at(fraction) -> Drive:
        return Drive(before + fraction * (after - before), load, applied)

    force, dry = _forces(plant, state, drive_at(0.0))
    sign, inertia = _slip_sign(state, force, dry), plant.inertia(load)
    whole = _rk4(plant, state, sign, drive_at, duration)
    end_force, end_dry = _forces(plant, whole, drive_at(1.0))
    reverses = (sign * whole.speed < 0.0) & (state.speed != 0.0)
    accelerations = (force - sign * dry) / inertia, (end_force - sign * end_dry) / inertia
    when = _reversal(duration, state.speed, accelerations[0], whole.speed, accelerations[1])
    when = jnp.where(reverses, when, duration)
    share = when / jnp.where(duration > 0.0, duration, 1.0)

    turned = _rk4(plant, state, sign, lambda f: drive_at(f * share), when)
    turned = turned._replace(speed=jnp.zeros_like(turned.speed))
    new_sign = _slip_sign(turned, *_forces(plant, turned, drive_at(share)))
    left = duration - when
    back = _rk4(plant, turned, new_sign, lambda f: drive_at(share + f * (1.0 - share)), left)
    end = FastState(*(jnp.where(reverses, a, b) for a, b in zip(back, whole, strict=True)))
    return _at_stops(plant, end)


def _at_stops(plant: Plant, state: FastState) -> FastState:
    """Endstops take all speed that points into them."""
    low, high = plant.stops
    into = ((state.q >= high) & (state.speed > 0.0)) | ((state.q <= low) & (state.speed < 0.0))
    speed = jnp.where(into, 0.0, state.speed)
    return state._replace(q=jnp.clip(state.q, low, high), speed=speed)
