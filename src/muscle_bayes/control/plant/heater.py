"""Heater tubes: power that follows the duty late, Newton cooling."""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.control.laws.law import FULL_DUTY
from muscle_bayes.physics.linkage import Scalar

Both = Float[Array, "2"]
"""One value for side A, one for side B."""


class HeaterState(NamedTuple):
    """State of both tubes."""

    power: Both
    """Heating as a share of full power."""
    excess: Both
    """Temperature above the room [K]."""


class Heater(eqx.Module):
    """lag p' = duty / 255 - p,   T' = gain p - cooling (T - T_room)

    gain [K/s at full duty], cooling [1/s], lag [s] of both tubes, room [C]. The thesis has the same
    law without the lag.
    """

    gain: Both
    cooling: Both
    lag: Both
    room: Scalar

    def step(self, duration: Scalar | float) -> Callable[[HeaterState, Both], HeaterState]:
        """The exact solution over `duration` [s] of constant duty; the lag must not be 1 / cooling.

        A function of both tubes' state and of the duty (0 to 255) that gives the state after the step.
        """
        cools = jnp.exp(-self.cooling * duration)
        positive = self.lag > 0.0
        lags = jnp.where(positive, jnp.exp(-duration / jnp.where(positive, self.lag, 1.0)), 0.0)
        heats = self.gain * (1.0 - cools) / self.cooling
        late = self.gain * self.lag * (cools - lags) / (1.0 - self.cooling * self.lag)

        def after(state: HeaterState, duty: Both) -> HeaterState:
            aim = duty / FULL_DUTY
            behind = state.power - aim
            excess = cools * state.excess + heats * aim + late * behind
            return HeaterState(aim + lags * behind, excess)

        return after

    def holding_duty(self, excess: Scalar, side: int) -> Scalar:
        """Duty that holds side 0 (A) or 1 (B) `excess` [K] above the room."""
        return FULL_DUTY * self.cooling[side] * excess / self.gain[side]
