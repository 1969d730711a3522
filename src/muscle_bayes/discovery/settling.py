"""The seconds after a change of load, which are not judged: slow motion leaves its swings out."""

import numpy as np
from jaxtyping import Bool, Float

SETTLING = 30.0
"""How long after a change of load a slow run is not judged, s."""
HEATED = 1.0
"""Range of temperature from which on a run is one of a heated muscle, C."""


def settled(
    time: Float[np.ndarray, " interval"],
    load: Float[np.ndarray, " interval"],
    temperature: Float[np.ndarray, " interval"],
) -> Bool[np.ndarray, " interval"]:
    """Intervals before the first change of load [kg], and more than SETTLING after the last one."""
    changes = np.flatnonzero(np.diff(load)) + 1
    if np.ptp(temperature) <= HEATED or changes.size == 0:
        return np.ones(time.shape, bool)
    last = np.searchsorted(changes, np.arange(time.size), side="right") - 1
    return (last < 0) | (time - time[changes[np.maximum(last, 0)]] > SETTLING)
