"""CasADi with SUNDIALS' CVODES and its forward sensitivities."""

import contextlib
import tempfile
from typing import Any

import casadi
import numpy as np
from jaxtyping import Float

from benchmarks.competitors.protocol import Simulator
from benchmarks.ode import Inputs, rates
from benchmarks.problem import Lane
from muscle_bayes.inference.model.problem import Problem

LONGEST_STEP = 4.0
"""Lest a step over a resting rotor miss the next heating [s]: the schedule's longest interval."""


class Symbols:
    """`ode.Operations` on CasADi's symbols."""

    sin, cos, sqrt = staticmethod(casadi.sin), staticmethod(casadi.cos), staticmethod(casadi.sqrt)
    fmax, fmin = staticmethod(casadi.fmax), staticmethod(casadi.fmin)


def _integrator(lane: Lane, typical: np.ndarray, damping: float, tolerance: float) -> Any:
    """Function from a lane's inputs in typical units to its coordinates [rad].

    Without those units CVODES would ask sensitivities to parameters of very different size for the
    same absolute accuracy, and fail. The ODE is compiled to C, which halves the time; temperature's
    lines enter as controls that are constant from one instant of the course to the next, which is
    several times quicker than an interpolant in the equations.
    """
    time, heat = lane.course
    lines = np.stack([heat[:-1], np.diff(heat) / np.diff(time), time[:-1]])
    q, hyst, t = (casadi.SX.sym(name) for name in ("q", "hyst", "t"))
    line, shared = casadi.SX.sym("line", 3), casadi.SX.sym("shared", 10)
    constants = [shared[i] * typical[i] for i in range(10)]
    temperature = line[0] + line[1] * (t - line[2])
    p = Inputs._make([*constants, q, hyst])
    right = casadi.vertcat(*rates(Symbols, lane, p, q, hyst, temperature, damping))
    dae = {"x": casadi.vertcat(q, hyst), "p": shared, "u": line, "t": t, "ode": right}
    options = {
        "reltol": tolerance,
        "abstol": tolerance,
        "max_step_size": LONGEST_STEP,
        "max_num_steps": 10**6,
        "newton_scheme": "direct",
        "jit": True,
        "jit_cleanup": False,
        "jit_options": {"flags": "-O3 -march=native", "verbose": False, "cleanup": False},
        "show_eval_warnings": False,
    }
    solver = casadi.integrator("lane", "cvodes", dae, float(time[0]), time[1:].tolist(), options)
    inputs = casadi.MX.sym("inputs", len(Inputs._fields))
    start = inputs[10:12] * casadi.DM(typical[10:12])
    states = solver(x0=start, p=inputs[:10], u=lines)["xf"]
    return casadi.Function("coordinates", [inputs], [casadi.horzcat(start[0], states[0, :]).T])


class CasadiCvodes(Simulator):
    """CVODES in C, sensitivities by its own variational equations, one lane after the other."""

    name = "CasADi with CVODES, forward sensitivities"

    def __init__(self, problem: Problem, damping: float, tolerance: float) -> None:
        super().__init__(problem)
        self.settings = f"tolerance {tolerance:.0e}, c = {damping:.1e}"
        self._accuracy = damping, tolerance
        self._typical: np.ndarray | None = None
        self._functions: dict[int, tuple[Any, Any]] = {}

    def _compiled(
        self, lane: Lane, inputs: Float[np.ndarray, " input"]
    ) -> tuple[Any, Any, np.ndarray]:
        """The lane's integrator, its derivative along all inputs, and the typical units of both."""
        if self._typical is None:
            self._typical = np.abs(inputs)
            self._typical[10:12] = 1.0
        if id(lane) not in self._functions:
            # CasADi writes what it compiles into the working directory.
            with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
                function = _integrator(lane, self._typical, *self._accuracy)
                self._functions[id(lane)] = function, function.forward(inputs.size)
        return *self._functions[id(lane)], self._typical

    def solve(self, lane: Lane, inputs: Float[np.ndarray, " input"]) -> np.ndarray:
        function, _, typical = self._compiled(lane, inputs)
        return np.asarray(function(inputs / typical)).ravel()

    def sensitivities(
        self, lane: Lane, inputs: Float[np.ndarray, " input"]
    ) -> tuple[np.ndarray, np.ndarray]:
        _, forward, typical = self._compiled(lane, inputs)
        q = self.solve(lane, inputs)
        jacobian = forward(inputs / typical, q, casadi.DM.eye(inputs.size))
        return q, np.asarray(jacobian) / typical
