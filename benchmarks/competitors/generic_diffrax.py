"""diffrax as it is generally used: an adaptive implicit solver on the plant's overdamped terms."""

from functools import partial
from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from benchmarks.competitors.protocol import Competitor, Coordinates, Gradient
from benchmarks.density import lane_inputs, log_posterior, means, value_and_gradient
from benchmarks.problem import lanes_of
from muscle_bayes.inference.model.density import constrain
from muscle_bayes.inference.model.problem import Data, Layout, Problem
from muscle_bayes.inference.records.rig import with_parameters
from muscle_bayes.physics.friction import CoulombFriction
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.schedule import Schedule
from muscle_bayes.physics.simulation import initial_state

LONGEST_STEP = 4.0
"""Lest a step over a resting rotor miss the next heating [s]: the schedule's longest interval."""
MAX_STEPS = 2**17

type Settings = tuple[float, float]
"""Damping c [N m s/rad] and relative and absolute tolerance."""


class Rig(NamedTuple):
    """A lane: its plant, parameters unknown, and the drive at its course's instants."""

    plant: Plant
    drive: Schedule


def _rigs(problem: Problem) -> Rig:
    """All lanes, stacked."""
    (lanes,) = problem.data.lanes
    rigs = []
    for index, lane in enumerate(lanes_of(problem)):
        plant, load = jax.tree.map(
            lambda leaf, index=index: leaf[index], (lanes.plant, lanes.schedule.load[:, 0])
        )
        rigs.append(Rig(plant, Schedule.sampled(lane.course.time, lane.course.heat, load)))
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *rigs)


def _solve(
    inputs: Float[Array, " input"],
    rig: Rig,
    settings: Settings,
    adjoint: diffrax.AbstractAdjoint,
) -> Float[Array, " interval"]:
    """Mean coordinates of one lane's intervals [rad]."""
    damping, tolerance = settings
    dry, *table, q, hyst = inputs
    # The balance of an overdamped rotor does not depend on its inertia.
    friction, muscle = CoulombFriction(dry), MuscleParameters(*table)
    plant = with_parameters(rig.plant, jnp.ones(()), friction, muscle)
    solution = diffrax.diffeqsolve(
        plant.overdamped_terms(damping),
        diffrax.Kvaerno5(),
        rig.drive.t0,
        rig.drive.t1,
        0.1,
        initial_state(plant, rig.drive, q, 0.0, hyst),
        rig.drive,
        saveat=diffrax.SaveAt(ts=rig.drive.time),
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
    return jnp.where(found, means(solution.ys.q), jnp.nan)


# Rigs are solved one after the other: side by side all would wait for the slowest at every step.


@partial(jax.jit, static_argnames="layout")
def _coordinates(vector: Array, rigs: Rig, settings: Settings, layout: Layout, data: Data) -> Array:
    inputs = lane_inputs(constrain(vector, layout, data), layout, data)
    solve = partial(_solve, settings=settings, adjoint=diffrax.ForwardMode())
    return jax.lax.map(lambda pair: solve(*pair), (inputs, rigs))


@partial(jax.jit, static_argnames="layout")
def _forward(vector: Array, rigs: Rig, settings: Settings, layout: Layout, data: Data) -> Any:
    inputs = lane_inputs(constrain(vector, layout, data), layout, data)
    solve = partial(_solve, settings=settings, adjoint=diffrax.ForwardMode())

    def one(pair: tuple[Array, Rig]) -> tuple[Array, Array]:
        def along(direction: Array) -> tuple[Array, Array]:
            return jax.jvp(lambda x: solve(x, pair[1]), pair[:1], (direction,))

        return jax.vmap(along, out_axes=(None, 1))(jnp.eye(inputs.shape[1]))

    q, jacobian = jax.lax.map(one, (inputs, rigs))
    return value_and_gradient(vector, q, jacobian, layout, data)


@partial(jax.jit, static_argnames="layout")
def _reverse(vector: Array, rigs: Rig, settings: Settings, layout: Layout, data: Data) -> Any:
    solve = partial(_solve, settings=settings, adjoint=diffrax.RecursiveCheckpointAdjoint())

    def density(vector: Array) -> Array:
        inputs = lane_inputs(constrain(vector, layout, data), layout, data)
        q = jax.lax.map(lambda pair: solve(*pair), (inputs, rigs))
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
        self._rigs = _rigs(problem)

    @property
    def arrays(self) -> tuple[Any, ...]:
        """What `traced` needs besides the vector."""
        return self._rigs, self._accuracy, self.problem.data

    def traced(
        self, vector: Float[Array, " n"], rigs: Rig, accuracy: Settings, data: Data
    ) -> tuple[Float[Array, ""], Float[Array, " n"]]:
        """Log posterior and its gradient within a larger program."""
        return self._gradient(vector, rigs, accuracy, self.problem.layout, data)

    def coordinates(self, vector: Float[np.ndarray, " n"]) -> Coordinates:
        layout, data = self.problem.layout, self.problem.data
        return np.asarray(_coordinates(vector, self._rigs, self._accuracy, layout, data))

    def __call__(self, vector: Float[np.ndarray, " n"]) -> Gradient:
        layout, data = self.problem.layout, self.problem.data
        value, gradient = self._gradient(vector, self._rigs, self._accuracy, layout, data)
        return float(value), np.asarray(gradient)


class ReverseDiffrax(GenericDiffrax):
    """The same solver, differentiated in reverse through checkpoints."""

    name = "diffrax Kvaerno5, reverse mode"
    _gradient = staticmethod(_reverse)
