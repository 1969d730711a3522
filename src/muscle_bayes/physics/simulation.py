"""A plant's motion under a drive."""

from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from muscle_bayes.physics.memory import starting
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.schedule import Schedule, filtered
from muscle_bayes.physics.solvers.nodes import StepToNodes
from muscle_bayes.physics.solvers.plant_solver import PlantSolver
from muscle_bayes.physics.solvers.quasi_static import QuasiStatic
from muscle_bayes.physics.solvers.stick_slip import StickSlip
from muscle_bayes.physics.state import PlantState


def initial_state(
    plant: Plant,
    drive: Schedule,
    q: ArrayLike = 0.0,
    speed: ArrayLike = 0.0,
    hyst: ArrayLike = 0.0,
) -> PlantState:
    """The state at the drive's start.

    **Arguments:** `q` [rad or m], `speed` [rad/s or m/s], and `hyst`: sigma_hyst, one for both sides
    or one each.

    **Returns:** the state. Effects with memory remember what they do after the plant has long been
    held like this under the drive's first row.

    **Example:**

        >>> import muscle_bayes as mb
        >>> run = mb.load_example("springs")[0]
        >>> plant = mb.plant_of(run, {"J": 1.2e-3, "D": 5e-3})
        >>> drive = mb.Schedule.sampled([0.0, 1.0], 25.0, load=0.108)
        >>> float(mb.initial_state(plant, drive, q=0.1).speed)
        0.0
    """
    q, speed = jnp.asarray(q, float), jnp.asarray(speed, float)
    hyst = jnp.broadcast_to(jnp.asarray(hyst, float), (2,))
    first = filtered(drive, plant.temperature_filters).first if plant.memory_effects else None
    memory = {} if first is None else starting(plant, q, hyst, first).memory
    return PlantState(q, speed, hyst, memory)


def at_rest(plant: Plant, drive: Schedule, state: PlantState) -> PlantState:
    """The state after a slide, in no time, to where dry friction holds the rotor in the first row."""
    drive = filtered(drive, plant.temperature_filters)
    first = drive.segment(drive.t0, drive.t0)
    return QuasiStatic().for_plant(plant).rest(plant.terms(), drive.t0, state, first)


def simulate(
    plant: Plant,
    drive: Schedule,
    state: PlantState,
    *,
    solver: PlantSolver | None = None,
    times: Float[Array, " time"] | None = None,
    adjoint: diffrax.AbstractAdjoint | None = None,
    throw: bool = True,
) -> diffrax.Solution:
    """Solve the plant's equation of motion (`Plant.terms`) over a drive.

    **Arguments:**

    - `plant`: the plant, with all its parameters and effects.
    - `drive`: temperatures [C], load [kg] and applied force [N m or N] over time [s].
    - `state`: where the plant begins, at the drive's first time; see `initial_state`.
    - `solver`: `StickSlip()`, the default, with full inertia; or `QuasiStatic()`, where heat moves the
      rotor so slowly that its inertia does not count.
    - `times`: rising times [s] at which the state is wanted, within the drive's; default: its nodes.
      Steps end at these and at every node. `StickSlip` needs some twenty in each swing of the rotor,
      `QuasiStatic` several wherever the temperature's rate changes.
    - `adjoint`: how diffrax differentiates. The default, `diffrax.DirectAdjoint()`, knows `jax.grad`
      and `jax.jacfwd`; `diffrax.ForwardMode()` only the latter, in less time.
    - `throw`: whether a solve that does not stay finite raises an error, or only says so in `result`.

    **Returns:** a `diffrax.Solution`: `ts` [s], `ys`, the `PlantState` at each of them, and `result`.
    The first state of `QuasiStatic` is that of the rotor come to rest. Works under `jax.jit`,
    `jax.vmap`, `jax.grad` and `jax.jacfwd`, for the plant's parameters, the state and the drive.

    !!! example

        >>> import jax, jax.numpy as jnp
        >>> from muscle_bayes.physics.elements import NoElement, ReferenceSpring
        >>> from muscle_bayes.physics.friction import CoulombFriction
        >>> from muscle_bayes.physics.linkage import Pins
        >>> from muscle_bayes.physics.plant import Plant
        >>> from muscle_bayes.physics.schedule import Schedule
        >>> from muscle_bayes.physics.simulation import initial_state, simulate
        >>> spring = ReferenceSpring(Pins(0.03, 0.03, 0.06, mirror=1.0))
        >>> def stroke(D):
        ...     plant = Plant(1.2e-3, CoulombFriction(D), spring, NoElement(), 0.0889, (-1.2, 1.2))
        ...     drive = Schedule.sampled([0.0, 2.0], load=0.14)
        ...     begin = initial_state(plant, drive, q=-0.25)
        ...     return simulate(plant, drive, begin, times=jnp.linspace(0.0, 2.0, 201)).ys.q[-1]
        >>> with jax.enable_x64(True):
        ...     print(f"{stroke(5e-3):.4f} rad, {jax.grad(stroke)(5e-3):.2f} rad per N m")
        0.0858 rad, 16.46 rad per N m
    """
    drive = filtered(drive, plant.temperature_filters)
    solver = (StickSlip() if solver is None else solver).for_plant(plant)
    nodes = drive.time if times is None else jnp.sort(jnp.concatenate([drive.time, times]))
    adjoint = diffrax.DirectAdjoint() if adjoint is None else adjoint
    solution = _solved(plant, drive, state, solver, nodes, adjoint)
    return _reported(_at(solution, nodes, times), throw)


def _solved(
    plant: Plant,
    drive: Schedule,
    state: PlantState,
    solver: PlantSolver,
    nodes: Float[Array, " node"],
    adjoint: diffrax.AbstractAdjoint,
) -> diffrax.Solution:
    """The solution at the nodes."""
    # The first step has no length, so that the first state is saved, and rests are found in one place.
    steps = jnp.concatenate([nodes[:1], nodes])
    solution = diffrax.diffeqsolve(
        plant.terms(),
        solver,
        steps[0],
        jnp.inf,  # steps are counted: none need be cut short at an end
        None,
        state,
        drive,
        saveat=diffrax.SaveAt(steps=True),
        stepsize_controller=StepToNodes(steps),
        adjoint=adjoint,
        max_steps=nodes.shape[0],
        throw=False,
    )
    return eqx.tree_at(lambda one: one.t1, solution, nodes[-1])


def _at(
    solution: diffrax.Solution, nodes: Float[Array, " node"], times: Float[Array, " time"] | None
) -> diffrax.Solution:
    """The solution at the times that are wanted; at all nodes if none are given."""
    if times is None:
        return solution
    rows = jnp.searchsorted(nodes, times, side="right") - 1
    ys = jax.tree.map(lambda leaf: leaf[rows], solution.ys)
    return eqx.tree_at(lambda one: (one.ts, one.ys), solution, (times, ys))


def _reported(solution: diffrax.Solution, throw: bool) -> diffrax.Solution:
    """The solution, its result telling whether every state is finite."""
    finite = jnp.stack([jnp.isfinite(leaf).all() for leaf in jax.tree.leaves(solution.ys)]).all()
    result = diffrax.RESULTS.where(finite, solution.result, diffrax.RESULTS.nonlinear_divergence)
    if throw:
        ys: Any = result.error_if(solution.ys, ~finite)
        solution = eqx.tree_at(lambda one: one.ys, solution, ys)
    return eqx.tree_at(lambda one: one.result, solution, result)
