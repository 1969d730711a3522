"""How dry friction holds a rotor where a run began, until its dead band has moved there.

A rotor in slow motion that begins at s is at clip(s, low(t), high(t)): low and high are the motions of
rotors that begin far below and far above it (play operator). A rotor that came to rest by sliding lies
at an edge of its dead band, so that readings have a kink where the posterior has the edge on either side
of s: HYST, which creeps otherwise in a rotor that slides, carries it on.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.bend_hyst import starts
from muscle_bayes.inference.lane_model import LanePrediction
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.programs import predictions_at

START, ZERO = "slow.start", "slow.zero"
ASIDE = 8.0
"""Prior standard deviations from the start at which the rotors far below and above begin."""

MOST_POINTS = 100
"""Points by which bands are told."""
MET = 0.1
"""Width of a dead band, as a share of the first, at which its two edges count as met."""


class Line(NamedTuple):
    """middle + slope @ x."""

    middle: Float[Array, "lane interval"]
    slope: Float[Array, "lane interval x"]

    def at(self, x: Float[Array, " x"]) -> Float[Array, "lane interval"]:
        """Value at x."""
        return self.middle + self.slope @ x


class DeadBand(NamedTuple):
    """Lanes that begin in slow motion, in readings above that at q = 0."""

    start: Line
    """The same in every interval, as far as it counts."""
    low: Line
    high: Line
    """All are 0 once low and high have met (MET): the rotor has forgotten where it began."""

    def at(self, x: Float[Array, " x"]) -> Float[Array, "lane interval"]:
        """Where the rotor is held."""
        return jnp.minimum(jnp.maximum(self.start.at(x), self.low.at(x)), self.high.at(x))

    def beyond(self, x: Float[Array, " x"]) -> Float[Array, " 2lane"]:
        """How far each start lies below its dead band, then how far above."""
        start, low, high = (Line(*(part[:, 0] for part in line)).at(x) for line in self)
        return jnp.maximum(jnp.concatenate([low - start, start - high]), 0.0)


def _held(layout: Layout) -> list[bool]:
    """Which groups of lanes are runs in slow motion."""
    groups = zip(layout.regimes, layout.segmented, strict=True)
    return [regime == "slow" and not cut for regime, cut in groups]


def blank_bands(shapes: list[LanePrediction], layout: Layout, size: int) -> list[DeadBand | None]:
    """Of the layout's and the predictions' shapes, None where nothing is held."""

    def blank(one: LanePrediction) -> DeadBand:
        line = Line(jnp.zeros(one.reading.shape), jnp.zeros((*one.reading.shape, size)))
        return DeadBand(line, line, line)

    groups = zip(shapes, _held(layout), strict=True)
    return [blank(one) if held else None for one, held in groups]


def starts_of(
    vector: Float[np.ndarray, " n"], layout: Layout, data: Data
) -> list[Float[np.ndarray, " lane"] | None]:
    """First reading above that at q = 0 of every lane, None where nothing is held.

    Starts and zeros are unbounded: the unconstrained vector holds them as they are.
    """
    at = starts(layout)

    def of_group(run: np.ndarray) -> np.ndarray:
        zero = vector[at[ZERO] + run] if ZERO in at else 0.0
        return vector[at[START] + run] - zero

    groups = zip(data.lanes, _held(layout), strict=True)
    return [of_group(np.asarray(lanes.run)) if held else None for lanes, held in groups]


def fitted_bands(
    x: Float[np.ndarray, "point x"],
    vectors: Float[np.ndarray, "point n"],
    layout: Layout,
    data: Data,
) -> list[DeadBand | None]:
    """Least squares of bands at points with coordinates x, at most MOST_POINTS of them.

    Points that cannot be simulated are left out.
    """
    held = _held(layout)
    if not any(held):
        return [None] * len(held)
    some = np.linspace(0, len(x) - 1, min(MOST_POINTS, len(x))).astype(int)
    x, vectors = x[some], vectors[some]
    spread = ASIDE * np.asarray(data.priors[START].scale)
    place = starts(layout)[START] + np.arange(spread.size)

    def aside(sign: float) -> list[list[LanePrediction]]:
        moved = vectors.copy()
        moved[:, place] += sign * spread
        return [jax.device_get(predictions_at(one, layout, data)) for one in moved]

    low, high = aside(-1.0), aside(1.0)
    begun = [starts_of(vector, layout, data) for vector in vectors]

    def of_group(group: int) -> DeadBand:
        start = np.stack([np.asarray(one[group]) for one in begun])
        return _fitted(x, start, _readings(low, group), _readings(high, group))

    return [of_group(group) if one else None for group, one in enumerate(held)]


def _readings(
    predicted: Sequence[list[LanePrediction]], group: int
) -> Float[np.ndarray, "point lane interval"]:
    return np.stack([one[group].reading for one in predicted])


def _fitted(
    x: Float[np.ndarray, "point x"],
    begun: Float[np.ndarray, "point lane"],
    low: Float[np.ndarray, "point lane interval"],
    high: Float[np.ndarray, "point lane interval"],
) -> DeadBand:
    start = np.broadcast_to(begun[:, :, None], low.shape)
    usable = np.isfinite(low + high).all(axis=(1, 2))
    columns = np.concatenate([np.ones((usable.sum(), 1)), x[usable]], axis=1)
    solve = np.linalg.pinv(columns)
    width = np.median((high - low)[usable], axis=0)
    met = np.logical_or.accumulate(width < MET * width[:, :1], axis=1)

    def line(values: np.ndarray) -> Line:
        found = np.tensordot(solve, np.where(met, 0.0, values[usable]), 1)
        return Line(jnp.asarray(found[0]), jnp.asarray(np.moveaxis(found[1:], 0, -1)))

    return DeadBand(line(start), line(low), line(high))
