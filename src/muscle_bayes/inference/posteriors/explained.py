"""Whether a posterior's model explains the runs that it was fitted to."""

import json
from typing import NamedTuple

import numpy as np

from muscle_bayes.inference.posteriors.posterior import Posterior


class Limits(NamedTuple):
    """Beyond these a fit does not explain its data."""

    coverage: float = 0.7
    """Least share of readings inside the central 90 % of the predictive draws."""
    misfit: float = 0.1
    """Largest RMSE of the mean model, as a share of the readings' range."""
    noises: float = 3.0
    """RMSE, in standard deviations of one reading's noise, up to which its share does not count."""
    odds: float = 1e-3
    """Least share of the prior on either side of a parameter's posterior median."""


LIMITS = Limits()
NEVER_NOTHING = ("J", "rate", "moment", "gain")
"""Parameters that no rig has next to nothing of; friction, damping and offsets may well be 0."""


def unexplained(posterior: Posterior, limits: Limits = LIMITS) -> list[str]:
    """Why the model does not explain its runs; empty if it does.

    Args:
        posterior: with its predictive draws, data and prior.
        limits: beyond which it does not.

    Returns:
        A sentence for each run and each parameter that speaks against the model.

    Example:
        >>> import muscle_bayes as mb
        >>> from muscle_bayes.inference.posteriors.explained import unexplained
        >>> springs = mb.load_example("springs")
        >>> unexplained(mb.fit(springs, effort="quick", progress=False))
        []
    """
    found = json.loads(posterior.tree.attrs.get("contradictions", "[]"))
    for key in posterior.tree["observed_data"].data_vars:
        found += _of_run(posterior, str(key), limits)
    return found + [word for name in posterior.parameters for word in _of(posterior, name, limits)]


def _of_run(posterior: Posterior, name: str, limits: Limits) -> list[str]:
    predictive, observed = posterior.tree["posterior_predictive"], posterior.tree["observed_data"]
    seen, unit = observed[name].to_numpy(), observed[name].attrs["units"]
    reading = predictive[name].to_numpy()[0]
    low, high = np.quantile(reading, [0.05, 0.95], axis=0)
    inside = float(np.mean((seen >= low) & (seen <= high)))
    found = []
    if inside < limits.coverage:
        found.append(f"{name}: {inside:.0%} of the readings lie in the 90 % band")
    model = predictive[f"{name}:model"].to_numpy()[0].mean(axis=0)
    misfit, span = float(np.sqrt(np.mean((seen - model) ** 2))), float(np.ptp(seen))
    level = _noise(posterior, unit)
    if misfit > limits.misfit * span and misfit > limits.noises * level:
        found.append(f"{name}: the RMSE, {misfit:.3g} {unit}, is {misfit / span:.0%} of the range")
    return found


def _noise(posterior: Posterior, unit: str) -> float:
    """Noise of one reading in this unit, posterior mean; 0 where none was sampled."""
    sampled = posterior.tree["posterior"].data_vars.items()
    levels = [
        float(values.mean())
        for name, values in sampled
        if str(name).endswith(".noise") and values.attrs.get("units") == unit
    ]
    return max(levels, default=0.0)


def _of(posterior: Posterior, name: str, limits: Limits) -> list[str]:
    """Whether the readings drive a parameter to where its prior has next to nothing."""
    prior = posterior.tree["prior"]
    if name not in prior or prior[name].ndim > 2:
        return []
    middle = float(np.median(posterior.tree["posterior"][name].to_numpy()))
    known = prior[name].to_numpy().ravel()
    below = float(np.mean(known <= middle))
    vanishes = below <= limits.odds and name.rpartition(".")[2] in NEVER_NOTHING
    if not vanishes and below < 1.0 - limits.odds:
        return []
    side, edge = ("below", known.min()) if vanishes else ("above", known.max())
    unit = posterior.units.get(name, "")
    return [f"{name}: {middle:.3g} {unit} is {side} all that was plausible ({edge:.3g})"]
