"""Blocks of sites, and those that are slice sampled: what acts like a wall, and noise."""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro import distributions as dist
from numpyro.infer import CustomGibbs
from numpyro.infer.gibbs import GIBBS_SITES_KWARG, CustomGibbsState

from muscle_bayes.inference.model.calibration_model import CalibrationModel, all_solved
from muscle_bayes.inference.model.lane_model import LanePrediction, predictions
from muscle_bayes.inference.model.muscle_prior import MINIMUM_FORCES
from muscle_bayes.inference.model.noise import NoiseParameters
from muscle_bayes.inference.model.problem import Data
from muscle_bayes.inference.sampling.slice_sampling import slice_sweep


class Blocks(NamedTuple):
    """Names of the sampled sites, each in one block."""

    smooth: tuple[str, ...]
    """In which the posterior, the others given, is nearly normal."""
    walls: tuple[str, ...]
    """Those that are taken apart because they act beyond a threshold only."""
    noise: tuple[str, ...]
    """Noise parameters: their density is a curved funnel, but costs no simulation."""


def blocks_of(names: Sequence[str], walls: Collection[str] = MINIMUM_FORCES) -> Blocks:
    """The blocks of these sites; `walls` are names of sites, or of effects with all of theirs."""
    noise = tuple(name for name in names if name.rpartition(".")[2] in NoiseParameters._fields)
    apart = tuple(n for n in names if n in walls or n.partition(".")[0] in walls)
    return Blocks(tuple(n for n in names if n not in noise + apart), apart, noise)


class Slices(NamedTuple):
    """How the slice-sampled block moves."""

    wall_width: float = 4.0
    """Interval of a site that acts like a wall, unconstrained: of a force in its logarithm."""
    wall_rounds: int = 2
    noise_widths: tuple[float, float, float] = (0.5, 6.0, 5.0)
    """Intervals of log total, log odds and log correlation time."""
    noise_rounds: int = 4

    def noise_directions(self) -> Float[np.ndarray, "direction 3"]:
        """Each coordinate, and that along which a long-lived discrepancy's steps stay as large."""
        size, odds, time = self.noise_widths
        return np.vstack([np.diag([size, odds, time]), [0.5 * time, 0.0, time]])


class SliceBlock(CustomGibbs):
    """A `CustomGibbs` whose update sees the model's arguments: compiled code then serves any data of the
    same shapes. `update(key, own, others, data)` returns new values of its sites.
    """

    def __init__(self, update: Callable[..., Mapping[str, Array]]) -> None:
        super().__init__(update)
        self._update = update

    def sample(self, state: CustomGibbsState, model_args: Any, model_kwargs: Any) -> Any:
        key, key_update = jax.random.split(state.rng_key)
        others = (model_kwargs or {}).get(GIBBS_SITES_KWARG, {})
        return CustomGibbsState(self._update(key_update, state.z, others, *model_args), key)


def _mixture_of(values: Mapping[str, Array], regime: str) -> Float[Array, "3"]:
    """(log total, log odds of the discrepancy's share of variance, log correlation time).

    The data show the total well and, where the discrepancy is short-lived, its share hardly: in these
    coordinates the density is less curved than in log noise and log discrepancy. The Jacobian
    determinant of the map is constant.
    """
    noise, size, time = (jnp.log(values[f"{regime}.{key}"]) for key in NoiseParameters._fields)
    return jnp.stack([0.5 * jnp.logaddexp(2.0 * noise, 2.0 * size), 2.0 * (size - noise), time])


def _noise_of_mixture(mixture: Float[Array, "3"], regime: str) -> dict[str, Array]:
    """Inverse of `_mixture_of`."""
    total, odds, time = mixture
    noise = total + 0.5 * jax.nn.log_sigmoid(-odds)
    size = total + 0.5 * jax.nn.log_sigmoid(odds)
    keys = (f"{regime}.{key}" for key in NoiseParameters._fields)
    return {key: jnp.exp(value) for key, value in zip(keys, (noise, size, time), strict=True)}


type Update = Callable[..., dict[str, Array]]
"""Of some sites, from key, own values, those of all other sites, and data."""


def wall_update(model: CalibrationModel, slices: Slices, names: Sequence[str]) -> Update:
    """Slices of sites of a model that act like walls; each look costs a simulation."""
    layout = model.problem.layout

    def update(
        key: Array, own: Mapping[str, Array], others: Mapping[str, Array], data: Data
    ) -> dict[str, Array]:
        values = {**others, **own}
        transforms = [dist.biject_to(data.priors[name].support) for name in names]

        def density(point: Array) -> tuple[Array, tuple[()]]:
            there = [transform(one) for transform, one in zip(transforms, point, strict=True)]
            moved = values | dict(zip(names, there, strict=True))
            predicted = predictions(moved, layout, data)
            return _log_prior(moved, names, data) + _log_likelihood(
                model, moved, predicted, data
            ), ()

        begun = [t.inv(values[name]) for t, name in zip(transforms, names, strict=True)]
        steps = jnp.tile(slices.wall_width * jnp.eye(len(names)), (slices.wall_rounds, 1))
        there = slice_sweep(key, density, jnp.stack(begun), steps).point
        pairs = zip(names, transforms, there, strict=True)
        return {name: transform(one) for name, transform, one in pairs}

    return update


def noise_slices(model: CalibrationModel, slices: Slices) -> Callable[..., dict[str, Array]]:
    """Slices of the noise parameters of a model: from key, values, prediction and data."""
    layout = model.problem.layout
    names = blocks_of([name for name, _ in layout.shapes]).noise
    regimes = tuple(dict.fromkeys(layout.regimes))

    def sliced(
        key: Array, values: Mapping[str, Array], predicted: list[LanePrediction], data: Data
    ) -> dict[str, Array]:
        def with_noise(point: Array) -> dict[str, Array]:
            moved = dict(values)
            for regime, mixture in zip(regimes, point.reshape(-1, 3), strict=True):
                moved |= _noise_of_mixture(mixture, regime)
            return moved

        def density(point: Array) -> tuple[Array, tuple[()]]:
            moved = with_noise(point)
            return _log_prior(moved, names, data) + _log_likelihood(
                model, moved, predicted, data
            ), ()

        mixtures = jnp.concatenate([_mixture_of(values, regime) for regime in regimes])
        directions = np.kron(np.eye(len(regimes)), slices.noise_directions())
        steps = jnp.tile(jnp.asarray(directions), (slices.noise_rounds, 1))
        found = with_noise(slice_sweep(key, density, mixtures, steps).point)
        return {name: found[name] for name in names}

    return sliced


def noise_update(model: CalibrationModel, slices: Slices) -> Update:
    """The same as a block of its own."""
    sliced, layout = noise_slices(model, slices), model.problem.layout

    def update(
        key: Array, own: Mapping[str, Array], others: Mapping[str, Array], data: Data
    ) -> dict[str, Array]:
        values = {**others, **own}
        return sliced(key, values, predictions(values, layout, data), data)

    return update


def _log_prior(values: Mapping[str, Array], names: Sequence[str], data: Data) -> Array:
    """Of sites, with respect to their unconstrained values."""
    parts = []
    for name in names:
        transform = dist.biject_to(data.priors[name].support)
        volume = transform.log_abs_det_jacobian(transform.inv(values[name]), values[name])
        parts.append(data.priors[name].log_prob(values[name]) + volume)
    return jnp.sum(jnp.stack(parts))


def _log_likelihood(
    model: CalibrationModel,
    values: Mapping[str, Array],
    predicted: list[LanePrediction],
    data: Data,
) -> Array:
    pairs = model.likelihoods(values, predicted, data).values()
    total = sum(jnp.sum(one.log_prob(readings)) for one, readings in pairs)
    return jnp.where(all_solved(predicted), total, -jnp.inf)
