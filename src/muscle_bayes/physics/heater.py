"""What heats a muscle: its temperature as logged, or as it follows from the heater's power."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro import distributions as dist

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.unknown import UNKNOWN, Part, Unknown


class Heater(Part):
    """From what a schedule holds of one side to the temperature of that side."""

    @abstractmethod
    def temperature(
        self, time: Float[Array, " node"], logged: Float[Array, " node"]
    ) -> Float[Array, " node"]:
        """Temperature at the nodes [C]; what is logged is linear between them."""


class LoggedTemperature(Heater):
    """A thermometer's temperature [C], as it is."""

    def temperature(
        self, time: Float[Array, " node"], logged: Float[Array, " node"]
    ) -> Float[Array, " node"]:
        return logged


class HeatedBody(Heater):
    """dT/dt = heating_rate u - (T - room) / cooling_time

    u: heater power [W], or what it is proportional to: the square of a current [A^2] or voltage [V^2],
    or a duty [1]; heating_rate [K/s per unit of u] = share of the power / capacity; cooling_time [s] =
    capacity / loss. Exact for u linear between nodes. A tube between heater and muscle is the effect
    `thermal-lag` on top. Source: lumped capacity, Incropera, Fundamentals of Heat and Mass Transfer,
    section 5.1.
    """

    unknowns: ClassVar[Mapping[str, Unknown]] = {
        "heating_rate": Unknown(
            unit="K/s per W, A^2, V^2 or duty",
            prior=lambda size: dist.LogNormal(-np.log(size.power), 1.5),
            meaning="rate at which the heater warms a cold body, per unit of its power",
        ),
        "cooling_time": Unknown(
            unit="s",
            prior=lambda size: dist.LogNormal(np.log(50.0), 1.0),
            meaning="time constant of cooling to the room",
        ),
    }

    heating_rate: Scalar | float = UNKNOWN
    cooling_time: Scalar | float = UNKNOWN
    room: float = 25.0
    """Temperature of the room, and of the body in the first row [C]."""

    def temperature(
        self, time: Float[Array, " node"], logged: Float[Array, " node"]
    ) -> Float[Array, " node"]:
        settled = self.room + self.cooling_time * self.heating_rate * logged
        duration = jnp.diff(time)
        lasts = duration > 0.0
        lag = self.cooling_time * jnp.diff(settled) / jnp.where(lasts, duration, 1.0)
        fade = jnp.exp(-duration / self.cooling_time)

        def step(now: Scalar, interval: tuple[Scalar, ...]) -> Any:
            before, after, lag, fade, lasting = interval
            there = after - lag + (now - before + lag) * fade
            there = jnp.where(lasting, there, now)
            return there, there

        first = jnp.asarray(self.room, settled.dtype)
        parts = settled[:-1], settled[1:], lag, fade, lasts
        _, after = jax.lax.scan(step, first, parts)
        return jnp.concatenate([first[None], after])
