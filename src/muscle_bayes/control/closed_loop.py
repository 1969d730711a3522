"""The loop closed: sensors, law, heaters, rotor and muscles, period after period."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.control.laws.law import Law, Measured
from muscle_bayes.control.plant.heater import HeaterState
from muscle_bayes.control.plant.joint import Joint
from muscle_bayes.control.plant.rest import at_rest, balanced, remembering_rest
from muscle_bayes.control.plant.rotor import Motion, advance
from muscle_bayes.control.scenarios.scenario import Course
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.materialise import materialise
from muscle_bayes.physics.memory import Memory
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.solvers.exponential_midpoint import exponential_step, paired, stacked
from muscle_bayes.physics.springs import tensile_strain
from muscle_bayes.physics.state import Drive

TRAINING_TENSION = 0.060 * 9.80665 * 0.0889 / 0.030
"""Tension of a muscle in training: 60 g on the disc of the bench's fixture [N]."""


class Clock(eqx.Module):
    """Control period [s] and the number of steps in which plant and muscles cross it."""

    period: float = eqx.field(static=True, default=0.03)
    substeps: int = eqx.field(static=True, default=3)

    @property
    def step(self) -> float:
        """s"""
        return self.period / self.substeps


class Trace(NamedTuple):
    """What a loop did, one value a period, at its start; duty is that of the period."""

    angle: Float[Array, " period"]
    """True angle [rad]."""
    temperature: Float[Array, "period 2"]
    """C"""
    duty: Float[Array, "period 2"]
    """0 to 255"""
    hyst: Float[Array, "period 2"]


class _Loop(NamedTuple):
    """State of plant, sensors and law."""

    motion: Motion
    heat: HeaterState
    lagged: tuple[Float[Array, "2"], ...]
    """Temperatures behind each temperature filter of the plant [C]."""
    memory: Memory
    """What effects with memory remember of both muscles."""
    late: Float[Array, " delay"]
    """Readings that the controller has not seen yet, oldest first."""
    probe: Float[Array, "2"]
    """Temperatures of the thermocouples [C]."""
    held: Float[Array, "2"]
    """Their readings [C]."""
    law: Any


def _crossed(
    plant: Plant, motion: Motion, memory: Memory, drive: Drive, step: float
) -> tuple[Motion, Memory]:
    """Rotor and muscles after one step, and what effects remember then: exponential midpoint rule."""
    if not memory:
        return materialise(advance(plant, motion, drive, step)), memory

    def moved(at: Motion, held: Memory, duration: float) -> Memory:
        def rates(now: Mapping[str, Any]) -> Mapping[str, Any]:
            return plant.remembering(now).memory_rates(at.q, at.speed, at.hyst, drive)

        over = jnp.asarray(duration)
        return materialise(stacked(exponential_step(rates, paired(held), paired(memory), over)))

    half = moved(motion, memory, 0.5 * step)
    after = materialise(advance(plant.remembering(half), motion, drive, step))
    middle = jax.tree.map(lambda a, b: 0.5 * (a + b), motion, after)
    return after, moved(middle, half, step)


def resting_plant(joint: Joint) -> Plant:
    """The joint's plant, remembering what it does where it rests in the cold without load."""
    cold = jnp.full(2, joint.heater.room)
    return remembering_rest(joint.plant, Drive(cold, jnp.zeros(()), jnp.zeros(())))


def start_of(joint: Joint, load: Scalar, trained: Scalar) -> Motion:
    """At rest and cold: muscles that have relaxed in the joint, or that come from training.

    Training at a small load leaves HYST short; mounted, it creeps towards the joint's tension.
    """
    cold = Drive(jnp.full(2, joint.heater.room), load, jnp.zeros(()))
    plant = remembering_rest(joint.plant, cold)
    rest = at_rest(plant, cold)
    hyst = jnp.where(trained > 0.0, _trained_hyst(plant), rest.hyst)
    return Motion(balanced(plant, hyst, cold), rest.speed, hyst)


def _trained_hyst(plant: Plant) -> Float[Array, "2"]:
    """sigma_hyst of both muscles as their training leaves it."""
    tension, short = jnp.asarray(TRAINING_TENSION), []
    for side in plant.muscles.values():
        stiffness = side.base_length * side.parameters.K_hyst
        short.append(tensile_strain(tension, stiffness, side.parameters.F_hyst_min))
    return jnp.stack(short)


def simulate(
    joint: Joint, law: Law, course: Course, start: Motion, key: Array, clock: Clock
) -> Trace:
    """The closed loop over a course, from rest at `start` with cold heaters.

    Each period: the potentiometer is read, the law sees its reading of `delay` periods ago and the
    thermocouples' last, duties are set, and heaters, rotor and HYST go on for one period.
    """
    plant, room, step = joint.plant, joint.heater.room, clock.step
    heat_step = joint.heater.step(step)
    sensor, meter = joint.potentiometer, joint.thermocouples
    count = course.setpoint.shape[0]
    noise = course.disturbed * jax.random.normal(key, (count, 2))
    setpoint = jnp.round(sensor.counts(course.setpoint))
    filters = plant.temperature_filters
    renewed = jnp.arange(count) % meter.every == 0

    def cross(loop: _Loop, load: Scalar, duty: Float[Array, "2"]) -> _Loop:
        motion, heat, lagged, memory = loop.motion, loop.heat, loop.lagged, loop.memory
        for _ in range(clock.substeps):
            before, heat = room + heat.excess, heat_step(heat, duty)
            after = room + heat.excess
            later = []
            for one, late in zip(filters, lagged, strict=True):
                later.append(one.advance(late, before, after, jnp.asarray(step)))
                before, after = late, later[-1]
            lagged = tuple(later)
            drive = Drive(0.5 * (before + after), load, jnp.zeros(()))
            motion, memory = _crossed(plant, motion, memory, drive, step)
        return loop._replace(motion=motion, heat=heat, lagged=lagged, memory=memory)

    def period(loop: _Loop, now: tuple) -> tuple[_Loop, Trace]:
        aim, load, disturbance, renew = now
        temperature = room + loop.heat.excess
        reading = sensor.read(loop.motion.q, disturbance[0])
        late = jnp.concatenate([loop.late, reading[None]])
        probe = meter.follow(loop.probe, temperature, clock.period)
        held = jnp.where(renew, meter.read(probe, disturbance[1]), loop.held)
        state, duty = law.update(loop.law, Measured(aim, late[0], held))
        seen = Trace(loop.motion.q, temperature, duty, loop.motion.hyst)
        loop = loop._replace(late=late[1:], probe=probe, held=held, law=state)
        return cross(loop, load, duty), seen

    cold = jnp.full(2, room)
    first = sensor.read(start.q, jnp.zeros(()))
    loop = _Loop(
        start,
        HeaterState(jnp.zeros(2), jnp.zeros(2)),
        tuple(cold for _ in filters),
        remembering_rest(plant, Drive(cold, course.load[0], jnp.zeros(()))).memory,
        jnp.repeat(first, sensor.delay),
        cold,
        cold,
        law.initial(first),
    )
    _, trace = jax.lax.scan(period, loop, (setpoint, course.load, noise, renewed))
    return trace
