"""Coordinates in which a curved posterior is nearly straight, for the sampler alone."""

from jaxtyping import Array, Float

from muscle_bayes.inference.bend_friction import FrictionScale, bent_friction, unbent_friction
from muscle_bayes.inference.bend_hyst import Unbent, bent_hyst, unbent_hyst
from muscle_bayes.inference.problem import Data, Layout


def unbent(bent: Float[Array, " n"], scale: FrictionScale, layout: Layout, data: Data) -> Unbent:
    """The unconstrained vector from bent coordinates."""
    loose, friction_volume = unbent_friction(bent, scale, layout, data)
    vector, hyst_volume = unbent_hyst(loose, layout, data)
    return Unbent(vector, friction_volume + hyst_volume)


def bent(
    vector: Float[Array, " n"], scale: FrictionScale, layout: Layout, data: Data
) -> Float[Array, " n"]:
    """Inverse of `unbent`."""
    return bent_friction(bent_hyst(vector, layout, data), scale, layout, data)
