"""Normal equations are the slope and curvature of the log likelihood along parameters that act linearly."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.inference.density import constrain, explained
from muscle_bayes.inference.lane_model import predictions
from muscle_bayes.inference.normal_equations import Linear, normal_equations, shown
from muscle_bayes.inference.optimise import find_mode
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.problem import pose

DATA = Path(__file__).parents[2] / "data"
SIZE = 3


@double_precision
@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("again", [False, True])
def test_they_are_slope_and_curvature_of_the_log_likelihood(free: bool, again: bool) -> None:
    problem = pose(read_runs([DATA / "spring-1.csv", DATA / "spring-2.csv"]))
    layout, data = problem.layout, problem.data
    mode = find_mode(jax.random.key(0), layout, data)
    values = constrain(mode.vector, layout, data)
    rng = np.random.default_rng(0)
    lanes, predicted = data.lanes[0], predictions(values, layout, data)[0]
    size = lanes.reading.shape
    slope = rng.normal(size=(*size, SIZE))
    if again:
        lanes = lanes._replace(again=lanes.reading + rng.normal(size=size))
    if free:
        start, pivot, spread = rng.uniform(0.5, 1.5, size=(3, size[0], 2))
        lanes = lanes._replace(start=start, pivot=pivot, start_spread=spread)
        predicted = predicted._replace(reach=jnp.asarray(rng.normal(size=(*size, 2))))
    data = data._replace(lanes=[lanes])

    def log_likelihood(c: jax.Array) -> jax.Array:
        there = predicted._replace(reading=predicted.reading + slope @ c)
        return sum(fit.log_density.sum() for fit in explained([there], values, layout, data))

    at = [Linear(*shown([predicted], values, layout, data), jnp.asarray(slope), predicted)]
    found = normal_equations(at, values, layout, data)
    nowhere = jnp.zeros(SIZE)
    expected = jax.grad(log_likelihood)(nowhere)
    np.testing.assert_allclose(found.pull, expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())
    np.testing.assert_allclose(
        found.information, -jax.hessian(log_likelihood)(nowhere), rtol=1e-7, atol=1e-9
    )
