"""The whole shape of runs, fitted with the noise set to what is missed."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.model.density import constrain, rms_by_regime, unconstrain
from muscle_bayes.inference.model.lane_model import LanePrediction
from muscle_bayes.inference.model.noise import NoiseParameters
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.running.program import Program
from muscle_bayes.inference.running.programs import potential_with, predictions_at
from muscle_bayes.inference.search.blocks import blocks
from muscle_bayes.inference.search.mode import descend

SHAPE_ROUNDS, SHAPE_STEPS = 4, 15
"""Most rounds of fitting a shape, the noise set to the misfit before each, and steps in a round."""
SETTLED = 1e-3
"""Relative change of the misfit in a round after which there is none more."""
EFFECTIVE_SHARE = 5.0
"""Readings per independent one while a shape is fitted."""


class Misfit(NamedTuple):
    """A vector with each regime's noise set to its misfit."""

    white: Float[Array, " n"]
    """As if all of it were white: looks at the whole shape of a run."""
    lasting: Float[Array, " n"]
    """As if all of it were discrepancy: looks at how it changes."""
    ratio: Float[Array, ""]
    """Largest ratio of a regime's RMS misfit to the noise expected of a reading."""


@Program
def _misfit_of(predicted: list[LanePrediction], vector: Array, layout: Layout, data: Data):
    values = constrain(vector, layout, data)
    white, lasting, ratio = dict(values), dict(values), jnp.zeros(())
    for regime, misfit in rms_by_regime(predicted, values, layout, data).items():
        typical = {key: data.priors[f"{regime}.{key}"] for key in NoiseParameters._fields}
        weights = [
            lanes.weight.ravel()
            for lanes, name in zip(data.lanes, layout.regimes, strict=True)
            if name == regime
        ]
        readings = jnp.quantile(jnp.concatenate(weights), 0.9)
        time = typical["correlation_time"].mean
        ratio = jnp.maximum(ratio, misfit / typical["noise"].mean)
        for target, noise in (
            (white, (misfit * jnp.sqrt(EFFECTIVE_SHARE * readings), 1e-3 * misfit, time)),
            (lasting, (typical["noise"].mean, misfit, time)),
        ):
            keys = (f"{regime}.{key}" for key in NoiseParameters._fields)
            target.update(zip(keys, noise, strict=True))
    return Misfit(unconstrain(white, layout, data), unconstrain(lasting, layout, data), ratio)


def with_misfit(vector: Array, layout: Layout, data: Data) -> tuple[Misfit, float]:
    """The misfit of a vector, and the potential where it is taken for lasting."""
    predicted = predictions_at(vector, layout, data)
    misfit = _misfit_of(predicted, vector, layout, data)
    return misfit, float(potential_with(predicted, misfit.lasting, layout, data))


def noise_mask(layout: Layout) -> np.ndarray:
    """1 for entries of the vector that are not noise parameters."""
    ends = tuple(f".{key}" for key in NoiseParameters._fields)
    return np.concatenate(
        [
            np.full(int(np.prod(shape)), float(not name.endswith(ends)))
            for name, shape in layout.shapes
        ]
    )


class Shape(NamedTuple):
    """A start after its misfit was fitted as if it were white."""

    level: float
    """Negative log density with its misfit taken for lasting."""
    vector: Float[Array, " n"]
    """With that noise."""
    ratio: float
    """Largest ratio of a regime's RMS misfit to the noise expected of a reading."""


def shaped(vector: Array, layout: Layout, data: Data) -> Shape:
    """Fit the whole shape of runs, the noise set to the misfit before each round.

    In the first round minimum forces are held: while all else is wrong, their prior alone would pull a
    spring open that has to be shut.
    """
    free = noise_mask(layout)
    misfit, level = with_misfit(vector, layout, data)
    for count in range(SHAPE_ROUNDS):
        held = blocks(layout).walled if count == 0 else np.zeros(0, int)
        physical = np.where(np.isin(np.arange(free.size), held), 0.0, free)
        vector = descend(misfit.white, layout, data, physical, SHAPE_STEPS).vector
        before, (misfit, level) = misfit, with_misfit(vector, layout, data)
        if count and abs(before.ratio - misfit.ratio) < SETTLED * misfit.ratio:
            break
    # Where nothing can be simulated the level is NaN, which no other start would count as better than.
    return Shape(level if np.isfinite(level) else np.inf, misfit.lasting, float(misfit.ratio))
