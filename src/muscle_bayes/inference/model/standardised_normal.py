"""Normal priors of parameters in any unit, searched and sampled in units of about their own width."""

import math
import sys
from functools import cache
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike
from numpyro import distributions as dist
from numpyro.distributions import biject_to, constraints
from numpyro.distributions.transforms import AffineTransform

_NAME = "StandardisedNormal1e"


class _RealInUnits(constraints.Constraint):
    """Any real number, which is told in units of `unit` where nothing constrains it."""

    def __init__(self, unit: float) -> None:
        self.unit = unit

    def __call__(self, x: ArrayLike) -> ArrayLike:
        return jnp.isfinite(x)

    def feasible_like(self, prototype: ArrayLike) -> ArrayLike:
        return jnp.zeros_like(prototype)

    def tree_flatten(self):
        return (), ((), {"unit": self.unit})

    def eq(self, other: object, static: bool = False) -> bool:
        return isinstance(other, _RealInUnits) and self.unit == other.unit


@biject_to.register(_RealInUnits)
def _in_units(constraint: _RealInUnits) -> AffineTransform:
    return AffineTransform(0.0, constraint.unit)


class StandardisedNormal(dist.Normal):
    """N(loc, scale^2) whose unconstrained coordinate is value / unit, a power of ten near `scale`.

    Searches and samplers take an unconstrained coordinate's unit for about the width of its prior. A
    plain normal's is the value itself: steps of at most 2 K would never reach 1,500 K. The unit belongs
    to the class and not to the data: a support is part of the code of compiled samplers.
    """

    unit: ClassVar[float] = 1.0

    @constraints.dependent_property(is_discrete=False, event_dim=0)
    def support(self) -> constraints.Constraint:
        return _RealInUnits(type(self).unit)


@cache
def _of_decade(exponent: int) -> type[StandardisedNormal]:
    """The class whose unit is this power of ten; a name of this module, so that it can be pickled."""
    name = f"{_NAME}{exponent}"
    kind = type(name, (StandardisedNormal,), {"unit": 10.0**exponent, "__module__": __name__})
    setattr(sys.modules[__name__], name, kind)
    return kind


def __getattr__(name: str) -> Any:
    if name.startswith(_NAME) and name.removeprefix(_NAME).removeprefix("-").isdigit():
        return _of_decade(int(name.removeprefix(_NAME)))
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def standardised(prior: dist.Distribution) -> dist.Distribution:
    """`prior`, told in units near its own standard deviation if it is a plain normal; else itself."""
    if type(prior) is not dist.Normal:
        return prior
    width = float(np.median(np.asarray(prior.scale)))
    return _of_decade(round(math.log10(width)))(prior.loc, prior.scale)
