"""Axes along which searches and samplers see a damper law beside eq. 17."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro import distributions as dist
from numpyro.distributions import biject_to
from numpyro.distributions.transforms import ExpTransform, SigmoidTransform

from muscle_bayes.inference.model.lane_model import frame_of
from muscle_bayes.inference.model.problem import Data, Layout
from muscle_bayes.inference.records.parts import HEATERS
from muscle_bayes.physics.effects.muscle.damper_law import KELVIN, REFERENCE, DamperLaw

LEVEL = 0.5
"""`softening` at which these axes are those of the sites themselves [-]."""
KEPT = 0.5 - 0.5 * np.cos(np.pi * np.array([1.0, 3.0, 5.0]) / 6.0)
"""Places between the muscle's cold and hot state where the damper is kept: Chebyshev's nodes [-]."""
EDGE = 0.01
"""Within which of its ends the axis of `softening` turns from linear to logarithmic [-]."""
SOFTENING, TIME = "softening", "time_constant"
LAW = tuple(f"{DamperLaw.name}.{key}" for key in DamperLaw.parameters)


def from_axes(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, " n"]:
    """The unconstrained values of all sites from their places along the axes.

    What eq. 17 and a law say of the damper together is one curve of temperature: their parameters pay for
    one another along a bent valley, in which neither least squares nor a normal proposal gets far. So a
    step along the axis of `softening` keeps the damper at three temperatures: time constant and law move
    with it. What else the step does to the damper grows nearly as (1 - softening)^3, so this is the axis.
    Without such a law, or with priors of another kind than theirs, the axes are the sites' own.
    """
    names = _names(layout)
    if not _applies(names, data):
        return vector
    return _sheared(_with_softening(vector, names, _logit_of), names, data, 1.0)


def to_axes(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, " n"]:
    """The inverse of `from_axes`."""
    names = _names(layout)
    if not _applies(names, data):
        return vector
    return _with_softening(_sheared(vector, names, data, -1.0), names, _place_of)


def log_volume(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, ""]:
    """ln |det| of the slopes of `from_axes`."""
    names = _names(layout)
    if not _applies(names, data):
        return jnp.zeros(())
    return jnp.log(-jax.grad(_logit_of)(vector[names.index(SOFTENING)]))


def _names(layout: Layout) -> list[str]:
    """Site of each entry."""
    return [name for name, shape in layout.shapes for _ in range(int(np.prod(shape)))]


def _applies(names: list[str], data: Data) -> bool:
    """Whether there is a damper law, all with priors of the usual supports."""
    if not {SOFTENING, TIME, *LAW} <= set(names):
        return False
    ways = [biject_to(data.priors[name].support) for name in (SOFTENING, TIME)]
    kinds = zip(ways, (SigmoidTransform, ExpTransform), strict=True)
    straight = all(isinstance(data.priors[name], dist.Normal) for name in LAW)
    return straight and all(isinstance(way, kind) for way, kind in kinds)


def _with_softening(vector: Array, names: list[str], change: Callable[[Array], Array]) -> Array:
    here = np.array(names) == SOFTENING
    return jnp.where(here, change(vector[names.index(SOFTENING)]), vector)


def _logit_of(place: Array) -> Array:
    """Log odds of a softening whose (1 - softening)^3 is clipped smoothly from its place on the axis."""
    log_cube, log_rest = _log_clipped(place), _log_clipped(1.0 - place)
    root = jnp.exp(log_cube / 3.0)
    return log_rest - jnp.log(1.0 + root + root**2) - log_cube / 3.0


def _place_of(logit: Array) -> Array:
    """Inverse of `_logit_of`."""
    root, softening = jax.nn.sigmoid(-logit), jax.nn.sigmoid(logit)
    rest = softening * (1.0 + root + root**2)
    return EDGE * (jnp.log(jnp.expm1(root**3 / EDGE)) - jnp.log(-jnp.expm1(-rest / EDGE)))


def _log_clipped(place: Array) -> Array:
    """ln of a place that is clipped smoothly to (0, 1), of E ln((1 + e^(x/E)) / (1 + e^((x - 1)/E)))."""
    far, near = place / EDGE, jnp.maximum(place / EDGE, -30.0)
    part = jax.nn.softplus(near) - jax.nn.softplus(near - 1.0 / EDGE)
    return jnp.log(EDGE) + jnp.where(far < near, far, jnp.log(part))


def _sheared(vector: Array, names: list[str], data: Data, sign: float) -> Array:
    moved = (TIME, *LAW)
    ways = {name: biject_to(data.priors[name].support) for name in names}
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
