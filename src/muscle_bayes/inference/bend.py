"""Coordinates in which a curved posterior is nearly straight, for the sampler alone."""

from typing import NamedTuple

from jaxtyping import Array, Float

from muscle_bayes.inference.bend_friction import FrictionScale, bent_friction, unbent_friction
from muscle_bayes.inference.bend_hyst import Unbent, bent_hyst, unbent_hyst
from muscle_bayes.inference.bend_sizes import Sizes, bent_sizes, unbent_sizes
from muscle_bayes.inference.bend_stiffness import bent_stiffness, unbent_stiffness
from muscle_bayes.inference.bend_walls import bent_walls, unbent_walls
from muscle_bayes.inference.problem import Data, Layout


class Bend(NamedTuple):
    """What fixes the coordinates of a fit."""

    friction: FrictionScale
    sizes: Sizes


def unbent(bent: Float[Array, " n"], bend: Bend, layout: Layout, data: Data) -> Unbent:
    """The unconstrained vector from bent coordinates."""
    logs, sizes_volume = unbent_sizes(bent, bend.sizes, layout)
    crept, hyst_volume = unbent_hyst(logs, layout, data)
    stiff, stiffness_volume = unbent_stiffness(crept, layout, data)
    smooth, friction_volume = unbent_friction(stiff, bend.friction, layout, data)
    vector, walls_volume = unbent_walls(smooth, layout, data)
    volume = sizes_volume + hyst_volume + stiffness_volume + friction_volume + walls_volume
    return Unbent(vector, volume)


def bent(vector: Float[Array, " n"], bend: Bend, layout: Layout, data: Data) -> Float[Array, " n"]:
    """Inverse of `unbent`."""
    loose = bent_friction(bent_walls(vector, layout, data), bend.friction, layout, data)
    logs = bent_hyst(bent_stiffness(loose, layout, data), layout, data)
    return bent_sizes(logs, bend.sizes, layout)
