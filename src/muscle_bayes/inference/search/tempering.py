"""Noise taken for as large as the misfit, and a horizon that grows: what lets a descent begin far off."""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from muscle_bayes.inference.model.density import constrain, rms_by_regime, unconstrain
from muscle_bayes.inference.model.lane_model import LanePrediction
from muscle_bayes.inference.model.noise import NoiseParameters
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.running.program import program
from muscle_bayes.inference.running.programs import potential_with, predictions_at

HORIZONS = (1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)
"""Shares of an inertial run that are fitted one after the other. A phase that is known over one is known
to a fraction of a turn over the next, where least squares of the whole run would slip cycles."""
EFFECTIVE_SHARE = 5.0
"""Readings per independent one while a shape is fitted."""


class Lasting(NamedTuple):
    """How a misfit is taken for lasting."""

    size: float = 1.0
    """Standard deviation, in the misfit's RMS."""
    time: float = 1.0
    """Correlation time, in the expected one."""


AS_EXPECTED = (Lasting(),)
OR_SUDDEN = tuple(Lasting(size, time) for size in (1.0, 2.0) for time in (1 / 64, 1 / 16, 1 / 4, 1))
"""A model that is right but for a sudden jump, as a poured load makes, leaves a misfit that changes faster
than a wrong model's does, and is larger where it is."""


class Misfit(NamedTuple):
    """A vector with each regime's noise set to its misfit."""

    white: Float[Array, " n"]
    """As if all of it were white: looks at the whole shape of a run."""
    lasting: Float[Array, " n"]
    """As if all of it were discrepancy: looks at how it changes."""
    ratio: Float[Array, ""]
    """Largest ratio of a regime's RMS misfit to the noise expected of a reading."""


@program
def _misfit_of(
    predicted: list[LanePrediction], vector: Array, taken: Lasting, layout: Layout, data: Data
) -> Misfit:
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
            (lasting, (typical["noise"].mean, taken.size * misfit, taken.time * time)),
        ):
            keys = (f"{regime}.{key}" for key in NoiseParameters._fields)
            target.update(zip(keys, noise, strict=True))
    return Misfit(unconstrain(white, layout, data), unconstrain(lasting, layout, data), ratio)


def misfit_at(
    vector: Array, layout: Layout, data: Data, ways: Sequence[Lasting] = AS_EXPECTED
) -> tuple[Misfit, float]:
    """The misfit of a vector, and the potential where it is taken for lasting (inf where unsolved).

    Of several `ways` to take it, that which makes it likeliest.
    """
    predicted = predictions_at(vector, layout, data)

    def taken(way: Lasting) -> tuple[Misfit, float]:
        as_arrays = Lasting(*map(jnp.asarray, way))
        misfit = _misfit_of(predicted, vector, as_arrays, layout, data)
        level = float(potential_with(predicted, misfit.lasting, layout, data))
        return misfit, level if np.isfinite(level) else np.inf

    return min(map(taken, ways), key=lambda one: one[1])


def entry_names(layout: Layout) -> list[str]:
    """The quantity to which each entry of the unconstrained vector belongs."""
    return [name for name, shape in layout.shapes for _ in range(int(np.prod(shape)))]


def is_noise(names: list[str]) -> Bool[np.ndarray, " n"]:
    """Which of these quantities are noise parameters."""
    return np.array([name.rpartition(".")[2] in NoiseParameters._fields for name in names])


def horizons(layout: Layout) -> tuple[float, ...]:
    """Shares of inertial runs to fit, one after the other; the whole alone where other runs count too."""
    swings = not any(layout.segmented) and set(layout.regimes) == {"fast"}
    return HORIZONS if swings else HORIZONS[-1:]


def up_to(share: float, layout: Layout, data: Data) -> Data:
    """The data with the first `share` of each inertial run's readings alone."""
    if share >= 1.0:
        return data
    lanes = []
    for group, regime, cut in zip(data.lanes, layout.regimes, layout.segmented, strict=True):
        if regime == "fast" and not cut:
            rank = jnp.cumsum(group.weight > 0, axis=1)
            seen = rank <= jnp.maximum(share * rank[:, -1:], 12)
            group = group._replace(weight=jnp.where(seen, group.weight, 0.0))
        lanes.append(group)
    return data._replace(lanes=tuple(lanes))
