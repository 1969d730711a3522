"""Pieces of the density as compiled programs: only one of them simulates, so it is compiled once."""

from jaxtyping import Array, Float

from muscle_bayes.inference.density import LaneFit, constrain, explained, potential_given
from muscle_bayes.inference.lane_model import LanePrediction, predictions
from muscle_bayes.inference.problem import Data, Layout
from muscle_bayes.inference.program import Program


@Program
def predictions_at(vector: Float[Array, " n"], layout: Layout, data: Data) -> list[LanePrediction]:
    """Predictions of every lane at an unconstrained vector."""
    return predictions(constrain(vector, layout, data), layout, data)


potential_with = Program(potential_given)


@Program
def fits_with(
    predicted: list[LanePrediction], vector: Float[Array, " n"], layout: Layout, data: Data
) -> list[LaneFit]:
    """How predictions made at the vector explain the readings."""
    return explained(predicted, constrain(vector, layout, data), layout, data)


def potential_at(vector: Float[Array, " n"], layout: Layout, data: Data) -> float:
    """Negative log posterior density of the unconstrained vector."""
    return float(potential_with(predictions_at(vector, layout, data), vector, layout, data))
