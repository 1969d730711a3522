"""What a candidate of a nested model says of every lane, as compiled programs."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.model.density import explained
from muscle_bayes.inference.model.lane_model import (
    Inputs,
    LanePrediction,
    Origin,
    of_segment,
    origins,
    physical_of,
    simulate_lane,
    zeros_of,
)
from muscle_bayes.inference.model.lanes import Lanes
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.running.forward_jacobian import first_order
from muscle_bayes.inference.running.program import program
from muscle_bayes.inference.search.nested import (
    Choice,
    log_prior_at,
    prior_precision_at,
    shared_leaves,
    values_at,
)


class Motion(NamedTuple):
    """What the model says of a lane."""

    prediction: LanePrediction
    hyst: Float[Array, " interval"]
    """sigma_hyst of side A; 0 of segments."""


Predictor = Callable[[Any, Any], Motion]
"""Motion of a lane from chosen leaves of the plant and what is its own, and from what is held fixed."""


def _of_run(layout: Layout, regime: str, structure: Any) -> Predictor:
    """Of one run, whose own are the leaves of its start. `structure` is that of Inputs."""

    def predict(moving: tuple[Array, Array], aux: tuple[Array, Array, Lanes]) -> Motion:
        (fixed, index, lane), (shared, own) = aux, moving
        leaves = fixed.at[index].set(shared, mode="drop")
        inputs = jax.tree.unflatten(structure, [*leaves, *own])
        response = simulate_lane(inputs, lane, layout, regime)
        prediction = LanePrediction(response.averaged, None, response.finite * 1.0)
        return Motion(prediction, response.hyst[:, 0])

    return predict


def _of_segment(layout: Layout, regime: str, structure: Any) -> Predictor:
    """Of one segment, which has none of its own. `structure` is that of Physical."""

    def predict(moving: Array, aux: tuple[Array, Array, Lanes]) -> Motion:
        fixed, index, lane = aux
        leaves = fixed.at[index].set(moving, mode="drop")
        physical = jax.tree.unflatten(structure, list(leaves))
        return Motion(of_segment(physical, lane, layout, regime), jnp.zeros_like(lane.time))

    return predict


def motions_at(
    point: Float[Array, " n"],
    choice: Choice,
    layout: Layout,
    data: Data,
    differentiated: Callable[[Predictor], Predictor],
) -> list[Motion]:
    """Motions of every lane, one entry a group.

    `differentiated` makes a lane's motion differentiable, in the few numbers on which it depends.
    """
    values = values_at(point, choice, layout, data)
    parts, shape = jax.tree.flatten(physical_of(values, layout, data))
    leaves = jnp.stack([jnp.asarray(leaf, float) for leaf in parts])
    index = jnp.concatenate([shared_leaves(layout), choice.leaf])
    moving = leaves.at[index].get(mode="fill", fill_value=0.0)
    fixed = jax.lax.stop_gradient(leaves)
    result = []
    for lanes, regime, cut in zip(data.lanes, layout.regimes, layout.segmented, strict=True):

        def of_segment_(lane: Lanes, regime: str = regime) -> Motion:
            return differentiated(_of_segment(layout, regime, shape))(moving, (fixed, index, lane))

        def of_run(lane: Lanes, origin: Origin, regime: str = regime) -> Motion:
            physical = jax.tree.unflatten(shape, list(leaves))
            structure = jax.tree.structure(Inputs(physical, origin))
            both = moving, jnp.stack(jax.tree.leaves(origin))
            return differentiated(_of_run(layout, regime, structure))(both, (fixed, index, lane))

        if cut:
            result.append(jax.vmap(of_segment_)(lanes))
        else:
            result.append(jax.vmap(of_run)(lanes, origins(values, lanes, data, regime, cut)))
    return result


def _values_alone(predict: Predictor) -> Predictor:
    """Without derivatives."""
    return predict


@program
def values_of(
    point: Float[Array, " n"], choice: Choice, layout: Layout, data: Data
) -> dict[str, Array]:
    """Sampled values at a point."""
    return {k: jnp.asarray(v) for k, v in values_at(point, choice, layout, data).items()}


class Likelihood(NamedTuple):
    """A point, judged by the readings. Errors are those of all groups, flat."""

    log_likelihood: Float[Array, ""]
    parts: Float[Array, " part"]
    """Standardised one-step-ahead errors, then the logs of their scales; 0 where nothing is observed."""
    log_densities: Float[Array, " error"]
    """Of each observed reading given the earlier ones; 0 where none."""
    residuals: list[Float[Array, "lane interval"]]
    """Reading minus model [log's unit]."""
    hyst: list[Float[Array, "lane interval"]]
    """sigma_hyst of side A."""


class Prior(NamedTuple):
    """A point, judged by the prior."""

    log_density: Float[Array, ""]
    pull: Float[Array, " n"]
    """Gradient of the log density."""
    precision: Float[Array, "n n"]


class Explained(NamedTuple):
    """A point, judged: `Likelihood` and `Prior` together."""

    potential: Float[Array, ""]
    """Negative log posterior density."""
    parts: Float[Array, " part"]
    log_densities: Float[Array, " error"]
    residuals: list[Float[Array, "lane interval"]]
    hyst: list[Float[Array, "lane interval"]]
    pull: Float[Array, " n"]
    prior: Float[Array, "n n"]
    """Precision of the prior."""

    @property
    def errors(self) -> Float[Array, " error"]:
        """Standardised one-step-ahead errors."""
        return self.parts[: len(self.parts) // 2]


def _judged(likelihood: Likelihood, prior: Prior) -> Explained:
    potential = -(likelihood.log_likelihood + prior.log_density)
    return Explained(potential, *likelihood[1:], *prior[1:])


def _likelihood(
    point: Array,
    choice: Choice,
    layout: Layout,
    data: Data,
    differentiated: Callable[[Predictor], Predictor] = _values_alone,
) -> Likelihood:
    values = values_at(point, choice, layout, data)
    motions = motions_at(point, choice, layout, data, differentiated)
    predicted = [motion.prediction for motion in motions]
    fits = explained(predicted, values, layout, data)
    total = sum(fit.log_density.sum() for fit in fits)
    finite = jnp.stack([fit.finite.all() for fit in fits]).all() & jnp.isfinite(total)
    residuals = [
        lanes.reading - zeros_of(values, lanes, regime, cut)[:, None] - one.reading
        for one, lanes, regime, cut in zip(
            predicted, data.lanes, layout.regimes, layout.segmented, strict=True
        )
    ]
    return Likelihood(
        log_likelihood=jnp.where(finite, total, -jnp.inf),
        parts=_flat([*(fit.errors for fit in fits), *(fit.log_scale for fit in fits)]),
        log_densities=_flat([fit.log_density for fit in fits]),
        residuals=residuals,
        hyst=[motion.hyst for motion in motions],
    )


def _flat(parts: list[Array]) -> Array:
    return jnp.concatenate([part.ravel() for part in parts])


@program
def _prior_alone(point: Float[Array, " n"], choice: Choice, layout: Layout, data: Data) -> Prior:
    here = partial(jax.value_and_grad(log_prior_at), choice=choice, layout=layout, data=data)
    return Prior(*here(point), prior_precision_at(point, choice, layout, data))


def prior_at(point: Float[Array, " n"], choice: Choice, layout: Layout, data: Data) -> Prior:
    """The prior at a point: a program of its own, for it needs neither runs nor simulation."""
    return _prior_alone(point, choice, layout, data._replace(lanes=()))


@program
def _likelihood_at(
    point: Float[Array, " n"], choice: Choice, layout: Layout, data: Data
) -> Likelihood:
    return _likelihood(point, choice, layout, data)


def explained_at(
    point: Float[Array, " n"], choice: Choice, layout: Layout, data: Data
) -> Explained:
    """How a point explains the readings."""
    where = point, choice, layout, data
    return _judged(_likelihood_at(*where), prior_at(*where))


class Slopes(NamedTuple):
    """Derivatives of a likelihood, by forward mode."""

    gradient: Float[Array, " n"]
    """Of the log likelihood."""
    information: Float[Array, "n n"]
    """Fisher information."""
    parts: Float[Array, "n part"]


class Look(NamedTuple):
    """A point with its derivatives, as least squares looks at it."""

    seen: Explained
    gradient: Float[Array | np.ndarray, " n"]
    """Of the potential."""
    information: Float[Array | np.ndarray, "n n"]
    """Fisher information of the likelihood plus the prior's precision."""
    slopes: Float[Array | np.ndarray, "n part"]
    """Derivatives of the parts."""

    @property
    def potential(self) -> Float[Array, ""]:
        """Negative log posterior density."""
        return self.seen.potential

    @property
    def jacobian(self) -> Float[Array | np.ndarray, "n error"]:
        """Derivatives of the errors."""
        return self.slopes[:, : self.slopes.shape[1] // 2]


@program
def _slopes_at(
    point: Float[Array, " n"], choice: Choice, layout: Layout, data: Data
) -> tuple[Likelihood, Slopes]:
    def judged(point: Array) -> tuple[tuple[Array, Array], Likelihood]:
        found = _likelihood(point, choice, layout, data, first_order)
        return (found.log_likelihood, found.parts), found

    def along(direction: Array) -> tuple[tuple[Array, Array], Likelihood]:
        return jax.jvp(judged, (point,), (direction,), has_aux=True)[1:]

    (gradient, parts), found = jax.vmap(along, out_axes=(0, None))(jnp.eye(point.size))
    return found, Slopes(gradient, parts @ parts.T, parts)


def look_at(point: Float[Array, " n"], choice: Choice, layout: Layout, data: Data) -> Look:
    """A point and its derivatives, by forward mode.

    The information of normal errors e = r / s is (de)(de)' + (d ln s)(d ln s)'. Errors alone would tell
    half of what is known of noise parameters, whose steps would then be twice too long.
    """
    where = point, choice, layout, data
    (likelihood, slopes), prior = _slopes_at(*where), prior_at(*where)
    return Look(
        _judged(likelihood, prior),
        -(slopes.gradient + prior.pull),
        slopes.information + prior.precision,
        slopes.parts,
    )
