"""A chain's transitions: what a trajectory takes over from the last one changes nothing."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.inference.optimise import find_mode
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.preparation import prepare
from muscle_bayes.inference.problem import pose
from muscle_bayes.inference.whitening_at_mode import whitening

DATA = Path(__file__).parents[2] / "data"
ITERATIONS = 50


@pytest.mark.parametrize(
    "name", ["spring-1", pytest.param("staircase-166g", marks=pytest.mark.slow)]
)
@double_precision
def test_the_simulation_taken_over_is_that_of_the_chains_point(name: str):
    """A chain that simulates anew makes the same draws, through rejections and walled moves."""
    problem = pose(read_runs([DATA / f"{name}.csv"]))
    layout, data = problem.layout, problem.data
    kernel = prepare(layout, data).kernel
    mode = find_mode(jax.random.key(0), layout, data)
    white = whitening(mode, layout, data)
    begun = kernel.start(jax.random.key(3), white, data)
    adapting, one = jnp.asarray(0.0), jnp.asarray(1)
    together, rows = kernel.advance(begun, white, data, adapting, jnp.asarray(ITERATIONS))
    apart, fresh = [], []
    state = begun
    for _ in range(ITERATIONS):
        state, row = kernel.advance(
            state._replace(fresh=jnp.asarray(False)), white, data, adapting, one
        )
        apart.append(row.vector[0])
        fresh.append(bool(state.fresh))
    np.testing.assert_allclose(rows.vector[:ITERATIONS], np.stack(apart), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(together.z, state.z, rtol=1e-6, atol=1e-9)
    # Both ways have been gone.
    assert 0 < sum(fresh) < ITERATIONS
