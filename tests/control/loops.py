"""One joint in a loop, and the controller in plain Python."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from muscle_bayes.control.closed_loop import Clock, simulate, start_of
from muscle_bayes.control.design import Design
from muscle_bayes.control.draws import JointDraws
from muscle_bayes.control.gains import Gains
from muscle_bayes.control.laws.build import build_law

PERIOD = 0.03


def joint_of(values, friction="linear", effects=(), design=None):
    draws = {name: np.array([value]) for name, value in values.items()}
    return JointDraws(design or Design(), friction, tuple(effects), draws).one()


def loop(joint, gains, course, substeps=3, design=None, seed=0):
    """Trace of one joint, as NumPy arrays."""
    law, clock = build_law(gains, design or Design()), Clock(gains.period, substeps)
    start = start_of(joint, jnp.asarray(course.load[0]), jnp.asarray(course.trained))
    run = eqx.filter_jit(lambda: simulate(joint, law, course, start, jax.random.key(seed), clock))
    return jax.tree.map(np.asarray, run())


class IntegerPI:
    """The firmware's arithmetic (control.c), with Python's integers."""

    def __init__(self, kp: int, ki: int, bias: int) -> None:
        self.kp, self.ki, self.bias, self.total = kp, ki, bias, 0

    def _output(self, error: int, total: int) -> int:
        exact = self.kp * 256 * error + self.ki * total
        return max(-255, min(255, int(exact / 65536)))

    def __call__(self, setpoint: int, reading: int) -> tuple[int, int]:
        error = setpoint - reading
        before, after = self._output(error, self.total), self._output(error, self.total + error)
        if not ((before == 255 and after >= 255) or (before == -255 and after <= -255)):
            self.total += error
        u = self._output(error, self.total)
        return min(255, self.bias + max(u, 0)), min(255, self.bias + max(-u, 0))


__all__ = ["PERIOD", "Gains", "IntegerPI", "joint_of", "loop"]
