"""Axes along which searches and samplers see a damper law beside eq. 17."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro import distributions as dist
from numpyro.distributions import biject_to
from numpyro.distributions.transforms import ExpTransform

from muscle_bayes.inference.model.lane_model import frame_of
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.records.parts import HEATERS
from muscle_bayes.physics.effects.muscle.damper_law import KELVIN, REFERENCE, DamperLaw

LEVEL = 0.5
"""`softening` at which these axes are those of the sites themselves [-]."""
KEPT = 0.5 - 0.5 * np.cos(np.pi * np.array([1.0, 3.0, 5.0]) / 6.0)
"""Places between the muscle's cold and hot state where the damper is kept: Chebyshev's nodes [-]."""
SOFTENING, TIME = "softening", "time_constant"
LAW = tuple(f"{DamperLaw.name}.{key}" for key in DamperLaw.parameters)


def from_axes(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, " n"]:
    """The unconstrained values of all sites from their places along the axes.

    What eq. 17 and a law say of the damper together is one curve of temperature: their parameters pay for
    one another along a bent valley, in which neither least squares nor a normal proposal gets far. So a
    step along the axis of `softening` keeps the damper at three temperatures: time constant and law move
    with it. This shear leaves volumes as they are. Without such a law, or with priors of another kind
    than theirs, the axes are the sites' own.
    """
    return _sheared(vector, layout, data, 1.0)


def to_axes(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, " n"]:
    """The inverse of `from_axes`."""
    return _sheared(vector, layout, data, -1.0)


def _sheared(vector: Array, layout: Layout, data: Data, sign: float) -> Array:
    names = [name for name, shape in layout.shapes for _ in range(int(np.prod(shape)))]
    moved = (TIME, *LAW)
    if not {SOFTENING, *moved} <= set(names):
        return vector
    ways = {name: biject_to(data.priors[name].support) for name in names}
    straight = all(isinstance(data.priors[name], dist.Normal) for name in LAW)
    if not straight or not isinstance(ways[TIME], ExpTransform):
        return vector
    told = [name for name in names if name == SOFTENING or name.split(".")[0] in HEATERS]
    frame = frame_of({name: ways[name](vector[names.index(name)]) for name in told}, data)
    softening = ways[SOFTENING](vector[names.index(SOFTENING)])
    time, *law = _paid(softening, frame.cold, frame.hot)
    steps = (time, *(step / ways[name](1.0) for name, step in zip(LAW, law, strict=True)))
    for name, step in zip(moved, steps, strict=True):
        vector = vector + sign * step * (np.arange(len(names)) == names.index(name))
    return vector


def _paid(softening: Array, cold: Array | float, hot: Array | float) -> tuple[Array, Array, Array]:
    """Change of ln(time constant), theta and kappa [K] that keep the damper as `softening` leaves LEVEL.

    A parabola in z through what eq. 17's logarithm changes by, by divided differences.
    """
    zero = REFERENCE + KELVIN
    z = [1.0 - zero / (cold + part * (hot - cold) + KELVIN) for part in KEPT]
    change = [jnp.log((1.0 - (1.0 - softening) * u) / (1.0 - (1.0 - LEVEL) * u)) for u in KEPT]
    first = (change[1] - change[0]) / (z[1] - z[0])
    second = (change[2] - change[1]) / (z[2] - z[1])
    bend = (second - first) / (z[2] - z[0])
    slope = first - bend * (z[0] + z[1])
    return z[0] * (slope + bend * z[0]) - change[0], zero * slope, zero * bend
