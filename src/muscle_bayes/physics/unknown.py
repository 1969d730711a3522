"""Parts of a rig whose parameters are stated, or estimated."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import ClassVar, Self

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Scales
from muscle_bayes.physics.linkage import Scalar

UNKNOWN = float("nan")
"""Value of a parameter that is to be estimated."""


@dataclasses.dataclass(frozen=True)
class Unknown:
    """What is known beforehand of a part's parameter that is not stated."""

    unit: str
    prior: Callable[[Scales], dist.Distribution]
    meaning: str


class Part(eqx.Module):
    """A part of a rig: an element, or what drives it.

    `unknowns` says of each field that may be estimated what is known of it beforehand. A field that
    is NaN is estimated, another is as stated.
    """

    unknowns: ClassVar[Mapping[str, Unknown]] = {}

    def estimated(self) -> tuple[str, ...]:
        """Names of the fields that are to be estimated, in the order of `unknowns`."""
        return tuple(key for key in self.unknowns if is_unknown(getattr(self, key)))

    def filled(self, values: Mapping[str, Scalar]) -> Self:
        """The part with these values wherever it states none; under JAX, too."""
        fields = {
            key: jnp.where(jnp.isnan(was := getattr(self, key)), values[key], was) for key in values
        }
        return dataclasses.replace(self, **fields)


def is_unknown(value: Scalar | float) -> bool:
    """Whether a parameter is to be estimated."""
    return bool(np.isnan(np.asarray(value)))
