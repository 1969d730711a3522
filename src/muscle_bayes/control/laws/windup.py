"""What becomes of the integral while the output is at its limit."""

from abc import abstractmethod
from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp

from muscle_bayes.physics.linkage import Scalar


class Windup(eqx.Module):
    """How the sum of errors goes on."""

    @abstractmethod
    def next_sum(
        self, total: Scalar, error: Scalar, output: Callable[[Scalar], Scalar], limit: float
    ) -> Scalar:
        """The sum after `error` came; `output` gives the clamped output that belongs to a sum."""


class Unlimited(Windup):
    """The sum always grows: a discrete PI without anti-windup, as in the thesis' study."""

    def next_sum(self, total, error, output, limit):
        return total + error


class Conditional(Windup):
    """At the limit the sum may only shrink the output: conditional integration, as the firmware does.

    Åström and Hägglund, Advanced PID Control (2006), section 3.5.
    """

    def next_sum(self, total, error, output, limit):
        before, after = output(total), output(total + error)
        winds = (before >= limit) & (after >= before)
        winds |= (before <= -limit) & (after <= before)
        return jnp.where(winds, total, total + error)
