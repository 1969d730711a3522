"""Normal priors of parameters in any unit, searched and sampled in units of their own width."""

import jax.numpy as jnp
from jax.typing import ArrayLike
from numpyro import distributions as dist
from numpyro.distributions import biject_to, constraints
from numpyro.distributions.transforms import AffineTransform


class _RealInUnits(constraints.Constraint):
    """Any real number, which is told in units of `scale` where nothing constrains it."""

    def __init__(self, scale: ArrayLike) -> None:
        self.scale = scale

    def __call__(self, x: ArrayLike) -> ArrayLike:
        return jnp.isfinite(x)

    def feasible_like(self, prototype: ArrayLike) -> ArrayLike:
        return jnp.zeros_like(prototype)

    def tree_flatten(self):
        return (self.scale,), (("scale",), {})

    def eq(self, other: object, static: bool = False) -> ArrayLike:
        if not isinstance(other, _RealInUnits):
            return False
        return jnp.array_equal(jnp.asarray(self.scale), jnp.asarray(other.scale))


@biject_to.register(_RealInUnits)
def _in_units(constraint: _RealInUnits) -> AffineTransform:
    return AffineTransform(0.0, constraint.scale)


class StandardisedNormal(dist.Normal):
    """N(loc, scale^2) whose unconstrained coordinate is value / scale.

    Searches and samplers take an unconstrained coordinate's unit for about the width of its prior. A
    plain normal's is the value itself: steps of at most 2 K would never reach 1,500 K.
    """

    @constraints.dependent_property(is_discrete=False, event_dim=0)
    def support(self) -> constraints.Constraint:
        return _RealInUnits(self.scale)


def standardised(prior: dist.Distribution) -> dist.Distribution:
    """`prior`, told in its own standard deviations if it is a plain normal; else itself."""
    return StandardisedNormal(prior.loc, prior.scale) if type(prior) is dist.Normal else prior
