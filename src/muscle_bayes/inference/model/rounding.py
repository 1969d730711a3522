"""What a sensor that rounds makes of noisy readings."""

import numpy as np
from jaxtyping import Float
from scipy.stats import norm


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
