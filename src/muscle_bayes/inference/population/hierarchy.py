"""The hierarchical model: specimens scatter about a population's mean by a spread that is estimated.

    theta_i ~ N(mean, diag(spread^2)),   data_i ~ p(data_i | theta_i)

Each specimen is fitted on its own; its likelihood enters as a Gaussian in `coordinates`, which is what its
posterior has beyond its prior, and theta_i is integrated out exactly. So a fit of the population costs
seconds whatever the runs' length. Where a likelihood is far from Gaussian in these coordinates the
population is only as good as that approximation.
"""

import functools
from collections.abc import Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import numpyro
from jaxtyping import Array, Float
from numpyro import distributions as dist
from numpyro.infer import MCMC, NUTS

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.population.coordinates import NAMES, PLAIN, coordinates
from muscle_bayes.inference.population.population import Population, contents
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.running.precision import double_precision

SPREAD = 0.08
"""Prior median of the spread between specimens: relative, of a logarithm or logit."""
STRAIN_SPREAD = 0.008
"""The same of taut strain and bend, which have no logarithm."""
SPREAD_DOUBT = 0.4
"""Standard deviation of the logarithm of the prior spread: 90 % within a factor of 1.9."""


class Likelihood(NamedTuple):
    """Gaussian likelihoods of specimens, exp(-x' information x / 2 + shift' x)."""

    information: Float[Array, "specimen coordinate coordinate"]
    shift: Float[Array, "specimen coordinate"]


def _gaussian(place: np.ndarray, prior: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Information and shift that the posterior draws `place` have beyond draws of the prior.

    In units of the prior, directions that the data do not tell (or seem to widen) count for nothing.
    """
    middle, factor = prior.mean(0), np.linalg.cholesky(np.cov(prior.T))
    whitened = np.linalg.solve(factor, (place - middle).T)
    values, vectors = np.linalg.eigh(np.cov(whitened))
    precision = 1.0 / values
    data = np.maximum(precision - 1.0, 0.0)
    # posterior: precision m = data x + 1 0; so data x = precision m where the data tell anything
    towards = vectors.T @ whitened.mean(1) * np.where(data > 0.0, precision, 0.0)
    back = np.linalg.solve(factor.T, vectors)
    information = (back * data) @ back.T
    return information, back @ towards + information @ middle


def model(
    likelihood: Likelihood, prior_mean: Array, prior_factor: Array, spread: Array, doubt: float
) -> None:
    """Mean and spread of a population, given Gaussian likelihoods of its specimens."""
    z = numpyro.sample("z", dist.Normal(0.0, 1.0).expand((len(spread),)).to_event(1))
    mean = numpyro.deterministic("mean", prior_mean + prior_factor @ z)
    scatter = dist.LogNormal(jnp.log(spread), doubt).to_event(1)
    numpyro.factor(
        "specimens", _marginal(likelihood, mean, numpyro.sample("spread", scatter)).sum()
    )


def _marginal(likelihood: Likelihood, mean: Array, spread: Array) -> Float[Array, " specimen"]:
    """log of the integral over theta_i of N(theta_i; mean, spread^2) times its likelihood."""

    def one(information: Array, shift: Array) -> Array:
        left = shift - information @ mean
        scaled = jnp.eye(len(spread)) + spread[:, None] * information * spread
        factor = jnp.linalg.cholesky(scaled)
        half = jax.scipy.linalg.solve_triangular(factor, spread * left, lower=True)
        straight = shift @ mean - 0.5 * mean @ information @ mean
        return straight + 0.5 * half @ half - jnp.log(jnp.diag(factor)).sum()

    return jax.vmap(one)(*likelihood)


def _pooled(
    likelihood: Likelihood, mean: np.ndarray, spread: np.ndarray, generator
) -> list[np.ndarray]:
    """Draws of every specimen's coordinates given draws of the population's."""
    found = []
    for information, shift in zip(*map(np.asarray, likelihood), strict=True):
        precision = information + np.eye(mean.shape[1]) / spread[:, None, :] ** 2
        centre = np.linalg.solve(precision, (shift + mean / spread**2)[..., None])[..., 0]
        noise = generator.standard_normal(mean.shape)[..., None]
        factor = np.linalg.cholesky(precision)
        found.append(centre + np.linalg.solve(np.swapaxes(factor, 1, 2), noise)[..., 0])
    return found


@functools.cache
def _sampler(warm_up: int, draws: int) -> MCMC:
    """Compiled once for all data of a shape."""
    kernel = NUTS(model, dense_mass=True, target_accept_prob=0.9)
    return MCMC(
        kernel,
        num_warmup=warm_up,
        num_samples=draws,
        progress_bar=False,
        jit_model_args=True,
    )


@double_precision
def sample_population(
    likelihood: Likelihood,
    prior_mean: np.ndarray,
    prior_covariance: np.ndarray,
    spread: np.ndarray,
    *,
    doubt: float = SPREAD_DOUBT,
    warm_up: int = 500,
    draws: int = 1000,
    seed: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Draws of mean and spread by NUTS."""
    mcmc = _sampler(warm_up, draws)
    factor = jnp.asarray(np.linalg.cholesky(prior_covariance))
    data = Likelihood(*map(jnp.asarray, likelihood))
    mcmc.run(
        jax.random.key(seed), data, jnp.asarray(prior_mean), factor, jnp.asarray(spread), doubt
    )
    found = mcmc.get_samples()
    return np.asarray(found["mean"]), np.asarray(found["spread"])


def prior_spread(spread: float = SPREAD, strain: float = STRAIN_SPREAD) -> np.ndarray:
    """Prior medians of the spread, in the order of the coordinates."""
    return np.array([strain if name in PLAIN else spread for name in NAMES])


def fit_population(
    posteriors: Mapping[str, Posterior],
    *,
    spread: float = SPREAD,
    strain_spread: float = STRAIN_SPREAD,
    doubt: float = SPREAD_DOUBT,
    draws: int = 1000,
    seed: int = 0,
) -> Population:
    """The population that specimens come from.

    Args:
        posteriors: of every specimen, by name, fitted alike; one is enough, and then the spread is its
            prior.
        spread: prior median of the relative spread between specimens.
        strain_spread: the same of taut strain and bend.
        doubt: standard deviation of the logarithm of the spread's prior.
        draws: how many.
        seed: of the random numbers.

    Returns:
        Draws of mean and spread, and of every specimen partially pooled.

    Raises:
        MuscleBayesError: where there is no posterior, one has no muscle, or they are of different models.

    Example:
        >>> import muscle_bayes as mb
        >>> from muscle_bayes.inference.population import fit_population
        >>> population = fit_population({"m1": mb.load("muscle.nc")})  # of `fit`
        >>> population.summary().loc["modulus", "spread"] > 0.02
        True
    """
    if not posteriors:
        raise MuscleBayesError("no specimen is given. Fix: give posteriors of muscles")
    _alike(posteriors)
    first = next(iter(posteriors.values()))
    _, _, length, tension = contents(first)
    prior = coordinates(contents(first, "prior")[0], length, tension)
    prior = prior[np.isfinite(prior).all(1)]
    rows, shared = [], []
    for posterior in posteriors.values():
        table, common, *_ = contents(posterior)
        rows.append(_gaussian(coordinates(table, length, tension), prior))
        shared.append(common)
    likelihood = Likelihood(*(np.stack(column) for column in zip(*rows, strict=True)))
    mean, scatter = sample_population(
        likelihood,
        prior.mean(0),
        np.cov(prior.T),
        prior_spread(spread, strain_spread),
        doubt=doubt,
        draws=draws,
        seed=seed,
    )
    pooled = _pooled(likelihood, mean, scatter, np.random.default_rng(seed))
    size = min(len(one["J"]) for one in shared) if "J" in shared[0] else 0
    return Population(
        mean,
        scatter,
        dict(zip(posteriors, pooled, strict=True)),
        {key: np.concatenate([one[key][:size] for one in shared]) for key in shared[0]},
        first.friction,
        first.effects,
        length,
        tension,
    )


def _alike(posteriors: Mapping[str, Posterior]) -> None:
    """Raises MuscleBayesError where specimens were fitted by different models."""
    (name, first), *others = posteriors.items()
    for other, posterior in others:
        if (posterior.friction, posterior.effects) != (first.friction, first.effects):
            raise MuscleBayesError(
                f"specimens {name} and {other} have different models: "
                f"{first.friction} friction with {first.effects or 'no effects'}, "
                f"{posterior.friction} with {posterior.effects or 'none'}. Fix: fit all alike"
            )
