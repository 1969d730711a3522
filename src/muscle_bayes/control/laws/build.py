"""From gains to a law, whose numbers may be traced."""

from typing import NamedTuple

import jax.numpy as jnp

from muscle_bayes.control.design import Design
from muscle_bayes.control.gains import FeedForward, Gains
from muscle_bayes.control.laws.cascade import Cascade
from muscle_bayes.control.laws.feed import Feed, NoFeed, TableFeed
from muscle_bayes.control.laws.law import Law
from muscle_bayes.control.laws.pi import PI
from muscle_bayes.control.laws.split import SplitPI
from muscle_bayes.control.laws.windup import Conditional, Unlimited
from muscle_bayes.control.rounding import rounded
from muscle_bayes.physics.linkage import Scalar

HOTTEST = 90.0
"""Temperature to which muscles were trained [C]: the most that a cascade asks for."""
TEMPERATURE_QUANTUM = 0.1
"""Step of the temperatures that a cascade asks for [K]."""


class Numbers(NamedTuple):
    """What can be tuned, in the units of `Gains`."""

    proportional: Scalar
    integral: Scalar
    bias: Scalar


def numbers_of(gains: Gains) -> Numbers:
    """The tunable numbers of gains."""
    return Numbers(*(jnp.asarray(x) for x in (gains.proportional, gains.integral, gains.bias)))


def _feed(table: FeedForward | None, design: Design) -> Feed:
    if table is None:
        return NoFeed()
    sensor, _ = design.sensors()
    counts = sensor.counts(jnp.asarray(table.angle))
    order = jnp.argsort(counts)
    return TableFeed(counts[order], -jnp.asarray(table.output)[order])


def build_law(gains: Gains, design: Design, numbers: Numbers | None = None) -> Law:
    """The law of these gains on a joint; `numbers`, if given, stand in for its own."""
    own = numbers or numbers_of(gains)
    count = design.potentiometer.radians_per_count
    kp, ki = -own.proportional * count, -own.integral * count * gains.period
    feed = _feed(gains.feedforward, design)
    if gains.law == "cascade":
        room = design.fixture.room_temperature
        pi = PI(kp, ki, Conditional(), HOTTEST - room, TEMPERATURE_QUANTUM)
        return Cascade(pi, own.bias, feed, jnp.asarray(room), HOTTEST, gains.period)
    windup = Unlimited() if gains.law == "pi" else Conditional()
    return SplitPI(PI(kp, ki, windup), rounded(own.bias), feed)
