"""The plant: one coordinate, an element on each side, a load, friction, and a tuple of effects."""

import dataclasses
from collections.abc import Mapping

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.physics.actuators import Actuator, KnownForce
from muscle_bayes.physics.effect import (
    CourseFilter,
    Effect,
    MemoryEffect,
    Port,
    ReadingFilter,
    Signals,
    TemperatureFilter,
)
from muscle_bayes.physics.elements import Element, Instant, Muscle, through_port
from muscle_bayes.physics.friction import FrictionLaw
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.state import Drive, Pair, PlantState

LOCATING_STEPS = 4
"""Newton steps from a reading to the coordinate; sensors are nearly straight."""


def _like(other: Array | Pair, pair: Pair) -> Array | Pair:
    """The pair, as an array where the other is one."""
    return pair if isinstance(other, tuple) else jnp.stack(pair)


class Plant(eqx.Module):
    """inertia(load) q'' = force(q, q', hyst, drive) - dry friction;  hyst' = hyst_rate(...)

    `rotor_inertia` is J [kg m^2] (its mass [kg] where motion is linear). `load_lever` is R_d [m], or
    1 where motion is linear: the load pulls with m g load_lever and adds m load_lever^2.
    `plant + effect` is the plant with one more effect; their order is part of the model. `memory` is
    held while coordinate and HYST move.
    """

    rotor_inertia: Scalar
    friction: FrictionLaw
    side_a: Element
    side_b: Element
    load_lever: float
    stops: tuple[float, float]
    actuator: Actuator = KnownForce()
    """Turns what drives the plant into a generalised force."""
    effects: tuple[Effect | CourseFilter, ...] = ()
    memory: Mapping[str, Float[Array, "2"] | Pair] = eqx.field(default_factory=dict)
    """States of the effects with memory on sides A and B, by name; empty where nothing is remembered,
    and such effects do nothing there."""

    def __add__(self, effect: Effect | CourseFilter) -> "Plant":
        return eqx.tree_at(
            lambda plant: plant.effects,
            self,
            (*self.effects, effect),
            is_leaf=lambda node: node is self.effects,
        )

    @property
    def instant_effects(self) -> tuple[Effect, ...]:
        """The effects that correct a port at an instant, given what is remembered."""
        return tuple(
            effect
            for effect in self.effects
            if isinstance(effect, Effect)
            and (effect.name in self.memory or not isinstance(effect, MemoryEffect))
        )

    def corrects(self, port: Port) -> bool:
        """Whether any effect corrects what this port carries."""
        return any(effect.port == port for effect in self.instant_effects)

    @property
    def muscles(self) -> dict[int, Muscle]:
        """The muscles by side: 0 is A, 1 is B."""
        sides = (self.side_a, self.side_b)
        return {place: side for place, side in enumerate(sides) if isinstance(side, Muscle)}

    @property
    def memory_effects(self) -> tuple[MemoryEffect, ...]:
        """The effects with a state, none where no muscle has it."""
        found = (effect for effect in self.effects if isinstance(effect, MemoryEffect))
        return tuple(found) if self.muscles else ()

    def remembering(self, memory: Mapping[str, Float[Array, "2"] | Pair]) -> "Plant":
        """The plant with these states of its effects with memory."""
        return dataclasses.replace(self, memory=memory)

    @property
    def temperature_filters(self) -> tuple[TemperatureFilter, ...]:
        """The effects that look at the temperature's whole course."""
        return tuple(effect for effect in self.effects if isinstance(effect, TemperatureFilter))

    @property
    def reading_filters(self) -> tuple[ReadingFilter, ...]:
        """The effects that look at the whole course of what the sensor shows."""
        return tuple(effect for effect in self.effects if isinstance(effect, ReadingFilter))

    def inertia(self, load: Scalar) -> Scalar:
        """J + m R_d^2 + what the elements add [kg m^2 or kg]."""
        elements = self.side_a.inertia() + self.side_b.inertia()
        return self.rotor_inertia + load * self.load_lever**2 + elements

    def instants(
        self,
        q: Scalar,
        speed: Scalar,
        hyst: Float[Array, "2"] | Pair,
        drive: Drive,
    ) -> tuple[Instant, Instant]:
        """What acts on sides A and B."""
        a, b = (
            Instant(q, speed, hyst[side], drive.temperature[side], drive.load, self._recalled(side))
            for side in (0, 1)
        )
        return a, b

    def _recalled(self, side: int) -> dict[str, Scalar]:
        return {name: states[side] for name, states in self.memory.items()}

    def signals(self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Signals:
        """What effects on the torque, friction and reading ports see: muscle signals are side A's."""
        strain, none = self.side_a.strain(q), jnp.zeros_like(q)
        heat, memory = drive.temperature[0], self._recalled(0)
        return Signals(q, speed, drive.load, strain, hyst[0], heat, *4 * (none,), memory)

    def dry_friction(
        self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"], drive: Drive
    ) -> Scalar:
        """Magnitude of dry friction at a speed [N m or N]; at rest, the force that it withstands."""
        seen = self.signals(q, speed, hyst, drive)
        seen = seen._replace(pull=self._pull(q, speed, hyst, drive))
        return through_port(self.instant_effects, "friction", self.friction.dry, seen)

    def _pull(self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
        """Magnitudes of the generalised forces of both sides, the load and the drive, added up."""
        effects = self.instant_effects
        a, b = self.instants(q, speed, hyst, drive)
        elements = jnp.abs(self.side_a.force(a, effects)) + jnp.abs(self.side_b.force(b, effects))
        load = drive.load * GRAVITY * self.load_lever
        driven = self.actuator.force(drive.applied, jnp.zeros_like(speed))
        return elements + jnp.abs(load) + jnp.abs(driven)

    @eqx.filter_jit  # traced once wherever a program asks for it
    def force(self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
        """Generalised force [N m or N] of everything but dry friction."""
        effects = self.instant_effects
        a, b = self.instants(q, speed, hyst, drive)
        elements = self.side_a.force(a, effects) + self.side_b.force(b, effects)
        load = drive.load * GRAVITY * self.load_lever
        driven = self.actuator.force(drive.applied, speed)
        smooth = elements + load + driven - self.friction.viscous * speed
        seen = self.signals(q, speed, hyst, drive)._replace(driving=load + driven)
        return through_port(effects, "torque", smooth, seen)

    def hyst_rates(
        self,
        q: Scalar,
        speed: Scalar,
        hyst: Float[Array, "2"] | Pair,
        drive: Drive,
    ) -> tuple[Scalar, Scalar]:
        """d sigma_hyst/dt of side A and of side B [1/s]."""
        effects = self.instant_effects
        a, b = self.instants(q, speed, hyst, drive)
        return self.side_a.hyst_rate(a, effects), self.side_b.hyst_rate(b, effects)

    def hyst_rate(
        self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"], drive: Drive
    ) -> Float[Array, "2"]:
        """d sigma_hyst/dt of both sides [1/s]."""
        return jnp.stack(self.hyst_rates(q, speed, hyst, drive))

    def memory_rates(
        self, q: Scalar, speed: Scalar, hyst: Float[Array, "2"] | Pair, drive: Drive
    ) -> dict[str, Float[Array, "2"] | Pair]:
        """d state/dt of all that is remembered, of both sides [its unit per s]."""
        a, b = (
            {
                one.name: self.memory_rate(one, side, q, speed, hyst, drive)
                for one in self.memory_effects
                if one.name in self.memory
            }
            for side in (0, 1)
        )
        return {name: _like(self.memory[name], (a[name], b[name])) for name in a}

    def memory_rate(
        self,
        effect: MemoryEffect,
        side: int,
        q: Scalar,
        speed: Scalar,
        hyst: Float[Array, "2"] | Pair,
        drive: Drive,
    ) -> Scalar:
        """d state/dt of what one effect remembers of one side [its unit per s]; 0 without a muscle."""
        if side not in self.muscles:
            return jnp.zeros_like(q)
        instant = self.instants(q, speed, hyst, drive)[side]
        return effect.rate(self.muscles[side].signals(instant, self.instant_effects))

    def terms(self) -> diffrax.MultiTerm:
        """The equation of motion as diffrax terms of a `PlantState`, in seconds.

            dq/dt = v,   dv/dt = a(t, y) - d(t, y) sign(v),   d hyst/dt and d memory/dt = rates(t, y)

        The first term is `smooth_rates`, with a = force / inertia. The second is `dry_bound`: its
        derivative of speed is d = dry friction / inertia, the others are 0. A rotor at rest stays there
        while |a| <= d. `args` of both is the drive: a diffrax path of `Drive`s, as is a `Schedule`.
        """
        return diffrax.MultiTerm(
            diffrax.ODETerm(self.smooth_rates), diffrax.ODETerm(self.dry_bound)
        )

    @eqx.filter_jit  # traced once wherever a program asks for it
    def smooth_rates(
        self, t: Scalar, y: PlantState, drive: diffrax.AbstractPath[Drive]
    ) -> PlantState:
        """dy/dt [1/s] but for dry friction; a rotor without inertia moves as one of unit inertia."""
        now, at = self.remembering(y.memory), drive.evaluate(t)
        state = y.q, y.speed, y.hyst, at
        hyst = now.hyst_rates(*state)
        return PlantState(
            y.speed,
            now.force(*state) / self._divisor(at.load),
            _like(y.hyst, hyst),
            now.memory_rates(*state),
        )

    @eqx.filter_jit
    def dry_bound(self, t: Scalar, y: PlantState, drive: diffrax.AbstractPath[Drive]) -> PlantState:
        """Largest deceleration by dry friction, in `speed` [rad/s^2 or m/s^2]; 0 elsewhere."""
        now, at = self.remembering(y.memory), drive.evaluate(t)
        bound = now.dry_friction(y.q, y.speed, y.hyst, at) / self._divisor(at.load)
        return jax.tree.map(jnp.zeros_like, y)._replace(speed=bound)

    def _divisor(self, load: Scalar) -> Scalar:
        inertia = self.inertia(load)
        return jnp.where(inertia == 0.0, 1.0, inertia)

    def smoothed_terms(self, smoothing_speed: Scalar | float) -> diffrax.ODETerm:
        """The same with dry friction d tanh(v / v0), v0 = `smoothing_speed` [rad/s or m/s].

        For solvers that know no dry friction, such as diffrax.Tsit5 and Kvaerno5. Friction creeps
        where it should hold, less the smaller v0; there are no endstops.
        """
        return diffrax.ODETerm(eqx.Partial(self._smoothed_rates, jnp.asarray(smoothing_speed)))

    def _smoothed_rates(
        self, v0: Scalar, t: Scalar, y: PlantState, drive: diffrax.AbstractPath[Drive]
    ) -> PlantState:
        smooth, dry = self.smooth_rates(t, y, drive), self.dry_bound(t, y, drive)
        return smooth._replace(speed=smooth.speed - dry.speed * jnp.tanh(y.speed / v0))

    def overdamped_terms(self, damping: Scalar | float) -> diffrax.ODETerm:
        """The limit of no inertia with c dq/dt = max(f - D, 0) + min(f + D, 0), c = `damping`.

        f: force at rest, D: dry friction [N m or N]; c [N m s or N s/m]. For stiff solvers such as
        diffrax.Kvaerno5; `speed` of the state stays as it is. As c falls this becomes what
        `QuasiStatic` solves. There are no endstops.
        """
        return diffrax.ODETerm(eqx.Partial(self._overdamped_rates, jnp.asarray(damping)))

    def _overdamped_rates(
        self, c: Scalar, t: Scalar, y: PlantState, drive: diffrax.AbstractPath[Drive]
    ) -> PlantState:
        still = y._replace(speed=jnp.zeros_like(y.speed))
        smooth, dry = self.smooth_rates(t, still, drive), self.dry_bound(t, still, drive).speed
        driven = jnp.maximum(smooth.speed - dry, 0.0) + jnp.minimum(smooth.speed + dry, 0.0)
        speed = driven * self._divisor(drive.evaluate(t).load) / c
        return smooth._replace(q=speed, speed=jnp.zeros_like(y.speed))

    def sensed(self, q: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
        """Coordinate [rad or m] that the sensor shows when the plant is at q."""
        signals = self.signals(q, jnp.zeros_like(q), hyst, drive)
        return through_port(self.instant_effects, "reading", q, signals)

    def located(self, shown: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
        """Coordinate [rad or m] at which the sensor shows `shown`: `sensed` inverted, by Newton."""
        q = shown
        if self.corrects("reading"):
            for _ in range(LOCATING_STEPS):
                unit = jnp.ones_like(q)
                seen, slope = jax.jvp(lambda x: self.sensed(x, hyst, drive), (q,), (unit,))
                q = q + (shown - seen) / jnp.where(slope == 0.0, 1.0, slope)
        return q
