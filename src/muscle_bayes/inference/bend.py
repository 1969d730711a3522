"""Coordinates in which a curved posterior is nearly straight, for the sampler alone."""

from jaxtyping import Array, Float

from muscle_bayes.inference.bend_friction import FrictionScale, bent_friction, unbent_friction
from muscle_bayes.inference.bend_hyst import Unbent, bent_hyst, unbent_hyst
from muscle_bayes.inference.bend_walls import bent_walls, unbent_walls
from muscle_bayes.inference.problem import Data, Layout


def unbent_smooth(
    bent: Float[Array, " n"], scale: FrictionScale, layout: Layout, data: Data
) -> Unbent:
    """The unconstrained vector from bent coordinates of the smooth entries; the others stay."""
    loose, friction_volume = unbent_friction(bent, scale, layout, data)
    vector, hyst_volume = unbent_hyst(loose, layout, data)
    return Unbent(vector, friction_volume + hyst_volume)


def unbent(bent: Float[Array, " n"], scale: FrictionScale, layout: Layout, data: Data) -> Unbent:
    """The unconstrained vector from bent coordinates."""
    smooth, volume = unbent_smooth(bent, scale, layout, data)
    vector, walls_volume = unbent_walls(smooth, layout, data)
    return Unbent(vector, volume + walls_volume)


def bent(
    vector: Float[Array, " n"], scale: FrictionScale, layout: Layout, data: Data
) -> Float[Array, " n"]:
    """Inverse of `unbent`."""
    still = bent_hyst(bent_walls(vector, layout, data), layout, data)
    return bent_friction(still, scale, layout, data)
