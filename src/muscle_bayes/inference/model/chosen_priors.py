"""Priors that a user chose, in place of the default ones."""

from collections.abc import Mapping
from difflib import get_close_matches

import jax.numpy as jnp
from numpyro import distributions as dist

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.muscle_prior import TAUT_FORCE, UNITS, replaced_by
from muscle_bayes.inference.model.site import Site


def with_priors(
    sites: Mapping[str, Site], priors: Mapping[str, dist.Distribution]
) -> dict[str, Site]:
    """The sampled quantities with these priors.

    Args:
        sites: the default ones, by name.
        priors: by the name of a sampled quantity, or of a parameter of Table 2. That is sampled in
            place of the quantity that it determines. A scalar prior serves every run.

    Raises:
        MuscleBayesError: for a name that these runs do not have, for what is no continuous distribution,
            and for a shape or negative values that do not fit.
    """
    if not isinstance(priors, Mapping):
        raise MuscleBayesError(
            f"priors must be a dictionary, not {priors!r}. Fix: give {{'J': LogNormal(-5.8, 0.1)}}."
        )
    places = replaced_by(priors) if "contraction" in sites else {}
    known = {*sites, *(UNITS if "contraction" in sites else ())}
    chosen = dict(sites)
    for name, prior in priors.items():
        if name not in known:
            near = get_close_matches(name, known, 3, 0.4) or sorted(known)
            raise MuscleBayesError(
                f"these runs have no parameter '{name}' that could be given a prior. "
                f"Fix: name one of theirs, such as {', '.join(near)}"
            )
        if not isinstance(prior, dist.Distribution):
            raise MuscleBayesError(
                f"the prior of '{name}' is {prior!r}, not a distribution. "
                "Fix: give a NumPyro distribution, such as LogNormal(-5.8, 0.1)."
            )
        if prior.is_discrete:
            raise MuscleBayesError(
                f"the prior of '{name}' is discrete. Fix: give a continuous one, such as LogNormal."
            )
        if name in sites:
            if _is_negative(prior) and not _is_negative(sites[name].prior):
                raise MuscleBayesError(
                    f"the prior of '{name}' allows negative values. "
                    "Fix: give one on positive numbers, such as LogNormal."
                )
            shape = tuple(sites[name].prior.shape())
            chosen[name] = sites[name]._replace(prior=_of_shape(name, prior, shape))
        else:
            place = places[name] if places[name] in chosen else TAUT_FORCE
            replaced = chosen.pop(place)
            meaning = f"Table 2, in place of {place}"
            chosen[name] = replaced._replace(
                prior=_of_shape(name, prior, ()), unit=UNITS[name], meaning=meaning
            )
    return chosen


def _is_negative(prior: dist.Distribution) -> bool:
    """Whether a prior allows values below zero."""
    return bool(jnp.any(prior.support(jnp.full(prior.shape(), -1e-12))))


def _of_shape(name: str, prior: dist.Distribution, shape: tuple[int, ...]) -> dist.Distribution:
    """The prior of every one of some values."""
    if tuple(prior.shape()) == shape:
        return prior
    if prior.shape():
        raise MuscleBayesError(
            f"the prior of '{name}' has shape {tuple(prior.shape())}, wanted is {shape}. "
            "Fix: give a scalar prior, or one value a run"
        )
    parameters = {key: getattr(prior, key) for key in type(prior).arg_constraints}
    return type(prior)(**{key: jnp.broadcast_to(x, shape) for key, x in parameters.items()})
