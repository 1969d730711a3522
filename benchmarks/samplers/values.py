"""Log posteriors without gradients, for samplers that ask for none."""

from abc import abstractmethod

import jax
import numpy as np

from benchmarks.competitors.c_floor import CFloor
from benchmarks.competitors.casadi_cvodes import CasadiCvodes
from benchmarks.competitors.protocol import Competitor
from benchmarks.density import log_posterior
from benchmarks.ode import COARSE_ERROR, damping_for
from benchmarks.samplers.protocol import Frame, Point, Record, Sampler
from benchmarks.samplers.settings import TOLERANCE
from muscle_bayes.inference.model.problem import Problem


class Values(Sampler):
    """Values of one way to solve the equations."""

    def __init__(self, problem: Problem, frame: Frame) -> None:
        super().__init__(problem, frame)
        self._way = self.solver(problem)
        self._around = jax.jit(log_posterior, static_argnames="layout")

    @abstractmethod
    def solver(self, problem: Problem) -> Competitor:
        """What solves the equations."""

    def density(self, vector: Point) -> float:
        try:
            q = self._way.coordinates(vector)
        except RuntimeError:  # CasADi's when an integration fails
            return -np.inf
        value = float(self._around(vector, q, self.problem.layout, self.problem.data))
        return value if np.isfinite(value) else -np.inf

    def counted(self, z: Point, record: Record) -> float:
        """Log density at a point of the frame."""
        record.evaluations += 1
        return self.density(self.frame.vector(z))


class OnFloor(Values):
    """Our steps, written out in C: the quickest density that is not ours. No sampler's user has it."""

    def solver(self, problem: Problem) -> Competitor:
        return CFloor(problem)


class OnCvodes(Values):
    """CasADi with CVODES, without sensitivities."""

    def solver(self, problem: Problem) -> Competitor:
        return CasadiCvodes(problem, damping_for(COARSE_ERROR), TOLERANCE)
