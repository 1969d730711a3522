"""Errors of data sets that a model itself would give, rounded as the sensor rounds."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.stats import norm

from muscle_bayes.discovery.fitted import Fitted
from muscle_bayes.inference.search.nested import Nested, values_at


def replicated_errors(
    nested: Nested, fitted: Fitted, count: int, seed: int, fine: float = 3.0
) -> Float[np.ndarray, "error replicate"]:
    """Standardised errors of data sets that the model itself would give, in the order of `fitted.errors`.

    A sensor that rounds by more than its noise biases the readings of a rotor at rest, the mean of many
    as much as each: by how much depends on where between two steps it lies, which no model tells so well.

    Readings are rounded as the sensor rounds, where noise is below `fine` of its steps; where between
    two steps each run lies is drawn.
    """
    rng = np.random.default_rng(seed)
    values = values_at(jnp.asarray(fitted.point), fitted.choice, nested.layout, fitted.data)
    places = rng.uniform(0.0, 1.0, (len(nested.problem.runs), count))
    parts = []
    for lanes, regime, owners, residual in zip(
        fitted.data.lanes,
        nested.layout.regimes,
        nested.problem.lane_runs,
        fitted.seen.residuals,
        strict=True,
    ):
        noise, whole = float(values[f"{regime}.noise"]), jax.tree.map(np.asarray, lanes)
        modelled = whole.reading - np.asarray(residual)
        for lane, owner in enumerate(owners):
            normal = rng.standard_normal((modelled.shape[1], count))
            quantum, coarse = float(whole.quantum[lane]), whole.coarse[lane][:, None]
            readings = np.maximum(whole.weight[lane], 1.0)[:, None]
            if 0.0 < noise < fine * quantum:
                spread = noise / quantum
                place = modelled[lane][:, None] / quantum + places[owner]
                error = rounded_errors(place, normal, readings, spread)
                normal = error / np.sqrt(spread**2 / readings + coarse)
            parts.append(normal)
    return np.concatenate(parts)


def rounded_errors(
    place: Float[np.ndarray, "interval replicate"],
    normal: Float[np.ndarray, "interval replicate"],
    readings: Float[np.ndarray, "interval 1"],
    spread: float,
) -> Float[np.ndarray, "interval replicate"]:
    """Mean of so many readings with noise of this spread, rounded to integers, less the place measured.

    A single one is round(y + s z) - y of place y. Means have its bias, as far as the place stays the same
    while they are taken, and what is left of its variance.
    """
    single = np.round(place + spread * normal) - place
    bias, deviation = (np.interp(place % 1.0, *table) for table in _tables(spread))
    moved = np.abs(np.gradient(place, axis=0)) if len(place) > 1 else np.zeros_like(place)
    mean = np.sinc(moved) * bias + deviation * normal / np.sqrt(readings)
    return np.where(readings > 1.0, mean, single)


def _tables(spread: float, places: int = 64) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Bias and standard deviation of a rounded reading, each with the places they are of."""
    place = np.linspace(0.0, 1.0, places + 1)
    reach = int(np.ceil(6.0 * spread)) + 2
    told = np.arange(-reach, reach + 2)
    edges = (np.append(told - 0.5, told[-1] + 0.5) - place[:, None]) / spread
    chance = np.diff(norm.cdf(edges), axis=1)
    mean = chance @ told
    variance = chance @ told**2 - mean**2
    return (place, mean - place), (place, np.sqrt(np.maximum(variance, 0.0)))
