"""Where a posterior has the edges of the dead bands that runs begin in: coordinates for it."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from muscle_bayes.inference.bend_hyst import starts
from muscle_bayes.inference.dead_bands import START, DeadBand, Line, fitted_bands
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.programs import potential_at
from muscle_bayes.inference.squeeze import Squeeze

NEAR = 4.0
"""Standard deviations within which an edge lies when coordinates are squeezed there."""
LEAST_SLOPE = 0.5
"""Least change of the distance beyond an edge with the start: else it is not told well."""
DEPTHS = np.geomspace(0.02, 1.0, 12)
"""Distances inside an edge at which it is seen how well a start is told there, in its prior standard
deviations."""
BLUNT = 0.3
"""Width of the passage between both sides, in the same."""


class Frame(NamedTuple):
    """Whitened coordinates of bent ones: bent[smooth] = centre[smooth] + factor @ x."""

    centre: Float[np.ndarray, " n"]
    factor: Float[np.ndarray, "smooth smooth"]
    smooth: np.ndarray
    walled: np.ndarray

    def of(self, bent: Float[np.ndarray, "point n"]) -> Float[np.ndarray, "point x"]:
        """x of the smooth entries, then the walled ones above the centre."""
        away = bent - self.centre
        x = np.linalg.solve(self.factor, away[:, self.smooth].T).T
        return np.hstack([x, away[:, self.walled]])


def squeeze_at(
    x: Float[np.ndarray, "point x"],
    vectors: Float[np.ndarray, "point n"],
    frame: Frame,
    layout: Layout,
    data: Data,
) -> Squeeze:
    """Coordinates for the edges among unconstrained vectors, which stand for the frame's x."""
    none = Squeeze.none(layout)
    if not none.offset.size:
        return none
    bands = fitted_bands(x, vectors, layout, data)
    edges = [
        _at_edge(edge, x, vectors, frame, layout, data)
        for band, lanes in zip(bands, data.lanes, strict=True)
        if band is not None
        for edge in _edges(band, np.asarray(lanes.run))
    ]
    return Squeeze(*(jnp.asarray(np.stack(part)) for part in zip(*edges, strict=True)))


class _Edge(NamedTuple):
    """How far a run's start lies beyond an edge, in the frame's x."""

    run: int
    sign: float
    """1 of a lower edge, -1 of an upper one."""
    middle: float
    slope: Float[np.ndarray, " x"]


def _edges(band: DeadBand, runs: Int[np.ndarray, " lane"]) -> list[_Edge]:
    start, low, high = (Line(*(np.asarray(part)[:, 0] for part in line)) for line in band)
    return [
        _Edge(int(run), sign, sign * (line.middle[lane] - start.middle[lane]), sign * away[lane])
        for line, sign in ((low, 1.0), (high, -1.0))
        for away in (line.slope - start.slope,)
        for lane, run in enumerate(runs)
    ]


def _at_edge(
    edge: _Edge,
    x: Float[np.ndarray, "point x"],
    vectors: Float[np.ndarray, "point n"],
    frame: Frame,
    layout: Layout,
    data: Data,
) -> Squeeze:
    count, size = frame.smooth.size, frame.centre.size
    slope, direction = np.zeros(size), np.zeros(size)
    one = np.ones(())
    asis = Squeeze(np.zeros(()), slope, direction, one, one, one)
    beyond = edge.middle + x @ edge.slope
    if not abs(beyond.mean()) < NEAR * beyond.std():
        return asis
    spread = float(np.asarray(data.priors[START].scale)[edge.run])
    place = starts(layout)[START] + edge.run
    central = np.argmin((x**2).sum(axis=1))

    def rise(depth: float) -> float:
        """Of the negative log density, from the edge to a start so far inside."""
        moved = np.tile(vectors[central], (2, 1))
        moved[:, place] += edge.sign * (beyond[central] + np.array([0.0, depth]))
        at_edge, inside = (potential_at(jnp.asarray(one), layout, data) for one in moved)
        return inside - at_edge

    told = [depth for depth in DEPTHS if rise(depth * spread) > 0.5]
    slope[frame.smooth] = np.linalg.solve(frame.factor.T, edge.slope[:count])
    slope[frame.walled] = edge.slope[count:]
    if not told or abs(slope[place]) < LEAST_SLOPE:
        return asis._replace(slope=np.zeros(size))
    direction[place] = 1.0 / slope[place]
    ratio = np.asarray(told[0])
    return Squeeze(
        offset=edge.middle - slope @ frame.centre,
        slope=slope,
        direction=direction,
        ratio=ratio,
        width=np.asarray(BLUNT * spread),
        scale=ratio if np.median(beyond) < 0.0 else one,
    )
