"""What effects with memory remember, moved over each interval beside coordinate and HYST."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from muscle_bayes.physics.effect import MemoryEffect
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.plant import Drive, Plant
from muscle_bayes.physics.schedule import Schedule

Memory = dict[str, Float[Array, "2"]]
"""States of the effects with memory on sides A and B, by name."""

STRAIGHT = 1e-3
"""Exponents up to which (exp(z) - 1) / z is taken from its series."""
FIRST_REST, REST_RATIO, REST_STEPS = 0.1, 8.0, 8
"""Times [s] for which a state goes on at its first rate, to pass its rest at last: up to 20 days."""
REST_HALVINGS = 28
"""Halvings towards a rest, which a step of Newton ends."""
REST_ROUNDS = 2
"""Times that the states' rests are found in turn."""

once = jax.lax.optimization_barrier


class Remembered(NamedTuple):
    """State of a motion and what is remembered in it."""

    motion: Any
    """SlowState or FastState."""
    memory: Memory


def _mean_decay(z: Scalar) -> Scalar:
    """(exp(z) - 1) / z."""
    near = jnp.abs(z) < STRAIGHT
    safe = jnp.where(near, 1.0, z)
    return jnp.where(near, 1.0 + z * (0.5 + z / 6.0), jnp.expm1(safe) / safe)


At = tuple[Scalar, Float[Array, "2"], Drive]
"""Coordinate, sigma_hyst of both sides, and drive."""


def _rate_at(value: Scalar, plant: Plant, name: str, side: int, at: At) -> Scalar:
    """Rate of one state where it has this value and everything else is held."""
    effect = next(one for one in plant.memory_effects if one.name == name)
    states = plant.memory | {name: plant.memory[name].at[side].set(value)}
    now, (q, hyst, drive) = plant.remembering(states), at
    instant = now.instants(q, jnp.zeros_like(q), hyst, drive)[side]
    return effect.rate(now.muscles[side].signals(instant, now.instant_effects))


def _moved(
    plant: Plant, effect: MemoryEffect, side: int, origin: Scalar, at: At, duration: Scalar
) -> Scalar:
    """One state after `duration` [s] from `origin`, its rate straight about the plant's memory."""
    held = plant.memory[effect.name]

    def rate_at(value: Scalar) -> Scalar:
        return _rate_at(value, plant, effect.name, side, at)

    rate, slope = jax.jvp(rate_at, (held[side],), (jnp.ones_like(held[side]),))
    slope = jnp.minimum(slope, 0.0)
    pull = rate + slope * (origin - held[side])
    return origin + duration * _mean_decay(slope * duration) * pull


def advanced(
    plant: Plant, origin: Memory, q: Scalar, hyst: Float[Array, "2"], drive: Drive, duration: Scalar
) -> Memory:
    """All states after `duration` [s] from `origin`, everything else held.

    Their rates are straight about what `plant` remembers.
    """
    return {
        effect.name: jnp.stack(
            [
                _moved(plant, effect, side, origin[effect.name][side], (q, hyst, drive), duration)
                if side in plant.muscles
                else origin[effect.name][side]
                for side in (0, 1)
            ]
        )
        for effect in plant.memory_effects
    }


def _rest_of(plant: Plant, effect: MemoryEffect, side: int, at: At) -> Scalar:
    """Where one state's rate becomes 0, from its initial value, everything else held.

    Its rate falls with it, in a muscle whose MODULUS is about to shut a thousand times faster on one
    side of its rest than on the other: steps in time would go to and fro for ever. The root found
    carries the derivatives of the implicit function.
    """

    def rate_at(value: Scalar, plant: Plant, at: At) -> Scalar:
        return _rate_at(value, plant, effect.name, side, at)

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


Step = Callable[[Plant, Any, Schedule, Int[Array, ""]], Any]


class Motion(NamedTuple):
    """One interval of a motion in two parts, between which memory moves."""

    cross: Step
    """Across the interval, memory being that of its middle."""
    middle: Callable[[Any, Any], Scalar]
    """Coordinate in the middle, from the states before and after `cross` [rad or m]."""
    arrive: Step
    """What depends on the memory at the interval's end."""


def remembering(motion: Motion) -> Step:
    """The step of a motion and of what its effects remember.

    Exponential midpoint rule (Hochbruck and Ostermann, Acta Numerica 19, 2010, section 2.4): memory
    goes to the middle of the interval, the motion across the interval with that memory, and memory
    across it with the motion's middle. Second order, L-stable for a motion that is held.
    """

    def advance(plant: Plant, state: Remembered, schedule: Schedule, index: Int[Array, ""]) -> Any:
        begun, memory = state
        duration = schedule.time[index + 1] - schedule.time[index]
        before, after = schedule.temperature[index], schedule.temperature[index + 1]
        first = Drive(before, schedule.load[index], schedule.applied[index])
        middle = first._replace(temperature=0.5 * (before + after))
        now = plant.remembering(memory)
        half = once(advanced(now, memory, begun.q, begun.hyst, first, 0.5 * duration))
        now = plant.remembering(half)
        crossed = once(motion.cross(now, begun, schedule, index))
        q, hyst = motion.middle(begun, crossed), 0.5 * (begun.hyst + crossed.hyst)
        memory = once(advanced(now, memory, q, hyst, middle, duration))
        return Remembered(
            motion.arrive(plant.remembering(memory), crossed, schedule, index), memory
        )

    return advance
