"""Coordinates in which HYST's creep and its thermal strain are told apart, for the sampler alone."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.prior import COLD, HOT
from muscle_bayes.inference.problem import Data, Layout

STRETCH, TAUT, TIME = "slow.hyst_stretch", "taut_strain", "time_constant"
CONTRACTION, BEND = "contraction", "bend"
LEAST_FALL = 0.05
"""Least fall of strain, as a share of the contraction from cold to hot, that is told apart from none."""


class Unbent(NamedTuple):
    """A point of the posterior."""

    vector: Float[Array, " n"]
    """Unconstrained."""
    log_volume: Float[Array, ""]
    """Log determinant of the vector's derivative in the bent coordinates."""


class _Places(NamedTuple):
    """Where in the unconstrained vector."""

    stretch: np.ndarray
    taut: int
    time: int
    contraction: int
    bend: int


def starts(layout: Layout) -> dict[str, int]:
    """Where in the unconstrained vector each sampled quantity begins."""
    places = np.cumsum([0, *(int(np.prod(shape)) for _, shape in layout.shapes)])
    return {name: int(place) for (name, _), place in zip(layout.shapes, places, strict=False)}


def _places(layout: Layout) -> _Places | None:
    at = starts(layout)
    if STRETCH not in at or TAUT not in at:
        return None
    count = int(np.prod(dict(layout.shapes)[STRETCH]))
    shared = (at[name] for name in (TAUT, TIME, CONTRACTION, BEND))
    return _Places(at[STRETCH] + np.arange(count), *shared)


def durations(layout: Layout, data: Data) -> Float[Array, " run"]:
    """Length of each record in which a muscle creeps, s; empty without such records."""
    places = _places(layout)
    if places is None:
        return jnp.zeros(0)
    duration = jnp.zeros(places.stretch.size)
    groups = zip(data.lanes, layout.regimes, layout.segmented, strict=True)
    for lanes, regime, cut in groups:
        if regime == "slow" and not cut:
            duration = duration.at[lanes.run].max(lanes.schedule.time[:, -1])
    return duration


def _shares(time_constant: Array, layout: Layout, data: Data) -> Float[Array, " run"]:
    """1 - exp(-duration / time constant) of each run: how much of HYST's creep its record shows."""
    return -jnp.expm1(-durations(layout, data) / time_constant)


def _log_fall(bend: Array, layout: Layout, data: Data) -> Float[Array, ""]:
    """Log of the fall of thermal strain to the hottest temperature logged, per unit contraction."""
    slow = [
        jnp.max(lanes.schedule.temperature)
        for lanes, regime in zip(data.lanes, layout.regimes, strict=True)
        if regime == "slow"
    ]
    x = (jnp.max(jnp.stack(slow)) - COLD) / (HOT - COLD)
    return jnp.log(jnp.maximum(x - 4.0 * bend * x * (1.0 - x), LEAST_FALL))


def unbent_hyst(bent: Float[Array, " n"], layout: Layout, data: Data) -> Unbent:
    """The unconstrained vector from bent coordinates.

    A record shorter than HYST's time constant tau tells how far HYST crept in it,
    c = stretch (1 - exp(-duration / tau)), and the strain it began with, taut_strain + stretch, but
    hardly tau: along that ridge stretch and taut_strain go as 1/c. So c of every run and
    taut_strain + mean stretch take their places. Likewise the fall of thermal strain to the hottest
    temperature logged takes the place of contraction, which may lie far beyond.
    """
    places = _places(layout)
    if places is None:
        return Unbent(bent, jnp.zeros(()))
    share = _shares(jnp.exp(bent[places.time]), layout, data)
    stretch = bent[places.stretch] / share
    vector = bent.at[places.stretch].set(stretch).at[places.taut].add(-jnp.mean(stretch))
    vector = vector.at[places.contraction].add(-_log_fall(bent[places.bend], layout, data))
    return Unbent(vector, -jnp.sum(jnp.log(share)))


def bent_hyst(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, " n"]:
    """Inverse of `unbent_hyst`."""
    places = _places(layout)
    if places is None:
        return vector
    share = _shares(jnp.exp(vector[places.time]), layout, data)
    stretch = vector[places.stretch]
    moved = vector.at[places.stretch].set(stretch * share)
    moved = moved.at[places.taut].add(jnp.mean(stretch))
    return moved.at[places.contraction].add(_log_fall(vector[places.bend], layout, data))
