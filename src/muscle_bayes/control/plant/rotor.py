"""The joint's rotor with full inertia, at steps that a control period leaves room for."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.materialise import materialise
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.state import Drive


class Motion(NamedTuple):
    """State of rotor and muscles."""

    q: Scalar
    """Angle [rad]."""
    speed: Scalar
    """rad/s"""
    hyst: Float[Array, "2"]
    """sigma_hyst of sides A and B."""


class _Tangent(NamedTuple):
    """Force near a state, to first order: force + by_q dq + by_speed dv."""

    force: Scalar
    by_q: Scalar
    by_speed: Scalar

    def gain_of_speed(self, speed: Scalar, push: Scalar, inertia: Scalar, span: Scalar) -> Scalar:
        """v(span) - v(0) by the linearly implicit midpoint rule, `push` being the force at the start,
        dry friction taken off."""
        stiff = inertia - 0.25 * span**2 * self.by_q - 0.5 * span * self.by_speed
        return span * (push + 0.5 * span * self.by_q * speed) / stiff


def _direction(force: Scalar, speed: Scalar, dry: Scalar) -> Scalar:
    """Sign of the motion that dry friction opposes; 0 while the rotor sticks."""
    breaks_away = jnp.where(jnp.abs(force) <= dry, 0.0, jnp.sign(force))
    return jnp.where(speed == 0.0, breaks_away, jnp.sign(speed))


def advance(plant: Plant, motion: Motion, drive: Drive, duration: float) -> Motion:
    """One step of `duration` [s] with the drive of its middle.

        J v' = f(q, v) - D(v) sign(v),  q' = v,   f to first order about the start:
        v1 - v0 = h (f - D sign + h/2 f_q v0) / (J - h^2/4 f_q - h/2 f_v),   q1 - q0 = h (v0 + v1) / 2

    The linearly implicit midpoint rule (Hairer and Wanner, Solving ODEs II, IV.7): second order,
    A-stable however stiff touching coils are, and without damping of its own. Where the speed
    reverses inside the step, the rotor stops there, and sticks or turns back with what is left. Dry
    friction that depends on speed is that of the step's middle, found by one look ahead.
    HYST, a thousand times slower, takes an explicit step along the way.
    """

    def force(q: Scalar, speed: Scalar) -> Scalar:
        return plant.force(q, speed, motion.hyst, drive)

    start, slope = jax.linearize(force, motion.q, motion.speed)
    zero, one = jnp.zeros_like(motion.q), jnp.ones_like(motion.q)
    near = _Tangent(*materialise((start, slope(one, zero), slope(zero, one))))
    start = near.force
    inertia, q, speed = plant.inertia(drive.load), motion.q, motion.speed

    def dry_at(speed: Scalar) -> Scalar:
        return plant.dry_friction(q, speed, motion.hyst, drive)

    at_rest = dry_at(zero)
    direction = _direction(start, speed, at_rest)
    moves = (direction != 0.0) | (at_rest == 0.0)
    dry = dry_at(speed)
    ahead = near.gain_of_speed(speed, start - dry * direction, inertia, duration)
    dry = dry_at(speed + 0.5 * ahead)
    gained = near.gain_of_speed(speed, start - dry * direction, inertia, duration)
    after = jnp.where(moves, speed + gained, 0.0)
    whole = q + 0.5 * duration * (speed + after)

    reverses = (at_rest > 0.0) & (speed * after < 0.0)
    when = duration * speed / jnp.where(reverses, speed - after, 1.0)
    left = jnp.where(reverses, duration - when, 0.0)
    turn = q + 0.5 * when * speed
    there = start + near.by_q * (turn - q) - near.by_speed * speed
    back = _direction(there, zero, at_rest)
    gained = near.gain_of_speed(zero, there - at_rest * back, inertia, left)
    gained = jnp.where(back != 0.0, gained, 0.0)
    q_end = jnp.where(reverses, turn + 0.5 * left * gained, whole)
    q_end, speed_end = materialise((q_end, jnp.where(reverses, gained, after)))

    rate = plant.hyst_rate(0.5 * (q + q_end), 0.5 * (speed + speed_end), motion.hyst, drive)
    return _at_stops(plant, Motion(q_end, speed_end, motion.hyst + duration * rate))


def _at_stops(plant: Plant, motion: Motion) -> Motion:
    """Endstops take all speed that points into them."""
    low, high = plant.stops
    into = ((motion.q >= high) & (motion.speed > 0)) | ((motion.q <= low) & (motion.speed < 0))
    return motion._replace(
        q=jnp.clip(motion.q, low, high), speed=jnp.where(into, 0.0, motion.speed)
    )
