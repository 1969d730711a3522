"""What a change of the load leaves unknown."""

import numpy as np
from jaxtyping import Float

from muscle_bayes.data.run import Run

JOLT, POUR = 0.05, 10.0
"""Standard deviation of where a rotor comes to rest after a change of the load, in its way there, and how
near to each other jumps are parts of one change [s]."""
HAND, SWINGS = 0.1, 2.0
"""How exactly it is known when a load changed [s], and for how long the rotor swings after that [s]."""


def changes(jumps: np.ndarray) -> list[np.ndarray]:
    """Times at which the load jumps [s], those of one change together."""
    return np.split(jumps, np.flatnonzero(np.diff(jumps) >= POUR) + 1) if jumps.size else []


def jolted_by(
    nodes: np.ndarray, load: np.ndarray, mean: np.ndarray, seen: np.ndarray
) -> np.ndarray:
    """Variance that jumps of the load add to the discrepancy in each interval [log's unit^2].

    A jolted rotor swings and comes to rest anywhere within friction's reach, by details that nobody
    logs, as how water was poured. There it stays until heat drives it on.
    """
    sizes = np.abs(np.diff(load, prepend=load[:1]))
    begins, ends = nodes[:-1], nodes[1:]
    jolted = np.zeros(load.size)
    for jumps in changes(begins[sizes > 0.0]):
        before = np.flatnonzero(seen & (ends <= jumps[0]))
        after = np.flatnonzero(seen & (begins >= jumps[-1] + SWINGS))
        if before.size and after.size:
            parts = (begins >= jumps[0]) & (begins <= jumps[-1])
            moved = mean[after[0]] - mean[before[-1]]
            jolted[parts] = (JOLT * moved) ** 2 * sizes[parts] / sizes[parts].sum()
    return jolted


def by_hand_spans(run: Run) -> Float[np.ndarray, "change 2"]:
    """Spans in which a hand changes the load, and the rotor swings after that [s].

    Nobody logs how it did so, and when exactly: readings do not count there.
    """
    if run.metadata.load is None:
        return np.zeros((0, 2))
    jumps = np.array([jump for jump in run.load_steps if 0.0 < jump < run.duration])
    return np.array([(one[0] - HAND, one[-1] + SWINGS) for one in changes(jumps)]).reshape(-1, 2)
