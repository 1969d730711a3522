"""A posterior as the plain numbers that a machine or a table wants."""

import json
from typing import Any

import arviz as az
import numpy as np

from muscle_bayes.inference.model.reduction import ReductionError
from muscle_bayes.inference.posteriors.explained import unexplained
from muscle_bayes.inference.posteriors.identifiability import only_ratios
from muscle_bayes.inference.posteriors.posterior import Posterior


def summarise(posterior: Posterior) -> dict[str, Any]:
    """Parameters with unit, mean, sd, 5 and 95 % quantiles, R-hat and bulk ESS; and how each run fits.

    `rmse` is that of the mean model in the run's own `unit`; `coverage90` the share of readings
    inside the central 90 % of the predictive draws. `inertia` of a slow run says by how much its
    readings would change without the rotor's inertia, and whether it was kept for that. `unexplained`
    says why the model does not explain its runs; `explained` is whether it does. `only_ratios` names
    parameters of which no more than their ratios are identified.
    """
    group = posterior.tree["posterior"].to_dataset()
    chosen = group[list(posterior.parameters)]
    rhat, ess = az.rhat(chosen), az.ess(chosen)
    parameters = {}
    for name in posterior.parameters:
        values = chosen[name].to_numpy()
        low, high = np.quantile(values, [0.05, 0.95])
        parameters[name] = {
            "unit": posterior.units[name],
            "mean": float(values.mean()),
            "sd": float(values.std(ddof=1)),
            "q05": float(low),
            "q95": float(high),
            "rhat": float(rhat[name]),
            "ess_bulk": float(ess[name]),
        }
    return {
        "parameters": parameters,
        "converged": posterior.converged,
        "complaints": list(posterior.complaints),
        "explained": not (reasons := unexplained(posterior)),
        "unexplained": reasons,
        "only_ratios": only_ratios(posterior),
        "friction": posterior.friction,
        "effects": list(posterior.effects),
        "runs": _fitted_runs(posterior),
        "seed": int(posterior.tree.attrs["seed"]),
        "seconds": json.loads(posterior.tree.attrs["seconds"]),
        "versions": json.loads(posterior.tree.attrs["versions"]),
        "checksums": json.loads(posterior.tree.attrs["runs"]),
    }


def _fitted_runs(posterior: Posterior) -> dict[str, Any]:
    tree = posterior.tree
    reduction = json.loads(tree.attrs["reduction"])
    result: dict[str, Any] = {}
    for key, observed in tree["observed_data"].data_vars.items():
        name = str(key)
        reading = tree["posterior_predictive"][name].to_numpy()[0]
        low, high = np.quantile(reading, [0.05, 0.95], axis=0)
        seen = observed.to_numpy()
        model = tree["posterior_predictive"][f"{name}:model"].to_numpy()[0].mean(axis=0)
        result[name] = {
            "rmse": float(np.sqrt(np.mean((seen - model) ** 2))),
            "unit": observed.attrs["units"],
            "coverage90": float(np.mean((seen >= low) & (seen <= high))),
        }
        if (error := reduction.get(name)) is not None:
            kept = not ReductionError(**error).tolerable
            result[name]["inertia"] = {"kept": kept, **error}
    return result
