"""Coordinates in which a curved posterior is nearly straight, for the sampler alone."""

from typing import NamedTuple

from jaxtyping import Array, Float

from muscle_bayes.inference.bend_friction import FrictionScale, bent_friction, unbent_friction
from muscle_bayes.inference.bend_hyst import Unbent, bent_hyst, unbent_hyst
from muscle_bayes.inference.bend_inertia import bent_inertia, unbent_inertia
from muscle_bayes.inference.bend_stiffness import bent_stiffness, unbent_stiffness
from muscle_bayes.inference.bend_walls import bent_walls, unbent_walls
from muscle_bayes.inference.problem import Data, Layout


class Bend(NamedTuple):
    """What fixes the coordinates of a fit."""

    friction: FrictionScale
    opened: Float[Array, ""]
    """1 where HYST is never shut by the strain it begins with."""
    inertia: Float[Array, ""]
    """Error with which J is known."""


def unbent_smooth(bent: Float[Array, " n"], bend: Bend, layout: Layout, data: Data) -> Unbent:
    """The unconstrained vector from bent coordinates of the smooth entries; the others stay."""
    crept, hyst_volume = unbent_hyst(bent, layout, data)
    stiff, stiffness_volume = unbent_stiffness(crept, bend.opened, layout, data)
    loose, friction_volume = unbent_friction(stiff, bend.friction, layout, data)
    vector, inertia_volume = unbent_inertia(loose, bend.inertia, layout)
    return Unbent(vector, hyst_volume + stiffness_volume + friction_volume + inertia_volume)


def unbent(bent: Float[Array, " n"], bend: Bend, layout: Layout, data: Data) -> Unbent:
    """The unconstrained vector from bent coordinates."""
    smooth, volume = unbent_smooth(bent, bend, layout, data)
    vector, walls_volume = unbent_walls(smooth, layout, data)
    return Unbent(vector, volume + walls_volume)


def bent(vector: Float[Array, " n"], bend: Bend, layout: Layout, data: Data) -> Float[Array, " n"]:
    """Inverse of `unbent`."""
    still = bent_walls(vector, layout, data)
    light = bent_inertia(still, bend.inertia, layout)
    loose = bent_friction(light, bend.friction, layout, data)
    return bent_hyst(bent_stiffness(loose, bend.opened, layout, data), layout, data)
