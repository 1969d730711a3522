"""Pieces of the density as compiled programs: of value-only ones a single one simulates."""

from typing import NamedTuple

import jax
from jaxtyping import Array, Float

from muscle_bayes.inference.model.density import (
    LaneFit,
    constrain,
    explained,
    potential_given,
    unconstrain,
)
from muscle_bayes.inference.model.lane_model import LanePrediction, predictions, responses, zeros_of
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.running.program import program
from muscle_bayes.physics.response import Response


class Solved(NamedTuple):
    """What the model says at one point."""

    predicted: list[LanePrediction]
    responses: list[Response]
    """`averaged` in the log's unit."""


@program
def solved_at(vector: Float[Array, " n"], layout: Layout, data: Data) -> Solved:
    """Responses of every lane at an unconstrained vector, and the predictions they are."""
    values = constrain(vector, layout, data)
    found = responses(values, layout, data)
    groups = zip(found, data.lanes, layout.regimes, layout.segmented, strict=True)
    predicted = [
        LanePrediction(
            one.averaged - zeros_of(values, lanes, regime, cut)[:, None], None, one.finite * 1.0
        )
        for one, lanes, regime, cut in groups
    ]
    return Solved(predicted, found)


@program
def _segments_at(vector: Float[Array, " n"], layout: Layout, data: Data) -> list[LanePrediction]:
    return predictions(constrain(vector, layout, data), layout, data)


def predictions_at(vector: Float[Array, " n"], layout: Layout, data: Data) -> list[LanePrediction]:
    """Predictions of every lane at an unconstrained vector."""
    if any(layout.segmented):
        return _segments_at(vector, layout, data)
    return solved_at(vector, layout, data).predicted


@program
def constrained_at(vector: Float[Array, " n"], layout: Layout, data: Data) -> dict[str, Array]:
    """Sampled values of an unconstrained vector."""
    return constrain(vector, layout, data)


@program
def constrained(vectors: Float[Array, "draw n"], layout: Layout, data: Data) -> dict[str, Array]:
    """Sampled values of unconstrained vectors."""
    return jax.vmap(lambda vector: constrain(vector, layout, data))(vectors)


@program
def unconstrained(draws: dict[str, Array], layout: Layout, data: Data) -> Float[Array, "draw n"]:
    """Unconstrained vectors of draws of sampled values."""
    return jax.vmap(lambda values: unconstrain(values, layout, data))(draws)


potential_with = program(potential_given)


@program
def fits_with(
    predicted: list[LanePrediction], vector: Float[Array, " n"], layout: Layout, data: Data
) -> list[LaneFit]:
    """How predictions made at the vector explain the readings."""
    return explained(predicted, constrain(vector, layout, data), layout, data)


def potential_at(vector: Float[Array, " n"], layout: Layout, data: Data) -> float:
    """Negative log posterior density of the unconstrained vector."""
    return float(potential_with(predictions_at(vector, layout, data), vector, layout, data))
