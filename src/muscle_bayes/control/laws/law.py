"""The board's control law, digit for digit (`firmware/src/control.c`), for one joint or many."""

from typing import Final, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar

FULL_DUTY: Final = 255.0
"""PWM's full scale."""
ENTRIES: Final = 9
"""Of the feed-forward's table."""
SUM_LIMIT: Final = 1024000000.0


class Measured(NamedTuple):
    """What the controller knows at one instant."""

    setpoint: Scalar
    """counts"""
    reading: Scalar
    """counts"""
    temperature: Float[Array, "2"]
    """Thermocouples' readings of sides A and B [C]."""


class Numbers(NamedTuple):
    """The integers of `firmware/src/gains.h`, which explains them."""

    kp: Scalar
    ki: Scalar
    back: Scalar
    filter: Scalar
    bias: Scalar
    fade_low: Scalar
    fade_high: Scalar
    feed_first: Scalar
    feed_step: Scalar
    feed: Float[Array, " entry"]
    hold: Scalar
    heat: Scalar
    room: Scalar
    hottest: Scalar


class LawState(NamedTuple):
    """Memory of the law: filtered setpoint [2^-16 counts], sum of errors [2^-8 counts]."""

    reference: Scalar
    total: Scalar


def _feed(numbers: Numbers, setpoint: Scalar) -> Scalar:
    """The table, straight between its entries and constant beyond them."""
    step = numbers.feed_step
    along = jnp.clip(setpoint - numbers.feed_first, 0.0, (ENTRIES - 1) * step)
    place = jnp.minimum(jnp.floor(along / step), ENTRIES - 2.0)
    left, right = (jnp.arange(ENTRIES) == place + more for more in (0, 1))
    low, high = (jnp.where(one, numbers.feed, 0.0).sum() for one in (left, right))
    return low + jnp.trunc((high - low) * (along - place * step) / step)


class Law(eqx.Module):
    """PI on the angle with setpoint filter, feed-forward, back-calculation and temperature governor.

    Its output is a duty, or with `cascade` a temperature that an inner loop brings about. In double
    precision every number is the firmware's; in single precision large products lose their last digits.
    """

    numbers: Numbers
    cascade: bool = eqx.field(static=True, default=False)

    def initial(self, reading: Scalar) -> LawState:
        """At rest: the filtered setpoint is the first reading [counts]."""
        return LawState(reading * 65536.0, jnp.zeros_like(reading))

    def update(self, state: LawState, measured: Measured) -> tuple[LawState, Float[Array, "2"]]:
        """The next state, and the duties (0 to 255) of heaters A and B until the next call."""
        n = self.numbers
        gap = measured.setpoint * 65536.0 - state.reference
        reference = state.reference + jnp.trunc(gap * n.filter / 65536.0)
        error = jnp.floor(reference / 256.0) - 256.0 * measured.reading
        pi = jnp.trunc((n.kp * 256.0 * error + n.ki * state.total) / 16777216.0)
        fed = _feed(n, jnp.floor(reference / 65536.0))
        wanted = jnp.clip(pi, -32000.0, 32000.0) + fed

        base = n.bias + (n.room if self.cascade else 0.0)
        most = n.hottest if self.cascade else FULL_DUTY
        share = jnp.clip(base + jnp.stack([wanted, -wanted]), base, most)
        warmth = jnp.round(10.0 * measured.temperature)
        span = n.fade_high - n.fade_low
        allowed = jnp.trunc(FULL_DUTY * jnp.clip(n.fade_high - warmth, 0.0, span) / span)
        duty = jnp.minimum(self._heat(share, warmth), allowed)
        became = share if self.cascade else duty
        total = state.total + error + n.back * (became[0] - became[1] - wanted)
        return LawState(reference, jnp.clip(total, -SUM_LIMIT, SUM_LIMIT)), duty

    def _heat(self, share: Float[Array, "2"], warmth: Float[Array, "2"]) -> Float[Array, "2"]:
        """What each side's share of the output asks of its heater."""
        if not self.cascade:
            return share
        n = self.numbers
        asked = n.hold * (share - n.room) + n.heat * (share - warmth)
        return jnp.clip(jnp.trunc(asked / 256.0), 0.0, FULL_DUTY)
