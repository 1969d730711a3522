"""The log posterior against finite differences, a dense density and NumPyro's own."""

from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import numpyro
import pytest
from numpyro import distributions as dist
from numpyro.infer.util import log_density

from muscle_bayes.data import read_runs
from muscle_bayes.inference.model.density import (
    constrain,
    lane_fits,
    log_likelihood,
    potential,
    unconstrain,
)
from muscle_bayes.inference.model.lane_model import responses
from muscle_bayes.inference.model.problem import Problem, pose
from muscle_bayes.inference.running.forward_jacobian import first_order, with_forward_jacobian

DATA = Path(__file__).parents[2] / "data" / "plain"


def near_prior_median(problem: Problem) -> jnp.ndarray:
    values = {
        name: jnp.median(problem.data.priors[name].sample(jax.random.key(0), (2001,)), axis=0)
        for name, _ in problem.layout.shapes
    }
    return unconstrain(values, problem.layout, problem.data)


@pytest.fixture(scope="module")
def springs() -> Problem:
    with jax.enable_x64(True):
        return pose(read_runs([DATA / "spring-1.csv", DATA / "spring-3.csv"]))


def test_constrain_inverts_unconstrain(springs: Problem) -> None:
    vector = near_prior_median(springs)
    again = unconstrain(
        constrain(vector, springs.layout, springs.data), springs.layout, springs.data
    )
    np.testing.assert_allclose(again, vector, rtol=1e-9)


def test_gradient_agrees_with_finite_differences(springs: Problem) -> None:
    f = jax.jit(lambda v: potential(v, springs.layout, springs.data))
    vector = near_prior_median(springs)
    gradient = jax.jit(jax.grad(f))(vector)
    for entry in range(vector.size):
        step = jnp.zeros_like(vector).at[entry].set(1e-6)
        numeric = (f(vector + step) - f(vector - step)) / 2e-6
        np.testing.assert_allclose(gradient[entry], numeric, rtol=2e-4, atol=1e-3)


def test_numpyro_finds_the_same_density(springs: Problem) -> None:
    layout, data = springs.layout, springs.data
    vector = near_prior_median(springs)
    values = constrain(vector, layout, data)

    def model() -> None:
        drawn = {name: numpyro.sample(name, data.priors[name]) for name, _ in layout.shapes}
        numpyro.sample("runs", dist.Unit(log_likelihood(drawn, layout, data)))

    theirs, _ = log_density(model, (), {}, values)
    jacobian = sum(
        jnp.sum(
            dist.biject_to(data.priors[name].support).log_abs_det_jacobian(
                dist.biject_to(data.priors[name].support).inv(values[name]), values[name]
            )
        )
        for name, _ in layout.shapes
    )
    np.testing.assert_allclose(-potential(vector, layout, data), theirs + jacobian, rtol=1e-9)


def test_errors_are_standard_where_the_model_is_true(springs: Problem) -> None:
    layout, data = springs.layout, springs.data
    values = constrain(near_prior_median(springs), layout, data)
    values |= {"J": jnp.asarray(0.00124103), "D": jnp.asarray(0.0054594)}
    values |= {"fast.noise": jnp.asarray(0.4), "fast.discrepancy": jnp.asarray(0.05)}
    values |= {
        "fast.zero": jnp.array([510.9076, 513.5533]),
        "fast.start": jnp.array([510.9, 513.55]),
    }
    errors = jnp.concatenate([fit.errors.ravel() for fit in lane_fits(values, layout, data)])
    seen = errors[errors != 0.0]
    assert 0.8 < float(jnp.std(seen)) < 1.2


def test_a_failed_solve_is_rejected(springs: Problem) -> None:
    layout, data = springs.layout, springs.data
    values = constrain(near_prior_median(springs), layout, data) | {"J": jnp.asarray(jnp.nan)}
    assert log_likelihood(values, layout, data) == -jnp.inf


@pytest.mark.parametrize("derived", [with_forward_jacobian, first_order])
def test_forward_jacobian_serves_both_modes(derived: Callable) -> None:
    wrapped = derived(lambda x, scale: jnp.sin(x) * scale)
    x = jnp.array([0.3, 1.1])
    np.testing.assert_array_equal(wrapped(x, 2.0), 2.0 * jnp.sin(x))
    expected = np.diag(2.0 * np.cos(np.asarray(x)))
    np.testing.assert_allclose(jax.jacrev(wrapped)(x, 2.0), expected, rtol=1e-12)
    np.testing.assert_allclose(jax.jacfwd(wrapped)(x, 2.0), expected, rtol=1e-12)


def test_responses_follow_the_zero(springs: Problem) -> None:
    layout, data = springs.layout, springs.data
    values = constrain(near_prior_median(springs), layout, data)
    moved = values | {key: values[key] + 1.0 for key in ("fast.zero", "fast.start")}
    before, after = (responses(v, layout, data)[0].averaged for v in (values, moved))
    np.testing.assert_allclose(after - before, 1.0, rtol=1e-9)


def test_many_data_sets_of_one_layout_at_once(springs: Problem) -> None:
    """A batch by vmap is each data set by itself, and one compiled program serves them all."""
    layout, data = springs.layout, springs.data
    (lanes,) = data.lanes
    sets = [
        data._replace(lanes=(lanes._replace(reading=lanes.reading + shift),))
        for shift in (0.0, 0.3, -0.7)
    ]
    vector = near_prior_median(springs)
    batch = jax.tree.map(lambda *leaves: jnp.stack(jnp.broadcast_arrays(*leaves)), *sets)
    together = jax.jit(jax.vmap(lambda one: jax.value_and_grad(potential)(vector, layout, one)))
    values, gradients = together(batch)
    alone = jax.jit(jax.value_and_grad(potential), static_argnums=1)
    for index, one in enumerate(sets):
        value, gradient = alone(vector, layout, one)
        np.testing.assert_allclose(values[index], value, rtol=1e-9)
        np.testing.assert_allclose(gradients[index], gradient, rtol=1e-6, atol=1e-6)
    assert alone._cache_size() == 1
