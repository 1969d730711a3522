"""What the predictive controller believes: states and disturbances from angle and thermocouples."""

from typing import NamedTuple

import casadi
import numpy as np
from jaxtyping import Float
from scipy.linalg import expm, solve_discrete_are

from benchmarks.predictive_control.model import Numbers, torque_function

Vector = Float[np.ndarray, " n"]

WANDERS = (0.01, 0.3, 0.05, 0.06)
"""How much power share, temperature [K], probe [K] and unknown heating [K/s] wander in a step, each a
standard deviation."""
THERMOCOUPLE = 0.3
"""Standard deviation of a reading about the probe's model, its unknown lag included [K]."""
TRUST = 0.6
"""Share of the torque's error that is taken for real at every step."""


class Belief(NamedTuple):
    """State of the observer."""

    heat: Float[np.ndarray, "2 4"]
    """Of each side: power share, temperature and probe above the room [K], unknown heating [K/s]."""
    hyst: Vector
    angle: float
    """rad, as read last"""
    torque: float
    """N m that the model lacks: the load, and what makes this joint differ."""


class Observer:
    """Kalman filters of both tubes, HYST by the model, and the torque by which the model errs.

    Torque is known up to friction only: while the joint rests, whatever lies within +-D explains the
    reading, and the belief does not move; while it slides, friction is D against the motion.
    """

    def __init__(self, numbers: Numbers, meter_lag: float, count: float, step: float) -> None:
        self.numbers, self.count, self.step = numbers, count, step
        self.torque = torque_function(numbers)
        self.filters = [self._filter(side, meter_lag) for side in (0, 1)]

    def _filter(self, side: int, meter_lag: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Transition, input and steady Kalman gain of one tube with its thermocouple."""
        n = self.numbers
        lag, slow = n.lag[side], max(meter_lag, 0.05)
        rates = np.zeros((5, 5))  # the last is the duty, which is held
        rates[0, [0, 4]] = -1.0 / lag, 1.0 / lag
        rates[1, [0, 1, 3]] = n.gain[side], -n.cooling[side], 1.0
        rates[2, [1, 2]] = 1.0 / slow, -1.0 / slow
        over = expm(rates * self.step)
        moves, by_duty = over[:4, :4], over[:4, 4]
        seen = np.array([[0.0, 0.0, 1.0, 0.0]])
        noise, error = np.diag(np.square(WANDERS)), np.array([[THERMOCOUPLE**2]])
        spread = solve_discrete_are(moves.T, seen.T, noise, error)
        gain = spread @ seen.T / (seen @ spread @ seen.T + error)
        return moves, by_duty, gain[:, 0]

    def at_rest(self, angle: float, hyst: Vector) -> Belief:
        """A cold joint whose model is balanced at `hyst` and rests at `angle`."""
        return Belief(np.zeros((2, 4)), np.asarray(hyst, float), angle, 0.0)

    def updated(self, belief: Belief, angle: float, probes: Vector, duties: Vector) -> Belief:
        """After a step at `duties` (shares), when `angle` [rad] and `probes` [C] are read."""
        room, heat = self.numbers.room, np.empty((2, 4))
        for side, (moves, by_duty, gain) in enumerate(self.filters):
            ahead = moves @ belief.heat[side] + by_duty * duties[side]
            heat[side] = ahead + gain * (probes[side] - room - ahead[2])
        before = room + belief.heat[:, 1]
        hyst = belief.hyst + self.step * self._torque(belief.angle, belief.hyst, before)[1]
        value = self._torque(angle, hyst, room + heat[:, 1])[0] + belief.torque
        dry, moved = self.numbers.friction, angle - belief.angle
        explained = np.clip(value, -dry, dry)
        if abs(moved) > 1.5 * self.count:  # surely not one count that flickers
            explained = dry * np.sign(moved)
        torque = belief.torque + TRUST * (explained - value)
        return Belief(heat, hyst, angle, float(torque))

    def _torque(self, angle: float, hyst: Vector, warm: Vector) -> tuple[float, Vector]:
        torque, rates = self.torque(angle, casadi.DM(hyst), casadi.DM(warm))
        return float(torque), np.asarray(rates)[:, 0]

    def state(self, belief: Belief) -> tuple[Vector, Vector]:
        """The model's state and its disturbances."""
        heat = belief.heat
        state = np.r_[heat[:, 0], heat[:, 1], belief.hyst, belief.angle]
        return state, np.r_[heat[:, 3], belief.torque]
