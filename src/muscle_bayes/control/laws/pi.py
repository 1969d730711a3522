"""PI on the bench's integers."""

import equinox as eqx
import jax.numpy as jnp

from muscle_bayes.control.laws.windup import Windup
from muscle_bayes.control.rounding import truncated
from muscle_bayes.physics.linkage import Scalar


class PI(eqx.Module):
    """u = trunc(kp e + ki sum(e) + feed), clamped to +-limit;  e = setpoint - reading, in counts.

    kp [output per count], ki [output per count and period]. Where these are whole multiples of 2^-8
    and 2^-16 and feed is 0 this is, digit for digit, `firmware/src/control.c`. Output is a whole
    number of `quantum`.
    """

    kp: Scalar
    ki: Scalar
    windup: Windup
    limit: float = 255.0
    quantum: float = 1.0

    def update(self, total: Scalar, error: Scalar, feed: Scalar) -> tuple[Scalar, Scalar]:
        """The next sum of errors, and the output."""

        def output(total: Scalar) -> Scalar:
            raw = (self.kp * error + self.ki * total + feed) / self.quantum
            return jnp.clip(self.quantum * truncated(raw), -self.limit, self.limit)

        total = self.windup.next_sum(total, error, output, self.limit)
        return total, output(total)
