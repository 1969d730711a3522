"""Log posterior density of a problem, on an unconstrained vector, as a pure function of the data."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float
from numpyro import distributions as dist
from numpyro.distributions import biject_to

from muscle_bayes.inference.model.damper_axes import from_axes, log_volume, to_axes
from muscle_bayes.inference.model.lane_model import LanePrediction, Values, predictions, zeros_of
from muscle_bayes.inference.model.lanes import Lanes
from muscle_bayes.inference.model.likelihood import noise_of, reading_distribution
from muscle_bayes.inference.model.noise import NoiseParameters
from muscle_bayes.inference.model.problem import Data, Layout

LEAST_PRECISION = 1e-4
"""Least prior precision of a direction, for flat or concave priors."""


def rms_by_regime(
    predicted: list[LanePrediction], values: Values, layout: Layout, data: Data
) -> dict[str, Array]:
    """Root mean square of reading minus model over all readings of each regime [log's unit]."""
    squares: dict[str, Array] = {}
    counts: dict[str, Array] = {}
    groups = zip(predicted, data.lanes, layout.regimes, layout.segmented, strict=True)
    for prediction, lanes, regime, cut in groups:
        zero = zeros_of(values, lanes, regime, cut)[:, None]
        residual = _guarded(lanes.reading - zero - prediction.reading) * (lanes.weight > 0)
        squares[regime] = squares.get(regime, 0.0) + jnp.sum(residual**2)
        counts[regime] = counts.get(regime, 0.0) + jnp.sum(lanes.weight > 0)
    return {regime: jnp.sqrt(squares[regime] / counts[regime]) + 1e-12 for regime in squares}


class LaneFit(NamedTuple):
    """How well one lane is explained."""

    log_density: Float[Array, " interval"]
    """Log density of each observed mean reading given the earlier ones; 0 where none."""
    errors: Float[Array, " interval"]
    """Standardised one-step-ahead errors, what a free start explains taken out; 0 where none."""
    log_scale: Float[Array, " interval"]
    """Log of the standard deviation by which they are standardised; 0 where none."""
    finite: Bool[Array, ""]


def _guarded(residual: Array) -> Array:
    """Residuals that a failed solve made infinite become zero; the caller rejects the proposal."""
    return jnp.where(jnp.isfinite(residual), residual, 0.0)


def _explain(
    lane: Lanes, zero: Array, prediction: LanePrediction, noise: NoiseParameters, regime: str
) -> LaneFit:
    """Density of a lane's readings."""
    distribution = reading_distribution(lane, zero, prediction, noise, regime)
    return LaneFit(*distribution.innovations(lane.reading), prediction.finite > 0.5)


def _explain_all(
    lane: Lanes, zero: Array, prediction: LanePrediction, noise: NoiseParameters, regime: str
) -> LaneFit:
    """Density of a lane's readings, and of those of its second record, one after the other."""
    first = _explain(lane, zero, prediction, noise, regime)
    if lane.again is None:
        return first
    second = _explain(lane._replace(reading=lane.again), zero, prediction, noise, regime)
    return LaneFit(
        jnp.concatenate([first.log_density, second.log_density]),
        jnp.concatenate([first.errors, second.errors]),
        jnp.concatenate([first.log_scale, second.log_scale]),
        first.finite,
    )


def explained(
    predicted: list[LanePrediction], values: Values, layout: Layout, data: Data
) -> list[LaneFit]:
    """How predictions explain the readings under the values' zeros and noise, one entry a group."""
    result = []
    groups = zip(predicted, data.lanes, layout.regimes, layout.segmented, strict=True)
    for prediction, lanes, regime, cut in groups:
        noise = noise_of(values, regime)

        def one(lane, zero, prediction, noise=noise, regime=regime):
            return _explain_all(lane, zero, prediction, noise, regime)

        result.append(jax.vmap(one)(lanes, zeros_of(values, lanes, regime, cut), prediction))
    return result


def lane_fits(values: Values, layout: Layout, data: Data) -> list[LaneFit]:
    """How every lane is explained, one entry a group, each with a leading lane axis."""
    return explained(predictions(values, layout, data), values, layout, data)


def constrain(vector: Float[Array, " n"], layout: Layout, data: Data) -> dict[str, Array]:
    """Sampled values from the unconstrained vector, along the axes of `damper_axes`."""
    vector = from_axes(vector, layout, data)
    groups = data.priors.by_family(layout.shapes)
    values = _placed([(biject_to(p.support)(vector[entries]), entries) for p, entries in groups])
    found, position = {}, 0
    for name, shape in layout.shapes:
        size = int(np.prod(shape))
        found[name] = values[position : position + size].reshape(shape)
        position += size
    return found


def _placed(parts: list[tuple[Array, np.ndarray]]) -> Array:
    """A vector of parts, each with its entries; a static gather, for scatters are slow to compile."""
    order = np.argsort(np.concatenate([entries for _, entries in parts]))
    return jnp.concatenate([part for part, _ in parts])[order]


def unconstrain(values: Values, layout: Layout, data: Data) -> Float[Array, " n"]:
    """The unconstrained vector of sampled values."""
    parts = [
        jnp.ravel(biject_to(data.priors[name].support).inv(jnp.asarray(values[name])))
        for name, _ in layout.shapes
    ]
    return to_axes(jnp.concatenate(parts), layout, data)


def site_priors(free: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, " n"]:
    """Log prior density of each entry of the sites' unconstrained values.

    Those of one family together: what is evaluated one by one is compiled one by one.
    """

    def density(prior: dist.Distribution, part: Array) -> Array:
        transform = biject_to(prior.support)
        value = transform(part)
        return prior.log_prob(value) + transform.log_abs_det_jacobian(part, value)

    groups = data.priors.by_family(layout.shapes)
    return _placed([(density(prior, free[entries]), entries) for prior, entries in groups])


def log_prior(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, ""]:
    """Log prior density of the unconstrained vector."""
    priors = site_priors(from_axes(vector, layout, data), layout, data)
    return jnp.sum(priors) + log_volume(vector, layout, data)


def prior_precision(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, "n n"]:
    """Precision of the prior along the axes of an unconstrained vector."""
    sites = partial(from_axes, layout=layout, data=data)

    def total(free: Array) -> Array:
        return jnp.sum(site_priors(free, layout, data))

    return precision_through(sites, total, vector)


def precision_through(
    sites: Callable[[Array], Array],
    log_density: Callable[[Array], Array],
    place: Float[Array, " n"],
) -> Float[Array, "n n"]:
    """Precision at a place whose `sites` are independent of each other: their Hessian is diagonal."""
    free = sites(place)
    stiff = -jax.jvp(jax.grad(log_density), (free,), (jnp.ones_like(free),))[1]
    ways = jax.jacfwd(sites)(place)
    precision = ways.T @ (jnp.maximum(stiff, 0.0)[:, None] * ways)
    return precision + jnp.diag(jnp.maximum(LEAST_PRECISION - jnp.diag(precision), 0.0))


def _total(fits: list[LaneFit]) -> Float[Array, ""]:
    """Log likelihood of all lanes; -inf where a solve failed."""
    total = sum(fit.log_density.sum() for fit in fits)
    finite = jnp.stack([fit.finite.all() for fit in fits]).all()
    return jnp.where(finite & jnp.isfinite(total), total, -jnp.inf)


def log_likelihood(values: Values, layout: Layout, data: Data) -> Float[Array, ""]:
    """Log likelihood; -inf where a solve failed."""
    return _total(lane_fits(values, layout, data))


def potential(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, ""]:
    """Negative log posterior density of the unconstrained vector."""
    likelihood = log_likelihood(constrain(vector, layout, data), layout, data)
    return -(log_prior(vector, layout, data) + likelihood)


def potential_given(
    predicted: list[LanePrediction], vector: Float[Array, " n"], layout: Layout, data: Data
) -> Float[Array, ""]:
    """`potential` where the predictions at the vector are known: no solve, for noise alone to vary."""
    fits = explained(predicted, constrain(vector, layout, data), layout, data)
    return -(log_prior(vector, layout, data) + _total(fits))


def likelihood_errors_and_scales(
    vector: Float[Array, " n"], layout: Layout, data: Data
) -> tuple[Float[Array, ""], Float[Array, " errors"]]:
    """Log likelihood, and every standardised error e and the log of its scale s.

    Their Jacobian j gives the Fisher information j'j = (de)'(de) + (d ln s)'(d ln s) in expectation.
    Errors alone would tell half of what is known of noise parameters, and steps be twice too long.
    """
    fits = lane_fits(constrain(vector, layout, data), layout, data)
    parts = [part.ravel() for fit in fits for part in (fit.errors, fit.log_scale)]
    return _total(fits), jnp.concatenate(parts)
