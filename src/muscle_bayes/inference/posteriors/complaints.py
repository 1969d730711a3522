"""Why draws are not to be used, in a few sentences."""

import arviz as az
import numpy as np
import xarray as xr

from muscle_bayes.inference.sampling.sampler import MAX_RHAT

SEVERAL_MODES = 1.2
"""R-hat from which on chains are shown one by one: longer ones would hardly agree."""
SHOWN = 3
"""Most parameters that a sentence names."""


def complaints_of(sampled: xr.Dataset, divergences: int, min_ess: int) -> list[str]:
    """Why the draws are not to be used: one sentence a reason, the worst parameters first.

    Args:
        sampled: what was sampled, by chain and draw.
        divergences: how many transitions diverged.
        min_ess: least effective sample size (bulk) of each quantity.
    """
    worst, least = az.rhat(sampled).max(), az.ess(sampled).min()
    apart = {name: float(worst[name]) for name in sampled.data_vars if worst[name] > MAX_RHAT}
    few = {name: float(least[name]) for name in sampled.data_vars if least[name] < min_ess}
    found = []
    if divergences:
        found.append(f"{divergences} divergent transitions")
    if apart:
        order = sorted(apart, key=apart.__getitem__, reverse=True)
        shown = _listed([f"{name} {apart[name]:.3f}" for name in order])
        found.append(f"R-hat is over {MAX_RHAT}: {shown}")
        several = [name for name in order if apart[name] > SEVERAL_MODES][:SHOWN]
        found += [f"chains disagree{where_chains_are(sampled[name])}" for name in several]
    if few:
        order = sorted(few, key=few.__getitem__)
        shown = _listed([f"{name} {few[name]:.0f}" for name in order])
        found.append(f"bulk ESS is below {min_ess}: {shown}")
    return found


def _listed(items: list[str]) -> str:
    """The first few of them, and how many more there are."""
    more = len(items) - SHOWN
    return ", ".join(items[:SHOWN]) + (f" and {more} more" if more > 0 else "")


def where_chains_are(quantity: xr.DataArray) -> str:
    """Where each chain is, of a quantity on which they disagree."""
    means = np.asarray(quantity.mean("draw"))
    if means.ndim > 1:
        means = means.reshape(len(means), -1)
        means = means[:, np.argmax(means.std(axis=0))]
    shown = ", ".join(f"{mean:.3g}" for mean in np.sort(means))
    unit = quantity.attrs.get("units", "1")
    told = shown if unit in ("", "1") else f"{shown} {unit}"
    return f" on {quantity.name}, the posterior may have several modes (means: {told})"
