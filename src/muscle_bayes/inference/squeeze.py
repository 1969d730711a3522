"""Coordinates of runs that begin at an edge of their dead band, for the sampler alone.

Inside its dead band a rotor stays where it began, and readings tell its start well; beyond an edge it
slides there at once, and only the log's first reading tells its start. Where the posterior has both, it
falls steeply on one side. So the start's distance v beyond the edge is measured by t instead,
v = (1 + r) / 2 t + (1 - r) / 2 sqrt(t^2 + w^2): v = t far beyond, v = r t far inside, r the ratio of
the start's standard deviations inside and beyond. Edges are taken for linear in bent coordinates; the
change of variables is exact whether they are or not.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.dead_bands import START
from muscle_bayes.inference.problem import Layout


class Squeeze(NamedTuple):
    """Per edge; v = offset + slope @ x in bent coordinates x, slope @ direction = 1."""

    offset: Float[Array, " edge"]
    slope: Float[Array, "edge n"]
    direction: Float[Array, "edge n"]
    """Of the start alone."""
    ratio: Float[Array, " edge"]
    width: Float[Array, " edge"]
    """w."""
    scale: Float[Array, " edge"]
    """Of t: 1, or the ratio where the whitening is that of a start inside."""

    @classmethod
    def none(cls, layout: Layout) -> "Squeeze":
        """Of the layout's shapes, as coordinates are."""
        edges = 2 * dict(layout.shapes).get(START, (0,))[0]
        size = sum(int(np.prod(shape)) for _, shape in layout.shapes)
        nothing, one = jnp.zeros((edges, size)), jnp.ones(edges)
        return cls(jnp.zeros(edges), nothing, nothing, one, one, one)


class Unsqueezed(NamedTuple):
    """Bent coordinates."""

    bent: Float[Array, "*point n"]
    log_volume: Float[Array, "*point"]
    """Log determinant of their derivative in the squeezed ones."""


def unsqueezed(y: Float[Array, "*point n"], squeeze: Squeeze) -> Unsqueezed:
    """Bent coordinates from squeezed ones."""
    log_volume = jnp.zeros(y.shape[:-1])
    for edge in range(squeeze.offset.size):
        ratio, width, scale = squeeze.ratio[edge], squeeze.width[edge], squeeze.scale[edge]
        t = squeeze.offset[edge] + y @ squeeze.slope[edge]
        root = jnp.sqrt((t / scale) ** 2 + width**2)
        v = 0.5 * ((1.0 + ratio) * t / scale + (1.0 - ratio) * root)
        rate = 0.5 * (1.0 + ratio + (1.0 - ratio) * t / scale / root) / scale
        y = y + (v - t)[..., None] * squeeze.direction[edge]
        log_volume = log_volume + jnp.log(rate)
    return Unsqueezed(y, log_volume)


def squeezed(x: Float[Array, "*point n"], squeeze: Squeeze) -> Float[Array, "*point n"]:
    """Inverse of `unsqueezed`."""
    for edge in reversed(range(squeeze.offset.size)):
        ratio, width, scale = squeeze.ratio[edge], squeeze.width[edge], squeeze.scale[edge]
        v = squeeze.offset[edge] + x @ squeeze.slope[edge]
        root = jnp.sqrt(v**2 + ratio * width**2)
        t = scale * 0.5 * ((1.0 + ratio) * v - (1.0 - ratio) * root) / ratio
        x = x + (t - v)[..., None] * squeeze.direction[edge]
    return x
