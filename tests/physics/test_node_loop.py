"""The loop over nodes does what diffrax's own forward mode does, and ends where runs end."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.physics.elements import NoElement, ReferenceSpring
from muscle_bayes.physics.friction import CoulombFriction
from muscle_bayes.physics.linkage import Pins
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.schedule import Schedule
from muscle_bayes.physics.simulation import initial_state, simulate
from muscle_bayes.physics.solvers import QuasiStatic, StickSlip
from muscle_bayes.physics.solvers.node_loop import NodeLoop
from muscle_bayes.physics.state import PlantState

SOLVERS = [StickSlip(), QuasiStatic()]


def swing(
    D: jax.Array, end: jax.Array | float, solver, adjoint: diffrax.AbstractAdjoint, padding: int = 0
) -> PlantState:
    """States of a spring-driven rotor whose load jumps; `padding` steps of no length follow."""
    spring = ReferenceSpring(Pins(0.03, 0.03, 0.06, mirror=1.0))
    plant = Plant(1.2e-3, CoulombFriction(D), spring, NoElement(), 0.0889, (-1.2, 1.2))
    time = jnp.pad(jnp.linspace(0.0, end, 151), (0, padding), mode="edge")
    drive = Schedule.sampled(time, load=jnp.where(time[1:] < 0.7, 0.14, 0.16))
    begin = initial_state(plant, drive, q=-0.25)
    return simulate(plant, drive, begin, solver=solver, adjoint=adjoint).ys  # type: ignore[return-value]


@pytest.mark.parametrize("solver", SOLVERS, ids=["inertial", "quasi-static"])
def test_states_and_derivatives_are_those_of_diffrax_forward_mode(solver):
    with jax.enable_x64(True):
        ways = [
            jax.jacfwd(lambda D, way=way: (swing(D, 1.5, solver, way),) * 2, has_aux=True)(5e-3)
            for way in (NodeLoop(), diffrax.ForwardMode())
        ]
    ours, theirs = map(jax.tree.leaves, ways)
    assert float(jnp.abs(ways[0][0].q).max()) > 1.0, "the derivative is put to the test"
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("solver", SOLVERS, ids=["inertial", "quasi-static"])
def test_runs_of_other_lengths_side_by_side_are_as_alone(solver):
    ends = np.array([1.5, 0.4, 1.0])
    with jax.enable_x64(True):
        together = jax.vmap(lambda end: swing(5e-3, end, solver, NodeLoop(), padding=20))(ends)
        alone = [swing(5e-3, end, solver, NodeLoop()) for end in ends]
    for row, one in enumerate(alone):
        np.testing.assert_allclose(together.q[row, :151], one.q, atol=1e-12)
        np.testing.assert_allclose(together.q[row, 151:], one.q[-1], atol=1e-12)


def test_padding_is_not_simulated():
    class Counting(StickSlip):
        def step(self, *args):
            jax.debug.callback(lambda: steps.append(1))
            return super().step(*args)

    steps: list[int] = []
    with jax.enable_x64(True):
        jax.block_until_ready(swing(5e-3, 1.5, Counting(), NodeLoop(), padding=500))
        jax.effects_barrier()
    # 150 intervals, and the step of no length before them.
    assert len(steps) == 151
