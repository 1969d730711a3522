"""Draws of the prior."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro import distributions as dist

from muscle_bayes.inference.model.priors import WHOLE
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.model.standardised_normal import StandardisedNormal

SAMPLERS: dict[type[dist.Distribution], Callable[..., np.ndarray]] = {
    dist.Normal: lambda rng, size, loc, scale: rng.normal(loc, scale, size),
    dist.LogNormal: lambda rng, size, loc, scale: rng.lognormal(loc, scale, size),
    dist.HalfNormal: lambda rng, size, scale: np.abs(rng.normal(0.0, scale, size)),
    dist.HalfCauchy: lambda rng, size, scale: np.abs(scale * rng.standard_cauchy(size)),
    dist.Beta: lambda rng, size, concentration1, concentration0: rng.beta(
        concentration1, concentration0, size
    ),
}
"""Of the distributions in use, by NumPy's generator."""


def sample_prior(
    key: Array, count: int, layout: Layout, data: Data
) -> dict[str, Float[np.ndarray, "draw ..."]]:
    """`count` draws of all sampled values.

    By NumPy: JAX would compile a random generator for each distribution and shape, which takes seconds.
    """
    seeds = np.random.SeedSequence(np.asarray(jax.random.key_data(key)).tolist())
    parts = seeds.spawn(len(layout.shapes))
    return {
        name: _drawn(np.random.default_rng(part), (count, *shape), *data.priors.family(name))
        for part, (name, shape) in zip(parts, layout.shapes, strict=True)
    }


def _drawn(
    rng: np.random.Generator,
    size: tuple[int, ...],
    kind: type[dist.Distribution],
    parameters: dict[str, Any],
) -> Float[np.ndarray, "draw ..."]:
    sampler = SAMPLERS.get(dist.Normal if issubclass(kind, StandardisedNormal) else kind)
    if sampler is None:  # of an effect that is not ours
        key = jax.random.key(rng.integers(2**31))
        prior = parameters.get(WHOLE) or kind(**parameters)
        return np.asarray(prior.sample(key, size[:1]))
    return sampler(rng, size, **{name: np.asarray(value) for name, value in parameters.items()})


def prior_draws(key: Array, count: int, layout: Layout, data: Data) -> dict[str, Array]:
    """`count` draws of all sampled values, a leading axis of each."""
    return {
        name: jnp.asarray(value) for name, value in sample_prior(key, count, layout, data).items()
    }
