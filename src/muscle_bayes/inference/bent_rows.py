"""Bent coordinates of many points, by programs that any number of points share."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.inference.bend import Bend, bent, unbent
from muscle_bayes.inference.bend_friction import log_reference
from muscle_bayes.inference.bend_hyst import bent_hyst
from muscle_bayes.inference.bend_stiffness import bent_stiffness
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.program import Program
from muscle_bayes.inference.row_blocks import in_blocks


@Program
def _bent(
    vectors: Float[Array, "row n"], bend: Bend, layout: Layout, data: Data
) -> Float[Array, "row n"]:
    return jax.vmap(lambda vector: bent(vector, bend, layout, data))(vectors)


@Program
def _unbent(
    rows: Float[Array, "row 2n"], bend: Bend, layout: Layout, data: Data
) -> Float[Array, "row 2n"]:
    """Points followed by directions, to vectors followed by their derivatives."""

    def vector_at(point: Array) -> Array:
        return unbent(point, bend, layout, data).vector

    def one(row: Array) -> Array:
        point, direction = jnp.split(row, 2)
        return jnp.concatenate(jax.jvp(vector_at, (point,), (direction,)))

    return jax.vmap(one)(rows)


@Program
def _unscaled(
    vectors: Float[Array, "row n"], layout: Layout, data: Data
) -> Float[Array, "row 1+n"]:
    def one(vector: Array) -> Array:
        logs = bent_hyst(bent_stiffness(vector, layout, data), layout, data)
        return jnp.concatenate([log_reference(vector, layout, data)[None], logs])

    return jax.vmap(one)(vectors)


def bent_rows(
    vectors: Float[np.ndarray, "row n"], bend: Bend, layout: Layout, data: Data
) -> Float[np.ndarray, "row n"]:
    """Bent coordinates of unconstrained vectors."""
    return in_blocks(_bent, vectors, bend, layout, data)


def unbent_rows(
    points: Float[np.ndarray, "row n"], bend: Bend, layout: Layout, data: Data
) -> Float[np.ndarray, "row n"]:
    """Unconstrained vectors at bent coordinates."""
    rows = np.hstack([points, np.zeros_like(points)])
    return in_blocks(_unbent, rows, bend, layout, data)[:, : points.shape[1]]


def turn_at(
    point: Float[np.ndarray, " n"], bend: Bend, layout: Layout, data: Data
) -> Float[np.ndarray, "n n"]:
    """Derivative of the unconstrained vector in bent coordinates."""
    rows = np.hstack([np.tile(point, (point.size, 1)), np.eye(point.size)])
    return in_blocks(_unbent, rows, bend, layout, data)[:, point.size :].T


class Unscaled(NamedTuple):
    """What scales of bent coordinates are told from."""

    log_reference: Float[np.ndarray, " row"]
    """Of friction."""
    logs: Float[np.ndarray, "row n"]
    """Coordinates in which sizes are still logarithms."""


def unscaled_rows(vectors: Float[np.ndarray, "row n"], layout: Layout, data: Data) -> Unscaled:
    """Of unconstrained vectors, what scales are told from."""
    found = in_blocks(_unscaled, vectors, layout, data)
    return Unscaled(found[:, 0], found[:, 1:])
