"""Predictions and posteriors of which everything is known."""

import json

import numpy as np
import xarray as xr

from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.posteriors.predict import Prediction

SCALE = np.pi / 180.0 * 0.25
"""rad per count: a quarter of a degree."""


def gaussian(readings=2000, draws=400, noise=2.0, spread=None, bias=0.0, seed=0, **changes):
    """Readings around zero with Gaussian noise, predicted with `spread` and off by `bias`."""
    rng = np.random.default_rng(seed)
    spread = noise if spread is None else spread
    shape = (draws, readings)
    fields = {
        "run": "example",
        "unit": "counts",
        "time": np.linspace(0.0, 100.0, readings),
        "observed": bias + noise * rng.standard_normal(readings),
        "model": np.zeros(shape),
        "reading": spread * rng.standard_normal(shape),
        "hyst": np.zeros(shape),
        "temperature": np.full(readings, 25.0),
        "load": np.full(readings, 0.1),
        "scale": SCALE,
    }
    return Prediction(**(fields | changes))


def sawtooth(slope=2.0, predicted=1.5, noise=0.3, draws=300, seed=0):
    """Heated four times for 40 s, then cold for 160 s with a steady creep, counts/min."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 800.0, 2.0)
    within = time % 200.0
    temperature = np.where(within < 40.0, 85.0, 25.0) + 0.2 * rng.standard_normal(time.size)
    creep = np.where(within >= 40.0, (within - 40.0) / 60.0, 0.0)
    slopes = predicted + 0.05 * rng.standard_normal(draws)
    model = slopes[:, None] * creep
    return gaussian(
        time.size,
        draws,
        time=time,
        temperature=temperature,
        observed=slope * creep + noise * rng.standard_normal(time.size),
        model=model,
        reading=model + noise * rng.standard_normal(model.shape),
    )


def posterior_of(prior, after, log_likelihood=None, friction="coulomb", converged=True):
    """A posterior of scalar parameters with these draws, and log densities of one run."""

    def group(values):
        return xr.Dataset(
            {k: (("chain", "draw"), v[None], {"units": "N"}) for k, v in values.items()}
        )

    groups = {"posterior": group(after), "prior": group(prior)}
    if log_likelihood is not None:
        dims = ("chain", "draw", "a_interval")
        groups["log_likelihood"] = xr.Dataset({"a": (dims, log_likelihood[None])})
        time = np.arange(log_likelihood.shape[1]) * 0.1
        groups["constant_data"] = xr.Dataset({"a:time": ("a_interval", time)})
    tree = xr.DataTree.from_dict(groups)
    tree.attrs = {
        "friction": friction,
        "effects": "[]",
        "parameters": json.dumps(list(after)),
        "sampled": json.dumps(list(after)),
        "converged": int(converged),
        "complaints": json.dumps([] if converged else ["R-hat of D is 1.2"]),
        "origin": json.dumps(["synthetic"]),
    }
    return Posterior(tree)
