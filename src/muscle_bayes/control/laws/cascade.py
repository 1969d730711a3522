"""Cascade: an outer PI asks for temperatures, the bench's heater controllers bring them about."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.bench.heat.temperature_control import PERIOD, HeaterLaw
from muscle_bayes.control.heater import FULL_DUTY
from muscle_bayes.control.laws.feed import Feed
from muscle_bayes.control.laws.law import Law, Measured
from muscle_bayes.control.laws.pi import PI
from muscle_bayes.control.laws.split import split
from muscle_bayes.control.rounding import rounded
from muscle_bayes.physics.linkage import Scalar


class CascadeState(NamedTuple):
    """Memory of both loops."""

    total: Scalar
    """Outer sum of errors [count periods]."""
    heat: Float[Array, "2"]
    """Inner sums of errors [K periods of the bench's law]."""


class Cascade(Law):
    """Outer: PI on the angle, whose output [K] is split by sign about room + bias, at most `hottest`.

    Inner: the bench's law on each channel's thermocouple, with its constants (thesis, App. B).
    """

    pi: PI
    bias: Scalar
    """K above the room at which both muscles are held"""
    feed: Feed
    room: Scalar
    hottest: float = 90.0
    """Largest temperature asked for [C]."""
    period: float = PERIOD
    inner: HeaterLaw = eqx.field(static=True, default=HeaterLaw())

    def initial(self) -> CascadeState:
        return CascadeState(jnp.zeros(()), jnp.zeros(2))

    def update(self, state, measured: Measured) -> tuple[CascadeState, Float[Array, "2"]]:
        error = measured.setpoint - measured.reading
        total, output = self.pi.update(state.total, error, self.feed(measured.setpoint))
        aim = self.room + split(output, self.bias, self.hottest - self.room)
        short = aim - measured.temperature
        law = self.inner
        heat = state.heat + short * (self.period / PERIOD)
        heat = jnp.clip(heat, -law.integral_limit, law.integral_limit)
        wanted = law.constant + law.feedforward * aim
        wanted += law.proportional * short + law.integral * heat
        duty = rounded(jnp.clip(law.gain * wanted, 0.0, FULL_DUTY))
        return CascadeState(total, heat), duty
