"""One joint in a loop, and the controller in plain Python."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from muscle_bayes.control.closed_loop import Clock, simulate, start_of
from muscle_bayes.control.laws.gains import Gains, law_of
from muscle_bayes.control.plant.design import Design
from muscle_bayes.control.plant.draws import JointDraws
from muscle_bayes.inference.model.muscle_prior import MUSCLE_PARAMETERS

PERIOD = 0.03


def joint_of(values, friction="linear", effects=(), design=None):
    """A joint with two muscles alike, in a room of 25 C, under a thermocouple without lag."""
    twice = (*MUSCLE_PARAMETERS, "heater.gain", "heater.cooling", "heater.lag")
    draws = {
        name: np.full((1, 2) if name in twice else (1,), value)
        for name, value in ({"room": 25.0, "meter_lag": 0.0} | values).items()
    }
    return JointDraws(design or Design(), friction, tuple(effects), draws).one()


def loop(joint, gains, course, substeps=3, design=None, seed=0):
    """Trace of one joint, as NumPy arrays."""
    law, clock = law_of(gains, design or Design()), Clock(gains.period, substeps)
    start = start_of(joint, jnp.asarray(course.load[0]), jnp.asarray(course.trained))
    run = eqx.filter_jit(lambda: simulate(joint, law, course, start, jax.random.key(seed), clock))
    return jax.tree.map(np.asarray, run())


def _cut(value: float, low: int, high: int) -> int:
    return max(low, min(high, int(value)))


def _quotient(numerator: int, denominator: int) -> int:
    """Towards zero, as C divides."""
    whole = abs(numerator) // abs(denominator)
    return whole if (numerator < 0) == (denominator < 0) else -whole


class IntegerLaw:
    """The firmware's arithmetic as gains.h states it, with Python's integers."""

    def __init__(self, numbers, cascade: bool = False) -> None:
        self.n, self.cascade = numbers, cascade
        self.reference, self.total = None, 0

    def _feed(self, setpoint: int) -> int:
        n = self.n
        along = _cut(setpoint - n.feed_first, 0, (len(n.feed) - 1) * n.feed_step)
        i = min(along // n.feed_step, len(n.feed) - 2)
        rise = n.feed[i + 1] - n.feed[i]
        return n.feed[i] + _quotient(rise * (along - i * n.feed_step), n.feed_step)

    def __call__(self, setpoint: int, reading: int, warmth=(250, 250)) -> tuple[int, int]:
        n = self.n
        if self.reference is None:
            self.reference = reading * 65536
        self.reference += _quotient((setpoint * 65536 - self.reference) * n.filter, 65536)
        error = self.reference // 256 - reading * 256
        pi = _quotient(n.kp * 256 * error + n.ki * self.total, 2**24)
        wanted = _cut(pi, -32000, 32000) + self._feed(self.reference // 65536)
        base = n.bias + (n.room if self.cascade else 0)
        most = n.hottest if self.cascade else 255
        duties, shares = [], []
        for sign, warm in zip((1, -1), warmth, strict=True):
            share = _cut(base + sign * wanted, base, most)
            full = share
            if self.cascade:
                asked = n.hold * (share - n.room) + n.heat * (share - warm)
                full = _cut(_quotient(asked, 256), 0, 255)
            span = n.fade_high - n.fade_low
            duties.append(min(full, 255 * _cut(n.fade_high - warm, 0, span) // span))
            shares.append(share)
        became = shares if self.cascade else duties
        total = self.total + error + n.back * (became[0] - became[1] - wanted)
        self.total = _cut(total, -1024000000, 1024000000)
        return tuple(duties)


__all__ = ["PERIOD", "Gains", "IntegerLaw", "joint_of", "loop"]
