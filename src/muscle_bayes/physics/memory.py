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
REST_STEPS = 20
FIRST_REST, REST_RATIO = 0.1, 4.0
"""First step towards rest [s], and how much longer than the last each other step is."""

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


def _moved(
    plant: Plant,
    effect: MemoryEffect,
    side: int,
    origin: Scalar,
    at: tuple[Scalar, Float[Array, "2"], Drive],
    duration: Scalar,
) -> Scalar:
    """One state after `duration` [s] from `origin`, its rate straight about the plant's memory."""
    held = plant.memory[effect.name]

    def rate_at(value: Scalar) -> Scalar:
        states = plant.memory | {effect.name: held.at[side].set(value)}
        now, (q, hyst, drive) = plant.remembering(states), at
        instant = now.instants(q, jnp.zeros_like(q), hyst, drive)[side]
        return effect.rate(now.muscles[side].signals(instant, now.instant_effects))

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


def rested(plant: Plant, q: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Plant:
    """The plant remembering what it would if it had long been held like this."""
    effects = plant.memory_effects
    if not effects:
        return plant
    first = {effect.name: jnp.broadcast_to(effect.initial(), (2,)) * 1.0 for effect in effects}

    def longer(memory: Memory, duration: Scalar) -> tuple[Memory, None]:
        return advanced(plant.remembering(memory), memory, q, hyst, drive, duration), None

    durations = FIRST_REST * REST_RATIO ** jnp.arange(REST_STEPS, dtype=q.dtype)
    return plant.remembering(jax.lax.scan(longer, first, durations)[0])


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
