"""diffrax as it is generally used: an adaptive implicit solver on the stiff ODE."""

from functools import partial
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from benchmarks.competitors.protocol import Competitor, Coordinates, Gradient
from benchmarks.density import lane_inputs, log_posterior, means, value_and_gradient
from benchmarks.ode import Inputs, rates
from benchmarks.problem import Lane, lanes_of
from muscle_bayes.inference.density import constrain
from muscle_bayes.inference.problem import Data, Layout, Problem

LONGEST_STEP = 4.0
"""Lest a step over a resting rotor miss the next heating [s]: the schedule's longest interval."""
MAX_STEPS = 2**17

type Settings = tuple[float, float]
"""Damping c [N m s/rad] and relative and absolute tolerance."""


class Traced:
    """`ode.Operations` on traced arrays."""

    sin, cos, sqrt = staticmethod(jnp.sin), staticmethod(jnp.cos), staticmethod(jnp.sqrt)
    fmax, fmin = staticmethod(jnp.maximum), staticmethod(jnp.minimum)


def _field(t: Array, state: tuple[Array, Array], args: Any) -> tuple[Array, Array]:
    lane, inputs, damping = args
    course = lane.course
    base, lead = (
        diffrax.LinearInterpolation(course.time, values).evaluate(t)
        for values in (course.base, course.lead)
    )
    p = Inputs(*inputs)
    return rates(Traced, lane, p, *state, base + p.ahead * lead, damping)


def _solve(
    inputs: Float[Array, " input"],
    lane: Lane,
    settings: Settings,
    adjoint: diffrax.AbstractAdjoint,
) -> Float[Array, " interval"]:
    """Mean coordinates of one lane's intervals [rad]."""
    damping, tolerance = settings
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(_field),
        diffrax.Kvaerno5(),
        lane.course.time[0],
        lane.course.time[-1],
        0.1,
        (inputs[-3], inputs[-2]),
        (lane, inputs, damping),
        saveat=diffrax.SaveAt(ts=lane.course.time),
        stepsize_controller=diffrax.PIDController(
            rtol=tolerance, atol=tolerance, dtmax=LONGEST_STEP
        ),
        adjoint=adjoint,
        max_steps=MAX_STEPS,
        throw=False,
    )
    if solution.ys is None:
        raise ValueError("nothing was saved")
    found = solution.result == diffrax.RESULTS.successful
    return jnp.where(found, means(solution.ys[0]), jnp.nan)


# Lanes are solved one after the other: side by side all would wait for the slowest at every step.


@partial(jax.jit, static_argnames="layout")
def _coordinates(
    vector: Array, lanes: Lane, settings: Settings, layout: Layout, data: Data
) -> Array:
    inputs = lane_inputs(constrain(vector, layout, data), layout, data)
    solve = partial(_solve, settings=settings, adjoint=diffrax.ForwardMode())
    return jax.lax.map(lambda pair: solve(*pair), (inputs, lanes))


@partial(jax.jit, static_argnames="layout")
def _forward(vector: Array, lanes: Lane, settings: Settings, layout: Layout, data: Data) -> Any:
    inputs = lane_inputs(constrain(vector, layout, data), layout, data)
    solve = partial(_solve, settings=settings, adjoint=diffrax.ForwardMode())

    def one(pair: tuple[Array, Lane]) -> tuple[Array, Array]:
        def along(direction: Array) -> tuple[Array, Array]:
            return jax.jvp(lambda x: solve(x, pair[1]), pair[:1], (direction,))

        return jax.vmap(along, out_axes=(None, 1))(jnp.eye(inputs.shape[1]))

    q, jacobian = jax.lax.map(one, (inputs, lanes))
    return value_and_gradient(vector, q, jacobian, layout, data)


@partial(jax.jit, static_argnames="layout")
def _reverse(vector: Array, lanes: Lane, settings: Settings, layout: Layout, data: Data) -> Any:
    solve = partial(_solve, settings=settings, adjoint=diffrax.RecursiveCheckpointAdjoint())

    def density(vector: Array) -> Array:
        inputs = lane_inputs(constrain(vector, layout, data), layout, data)
        q = jax.lax.map(lambda pair: solve(*pair), (inputs, lanes))
        return log_posterior(vector, q, layout, data)

    return jax.value_and_grad(density)(vector)


class GenericDiffrax(Competitor):
    """Kvaerno5 with a PID controller, and the forward derivative of every step."""

    name = "diffrax Kvaerno5, forward mode"
    _gradient = staticmethod(_forward)

    def __init__(self, problem: Problem, damping: float, tolerance: float) -> None:
        super().__init__(problem)
        self.settings = f"tolerance {tolerance:.0e}, c = {damping:.1e}"
        self._accuracy = damping, tolerance
        self._lanes: Lane = jax.tree.map(lambda *leaves: jnp.stack(leaves), *lanes_of(problem))

    @property
    def arrays(self) -> tuple[Any, ...]:
        """What `traced` needs besides the vector."""
        return self._lanes, self._accuracy, self.problem.data

    def traced(
        self, vector: Float[Array, " n"], lanes: Lane, accuracy: Settings, data: Data
    ) -> tuple[Float[Array, ""], Float[Array, " n"]]:
        """Log posterior and its gradient within a larger program."""
        return self._gradient(vector, lanes, accuracy, self.problem.layout, data)

    def coordinates(self, vector: Float[np.ndarray, " n"]) -> Coordinates:
        layout, data = self.problem.layout, self.problem.data
        return np.asarray(_coordinates(vector, self._lanes, self._accuracy, layout, data))

    def __call__(self, vector: Float[np.ndarray, " n"]) -> Gradient:
        layout, data = self.problem.layout, self.problem.data
        value, gradient = self._gradient(vector, self._lanes, self._accuracy, layout, data)
        return float(value), np.asarray(gradient)


class ReverseDiffrax(GenericDiffrax):
    """The same solver, differentiated in reverse through checkpoints."""

    name = "diffrax Kvaerno5, reverse mode"
    _gradient = staticmethod(_reverse)
