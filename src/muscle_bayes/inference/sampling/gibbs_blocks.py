"""Blocks of sites, and the one that is slice sampled: minimum forces and noise."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.infer import CustomGibbs
from numpyro.infer.gibbs import GIBBS_SITES_KWARG, CustomGibbsState

from muscle_bayes.inference.model.calibration_model import CalibrationModel, all_solved
from muscle_bayes.inference.model.lane_model import LanePrediction, predictions
from muscle_bayes.inference.model.noise import NoiseParameters
from muscle_bayes.inference.model.problem import Data
from muscle_bayes.inference.sampling.slice_sampling import slice_sweep

MINIMUM_FORCES = ("F_modulus_min", "F_hyst_min")
"""The springs' minimum forces. Below the least tension of the records they change nothing, above it
nearly everything: such walls throw gradient-based samplers off."""


class Blocks(NamedTuple):
    """Names of the sampled sites, each in one block."""

    smooth: tuple[str, ...]
    """In which the posterior, the others given, is nearly normal."""
    minimum_forces: tuple[str, ...]
    noise: tuple[str, ...]
    """Noise parameters: their density is a curved funnel, but costs no simulation."""


def blocks_of(names: Sequence[str]) -> Blocks:
    """The blocks of these sites."""
    noise = tuple(name for name in names if name.rpartition(".")[2] in NoiseParameters._fields)
    forces = tuple(name for name in names if name in MINIMUM_FORCES)
    return Blocks(tuple(n for n in names if n not in noise + forces), forces, noise)


class Slices(NamedTuple):
    """How the slice-sampled block moves."""

    force_width: float = 4.0
    """Interval of a minimum force, in its logarithm."""
    force_rounds: int = 2
    noise_widths: tuple[float, float, float] = (0.5, 6.0, 5.0)
    """Intervals of log total, log odds and log correlation time."""
    noise_rounds: int = 4

    def noise_directions(self) -> Float[np.ndarray, "direction 3"]:
        """Each coordinate, and that along which a long-lived discrepancy's steps stay as large."""
        size, odds, time = self.noise_widths
        return np.vstack([np.diag([size, odds, time]), [0.5 * time, 0.0, time]])


class SliceBlock(CustomGibbs):
    """Minimum forces, with simulations, then noise parameters, on the last prediction alone.

    A `CustomGibbs` whose update sees the model's arguments: compiled code then serves any data of the
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


def force_update(model: CalibrationModel, slices: Slices) -> Update:
    """Slices of the minimum forces of a model; each costs a simulation."""
    layout = model.problem.layout
    names = blocks_of([name for name, _ in layout.shapes]).minimum_forces

    def update(
        key: Array, own: Mapping[str, Array], others: Mapping[str, Array], data: Data
    ) -> dict[str, Array]:
        values = {**others, **own}

        def density(point: Array) -> tuple[Array, tuple[()]]:
            moved = values | dict(zip(names, jnp.exp(point), strict=True))
            predicted = predictions(moved, layout, data)
            return _log_prior(moved, names, data) + _log_likelihood(
                model, moved, predicted, data
            ), ()

        forces = jnp.log(jnp.stack([values[name] for name in names]))
        steps = jnp.tile(slices.force_width * jnp.eye(forces.size), (slices.force_rounds, 1))
        there = slice_sweep(key, density, forces, steps)
        return dict(zip(names, jnp.exp(there.point), strict=True))

    return update


def noise_update(model: CalibrationModel, slices: Slices) -> Update:
    """Slices of the noise parameters of a model, on one prediction."""
    layout = model.problem.layout
    names = blocks_of([name for name, _ in layout.shapes]).noise
    regimes = tuple(dict.fromkeys(layout.regimes))

    def update(
        key: Array, own: Mapping[str, Array], others: Mapping[str, Array], data: Data
    ) -> dict[str, Array]:
        values = {**others, **own}
        predicted = predictions(values, layout, data)

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

    return update


def _log_prior(values: Mapping[str, Array], names: Sequence[str], data: Data) -> Array:
    """Of positive sites, with respect to their logarithms."""
    parts = [data.priors[name].log_prob(values[name]) + jnp.log(values[name]) for name in names]
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
