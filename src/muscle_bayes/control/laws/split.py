"""PI whose output heats one muscle or the other."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.control.heater import FULL_DUTY
from muscle_bayes.control.laws.feed import Feed
from muscle_bayes.control.laws.law import Law, Measured
from muscle_bayes.control.laws.pi import PI
from muscle_bayes.physics.linkage import Scalar


def split(output: Scalar, bias: Scalar, most: float) -> Float[Array, "2"]:
    """Side A gets bias + u where u > 0, side B bias - u where u < 0, at most `most` each."""
    more = jnp.stack([jnp.maximum(output, 0.0), jnp.maximum(-output, 0.0)])
    return jnp.minimum(bias + more, most)


class SplitPI(Law):
    """The thesis' law: PI on the angle, output split by sign; `bias` [duty] co-contracts both.

    A bias holds both muscles at a temperature above the room's, from which each can also cool.
    """

    pi: PI
    bias: Scalar
    feed: Feed

    def initial(self) -> Scalar:
        return jnp.zeros(())

    def update(self, state: Scalar, measured: Measured) -> tuple[Scalar, Float[Array, "2"]]:
        error = measured.setpoint - measured.reading
        state, output = self.pi.update(state, error, self.feed(measured.setpoint))
        return state, split(output, self.bias, FULL_DUTY)
