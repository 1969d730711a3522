"""SciPy's LSODA with finite differences: what parameter estimation in Simulink does."""

import bisect
import math

import numpy as np
from jaxtyping import Float
from scipy.integrate import solve_ivp

from benchmarks.competitors.protocol import Simulator
from benchmarks.ode import Inputs, rates
from benchmarks.problem import INPUTS, Lane
from muscle_bayes.inference.model.problem import Problem

LONGEST_STEP = 4.0
"""Lest a step over a resting rotor miss the next heating [s]: the schedule's longest interval."""
STEP = 3e-4
"""Relative step of differences, the best of some tried: A, B and C nearly cancel in the gradient along
the offset curve's bend, and so larger steps bend too much, smaller ones drown in solver noise."""
TYPICAL_ANGLE = 0.1
"""What steps of the first coordinate are relative to [rad]; those of other inputs to their values."""


class Floats:
    """`ode.Operations` on Python floats."""

    sin, cos, sqrt = math.sin, math.cos, math.sqrt
    fmax, fmin = max, min


class Lsoda(Simulator):
    """`solve_ivp(method="LSODA")`; one-sided differences of each run in its own inputs."""

    name = "SciPy LSODA, finite differences"

    def __init__(
        self, problem: Problem, damping: float, tolerance: float, step: float = STEP
    ) -> None:
        super().__init__(problem)
        self.tolerance, self.step, self.damping = tolerance, step, damping
        self.settings = f"tolerance {tolerance:.0e}, step {step:.0e}, c = {damping:.1e}"

    def solve(self, lane: Lane, inputs: Float[np.ndarray, " input"]) -> np.ndarray:
        p = Inputs(*inputs.tolist())
        time = lane.course.time.tolist()
        temperature = lane.course.heat.tolist()
        last = len(time) - 2

        def field(t: float, state: np.ndarray) -> tuple[float, float]:
            i = min(max(bisect.bisect_right(time, t) - 1, 0), last)
            share = (t - time[i]) / (time[i + 1] - time[i])
            now = temperature[i] + share * (temperature[i + 1] - temperature[i])
            q, hyst = state.tolist()
            return rates(Floats, lane, p, q, hyst, now, self.damping)

        solution = solve_ivp(
            field,
            (time[0], time[-1]),
            (p.q, p.hyst),
            method="LSODA",
            t_eval=lane.course.time,
            rtol=self.tolerance,
            atol=(self.tolerance, 0.1 * self.tolerance),
            max_step=LONGEST_STEP,
        )
        return solution.y[0] if solution.success else np.full(len(time), np.nan)

    def sensitivities(
        self, lane: Lane, inputs: Float[np.ndarray, " input"]
    ) -> tuple[np.ndarray, np.ndarray]:
        q = self.solve(lane, inputs)
        columns = []
        for place, value in enumerate(inputs):
            size = self.step * (TYPICAL_ANGLE if INPUTS[place] == "q" else abs(float(value)))
            moved = inputs.copy()
            moved[place] += size
            columns.append((self.solve(lane, moved) - q) / size)
        return q, np.stack(columns, axis=1)
