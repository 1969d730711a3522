"""Priors by name, as data of a compiled program."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Int
from numpyro import distributions as dist

type Family = tuple[type[dist.Distribution], tuple[str, ...]]
"""A distribution's class and the names of its parameters."""
WHOLE = "whole"
"""Stands for the parameters of a distribution that is not made of such alone."""


def _is_made_of(prior: dist.Distribution, keys: tuple[str, ...]) -> bool:
    """Whether a distribution's class makes it from its parameters alone."""
    try:
        made = type(prior)(**{key: getattr(prior, key) for key in keys})
    except (AttributeError, TypeError):
        return False
    return bool(keys) and made.shape() == prior.shape()


@jax.tree_util.register_pytree_node_class
class Priors(Mapping[str, dist.Distribution]):
    """Distributions by name; their parameters are the leaves, in an order that is always the same.

    A NumPyro distribution is a pytree too, but orders its leaves by a set of strings: each process
    another way, so that programs compiled by an earlier one would not be recognised.
    """

    def __init__(self, priors: Mapping[str, dist.Distribution]) -> None:
        self._families: dict[str, Family] = {}
        self._parameters: dict[str, tuple[Any, ...]] = {}
        for name, prior in priors.items():
            keys = tuple(sorted(type(prior).arg_constraints))
            if _is_made_of(prior, keys):
                self._families[name] = type(prior), keys
                self._parameters[name] = tuple(getattr(prior, key) for key in keys)
            else:  # truncated, transformed: itself, apart from all others
                self._families[name] = type(prior), (WHOLE, name)
                self._parameters[name] = (prior,)

    def __getitem__(self, name: str) -> dist.Distribution:
        family, keys = self._families[name]
        if keys[:1] == (WHOLE,):
            return self._parameters[name][0]
        parameters = zip(keys, self._parameters[name], strict=True)
        return family(**dict(parameters), validate_args=False)

    def family(self, name: str) -> tuple[type[dist.Distribution], dict[str, Any]]:
        """Class and parameters of a distribution, which is not made."""
        kind, keys = self._families[name]
        if keys[:1] == (WHOLE,):
            return kind, {WHOLE: self._parameters[name][0]}
        return kind, dict(zip(keys, self._parameters[name], strict=True))

    def __iter__(self) -> Iterator[str]:
        return iter(self._families)

    def __len__(self) -> int:
        return len(self._families)

    def by_family(
        self, shapes: Sequence[tuple[str, tuple[int, ...]]]
    ) -> list[tuple[dist.Distribution, Int[np.ndarray, " entry"]]]:
        """Priors of one family as one distribution, with its entries in a vector of these quantities."""
        members: dict[Family, list[tuple[str, tuple[int, ...]]]] = {}
        for name, shape in shapes:
            members.setdefault(self._families[name], []).append((name, shape))
        sizes = [int(np.prod(shape)) for _, shape in shapes]
        begins = dict(zip((name for name, _ in shapes), np.cumsum([0, *sizes]), strict=False))

        def together(family: Family) -> tuple[dist.Distribution, np.ndarray]:
            entries = [
                begins[name] + np.arange(int(np.prod(shape))) for name, shape in members[family]
            ]
            kind, keys = family
            if keys[:1] == (WHOLE,):
                return self._parameters[keys[1]][0], np.concatenate(entries)
            columns = zip(*(self._parameters[name] for name, _ in members[family]), strict=True)
            whole = [
                jnp.concatenate(
                    [
                        jnp.broadcast_to(one, shape).ravel()
                        for one, (_, shape) in zip(column, members[family], strict=True)
                    ]
                )
                for column in columns
            ]
            prior = kind(**dict(zip(keys, whole, strict=True)), validate_args=False)
            return prior, np.concatenate(entries)

        return [together(family) for family in members]

    def tree_flatten(self) -> tuple[tuple[Any, ...], Any]:
        return tuple(self._parameters.values()), tuple(self._families.items())

    @classmethod
    def tree_unflatten(cls, families: Any, parameters: tuple[Any, ...]) -> "Priors":
        made = cls({})
        made._families = dict(families)
        made._parameters = dict(zip(made._families, parameters, strict=True))
        return made
