"""What a competitor offers."""

from abc import ABC, abstractmethod
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from benchmarks.density import inputs_of, means, value_and_gradient
from benchmarks.problem import Lane, lanes_of
from muscle_bayes.inference.model.problem import Problem

type Coordinates = Float[np.ndarray, "lane interval"]
type Gradient = tuple[float, Float[np.ndarray, " n"]]


class Competitor(ABC):
    """A way to find the log posterior and its gradient."""

    name: str
    """What it is called in tables."""
    settings: str
    """What its accuracy depends on, in words."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem

    @abstractmethod
    def coordinates(self, vector: Float[np.ndarray, " n"]) -> Coordinates:
        """Mean coordinates of the intervals [rad] at an unconstrained vector."""

    @abstractmethod
    def __call__(self, vector: Float[np.ndarray, " n"]) -> Gradient:
        """Log posterior and its gradient at an unconstrained vector: what is timed."""


class Simulator(Competitor):
    """A competitor that simulates each lane outside JAX; the density around it is shared."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self.lanes = lanes_of(problem)

    @abstractmethod
    def solve(self, lane: Lane, inputs: Float[np.ndarray, " input"]) -> np.ndarray:
        """Coordinates [rad] at the instants of a lane's course."""

    @abstractmethod
    def sensitivities(
        self, lane: Lane, inputs: Float[np.ndarray, " input"]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates [rad], and their derivatives (instant, input) in `problem.INPUTS`."""

    def inputs(self, vector: Float[np.ndarray, " n"]) -> Float[np.ndarray, "lane input"]:
        """What each lane's simulation depends on."""
        return np.asarray(inputs_of(vector, self.problem.layout, self.problem.data))

    def coordinates(self, vector: Float[np.ndarray, " n"]) -> Coordinates:
        pairs = zip(self.lanes, self.inputs(vector), strict=True)
        return np.stack([means(self.solve(lane, one)) for lane, one in pairs])

    def jacobians(self, vector: Float[np.ndarray, " n"]) -> tuple[Any, Any]:
        """Mean coordinates [rad] and their derivatives in the inputs, lanes leading."""
        pairs = zip(self.lanes, self.inputs(vector), strict=True)
        solved = [self.sensitivities(lane, one) for lane, one in pairs]
        q, jacobian = zip(*solved, strict=True)
        return np.stack([means(one) for one in q]), np.stack([means(one) for one in jacobian])

    def __call__(self, vector: Float[np.ndarray, " n"]) -> Gradient:
        q, jacobian = self.jacobians(vector)
        layout, data = self.problem.layout, self.problem.data
        value, gradient = value_and_gradient(
            vector, jnp.asarray(q), jnp.asarray(jacobian), layout, data
        )
        return float(value), np.asarray(gradient)
