"""What effects with memory remember where a plant has long been held."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from muscle_bayes.physics.effect import MemoryEffect
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.state import Drive

FIRST_REST, REST_RATIO, REST_STEPS = 0.1, 8.0, 8
"""Times [s] for which a state goes on at its first rate, to pass its rest at last: up to 20 days."""
REST_HALVINGS = 28
"""Halvings towards a rest, which a step of Newton ends."""
REST_ROUNDS = 2
"""Times that the states' rests are found in turn."""

Memory = dict[str, Float[Array, "2"]]
"""States of the effects with memory on sides A and B, by name."""

At = tuple[Scalar, Float[Array, "2"], Drive]
"""Coordinate, sigma_hyst of both sides, and drive."""


def _rate_at(value: Scalar, plant: Plant, effect: MemoryEffect, side: int, at: At) -> Scalar:
    """Rate of one state where it has this value and everything else is held."""
    own = jnp.asarray(plant.memory[effect.name]).at[side].set(value)
    states = {**plant.memory, effect.name: own}
    q, hyst, drive = at
    return plant.remembering(states).memory_rate(effect, side, q, jnp.zeros_like(q), hyst, drive)


def _rest_of(plant: Plant, effect: MemoryEffect, side: int, at: At) -> Scalar:
    """Where one state's rate becomes 0, from its initial value, everything else held.

    Its rate falls with it, in a muscle whose MODULUS is about to shut a thousand times faster on one
    side of its rest than on the other: steps in time would go to and fro for ever. The root found
    carries the derivatives of the implicit function.
    """

    def rate_at(value: Scalar, plant: Plant, at: At) -> Scalar:
        return _rate_at(value, plant, effect, side, at)

    begun = effect.initial() * jnp.ones_like(plant.memory[effect.name][side])
    still = jax.tree.map(jax.lax.stop_gradient, (plant, at, begun))
    held, there, low = still
    first = rate_at(low, held, there)

    # First ever longer steps until the rest is passed, then halvings towards it: one look at the rate
    # serves both, for each use of it is compiled anew.
    def closer(count: Int[Array, ""], now: tuple[Scalar, Scalar, Scalar]) -> Any:
        ahead, near, far = now
        widening = count < REST_STEPS
        share = jnp.where(widening, 1.0, 0.5 * (near + far))
        beyond = first * rate_at(low + first * share * ahead, held, there) <= 0.0
        ahead = jnp.where(widening & ~beyond, REST_RATIO * ahead, ahead)
        near = jnp.where(widening | beyond, near, share)
        return ahead, near, jnp.where(~widening & beyond, share, far)

    begin = jnp.full_like(low, FIRST_REST), jnp.zeros_like(low), jnp.ones_like(low)
    ahead, near, far = jax.lax.fori_loop(0, REST_STEPS + REST_HALVINGS, closer, begin)
    share = 0.5 * (near + far)
    value = jnp.where(first == 0.0, low, low + first * share * ahead)
    unit = jnp.ones_like(value)
    missing, slope = jax.jvp(lambda x: rate_at(x, plant, at), (value,), (unit,))
    slope = jax.lax.stop_gradient(slope)
    falls = slope < 0.0
    return jnp.where(falls, value - missing / jnp.where(falls, slope, -1.0), begun)


def rested(plant: Plant, q: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Plant:
    """The plant remembering what it would if it had long been held like this."""
    effects, at = plant.memory_effects, (q, hyst, drive)
    if not effects:
        return plant

    def in_turn(_: int, memory: Memory) -> Memory:
        for effect in effects:
            now = plant.remembering(memory)
            states = [
                _rest_of(now, effect, side, at)
                if side in plant.muscles
                else memory[effect.name][side]
                for side in (0, 1)
            ]
            memory = memory | {effect.name: jnp.stack(states)}
        return memory

    begun = {one.name: jnp.ones(2) * one.initial() for one in effects}
    if len(effects) == 1:
        return plant.remembering(in_turn(0, begun))
    return plant.remembering(jax.lax.fori_loop(0, REST_ROUNDS, in_turn, begun))


def starting(plant: Plant, q: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Plant:
    """The plant remembering what it does in a run's first row."""
    plant = rested(plant, q, hyst, drive)
    return plant.remembering(
        {one.name: one.begun(plant.memory[one.name]) for one in plant.memory_effects}
    )
