"""Where a joint rests in the cold: HYST relaxed, torques balanced."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.control.plant.rotor import Motion
from muscle_bayes.physics.bisection import bisect
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.memory import rested
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.state import Drive

REST_ROUNDS = 6
"""Times that rest and what is remembered there are found in turn."""
LONGEST_HYST = 3.0
"""Strain beyond which no relaxed HYST is looked for."""


def relaxed_hyst(plant: Plant, q: Scalar, drive: Drive) -> Float[Array, "2"]:
    """sigma_hyst of both sides at which HYST no longer moves while the rotor is held at q."""
    still = jnp.zeros_like(q)
    low, high = jnp.zeros(2), jnp.full(2, LONGEST_HYST)
    return bisect(lambda hyst: plant.hyst_rate(q, still, hyst, drive), low, high)


def angles_between(plant: Plant) -> tuple[Scalar, Scalar]:
    """Angles [rad] between which a joint may rest: its endstops, half a turn away at most."""
    low, high = (jnp.clip(jnp.asarray(stop), -jnp.pi, jnp.pi) for stop in plant.stops)
    return low, high


def balanced(plant: Plant, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
    """Angle [rad] at which the torques balance while HYST is held."""
    still = jnp.zeros(())
    return bisect(lambda q: plant.force(q, still, hyst, drive), *angles_between(plant))


def remembering_rest(plant: Plant, drive: Drive) -> Plant:
    """The plant with what its effects remember where it rests; itself where none remembers."""
    if not plant.memory_effects:
        return plant
    for _ in range(REST_ROUNDS):
        rest = at_rest(plant, drive)
        plant = rested(plant, rest.q, rest.hyst, drive)
    return plant


def at_rest(plant: Plant, drive: Drive) -> Motion:
    """The state that a joint left alone for long comes to, what is remembered being held."""
    still = jnp.zeros(())

    def force(q):
        return plant.force(q, still, relaxed_hyst(plant, q, drive), drive)

    q = bisect(force, *angles_between(plant))
    return Motion(q, still, relaxed_hyst(plant, q, drive))
