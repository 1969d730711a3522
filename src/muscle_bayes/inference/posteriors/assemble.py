"""From draws of a problem to a posterior with everything that is asked of it later."""

import json
import platform
from importlib.metadata import version
from typing import Any

import jax
import numpy as np
import xarray as xr

from muscle_bayes.inference.model.lane_model import muscle_of, part_names, whole
from muscle_bayes.inference.model.muscle_prior import MUSCLE_PARAMETERS, UNITS, replaced_by
from muscle_bayes.inference.model.prior_draws import prior_draws
from muscle_bayes.inference.model.problem import Data, Problem
from muscle_bayes.inference.posteriors.complaints import complaints_of
from muscle_bayes.inference.posteriors.contradiction import contradiction
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.posteriors.predict import Prediction, predict, thin
from muscle_bayes.inference.running.program import program
from muscle_bayes.inference.running.programs import (
    constrained,
    fits_with,
    predictions_at,
    unconstrained,
)
from muscle_bayes.inference.sampling.draws import Draws
from muscle_bayes.provenance import LIBRARIES

STATISTICS = ("diverging", "n_steps", "acceptance_rate", "energy")
"""Of the sampler, by ArviZ's names."""
PREDICTIVE_DRAWS = 200
PRIOR_DRAWS = 1000


def _run_axis(problem: Problem, name: str) -> list[str]:
    return [f"{name.split('.')[0]}_run"] if problem.sites[name].prior.shape() else []


def values_of(drawn: Draws, problem: Problem) -> dict[str, Any]:
    """Sampled values of what chains drew, chain and draw axes leading."""
    chains, draws, size = drawn.vector.shape
    flat = constrained(drawn.vector.reshape(-1, size), problem.layout, problem.data)
    return {name: value.reshape(chains, draws, *value.shape[1:]) for name, value in flat.items()}


@program
def _table_2(values: dict[str, Any], data: Data) -> dict[str, Any]:
    muscle = muscle_of(values, data)
    if muscle is None:
        return {}
    sampled = whole(values, data)
    judged = {name: sampled[name] for name in replaced_by(UNITS).values()}
    return judged | {name: getattr(muscle, name) for name in MUSCLE_PARAMETERS}


def named_values(problem: Problem, values: dict[str, Any]) -> dict[str, Any]:
    """Sampled values together with all of the muscle's quantities and Table 2's parameters."""
    values = _table_2(values, problem.data) | dict(values)
    return {name: np.asarray(value) for name, value in values.items()}


def parameter_names(problem: Problem) -> list[str]:
    """The plant's parameters, then the effects', in the order of the thesis' tables."""
    sampled = [name for name, _ in problem.layout.shapes]
    names = [name for name in ("J", "D") if name in sampled]
    names += list(MUSCLE_PARAMETERS) if "F_modulus_min" in sampled else []
    names += part_names(problem.layout)
    return names + [name for name in sampled if name.split(".")[0] in problem.layout.effects]


def _dataset(problem: Problem, values: dict[str, np.ndarray], lead: list[str]) -> xr.Dataset:
    units = UNITS | {name: site.unit for name, site in problem.sites.items()}
    variables = {
        name: (
            lead + (_run_axis(problem, name) if name in problem.sites else []),
            value,
            {"units": units.get(name, "")},
        )
        for name, value in values.items()
    }
    coords: dict[str, Any] = {f"{key}_run": list(v) for key, v in problem.site_runs.items()}
    return xr.Dataset(variables, coords=coords)


def assemble(problem: Problem, drawn: Draws, min_ess: int, seed: int) -> Posterior:
    """The DataTree of a problem's draws: posterior, predictive, likelihood, prior, statistics, data."""
    layout, data = problem.layout, problem.data
    values = values_of(drawn, problem)
    posterior = _dataset(problem, named_values(problem, values), ["chain", "draw"])
    prior = prior_draws(jax.random.key(seed + 1), PRIOR_DRAWS, layout, data)
    prior = {name: value[None] for name, value in prior.items()}
    thinned = thin(values, PREDICTIVE_DRAWS)
    predictions = predict(problem, thinned, seed + 2)
    statistics = {name: drawn.statistics[name] for name in STATISTICS if name in drawn.statistics}
    statistics["lp"] = -drawn.statistics["potential"]
    sampled = posterior[[name for name, _ in layout.shapes]]
    complaints = complaints_of(sampled, drawn.divergences, min_ess)
    groups = {
        "posterior": posterior,
        "prior": _dataset(problem, named_values(problem, prior), ["chain", "draw"]),
        "sample_stats": xr.Dataset(
            {name: (["chain", "draw"], value) for name, value in statistics.items()}
        ),
        "posterior_predictive": xr.merge(
            [_per_run(predictions, "reading"), _labelled(predictions, "model")]
        ),
        "log_likelihood": _log_likelihood(problem, thinned),
        "observed_data": _per_run(predictions, "observed"),
        "constant_data": xr.merge(
            [_labelled(predictions, key) for key in ("time", "temperature", "load")]
        ),
    }
    tree = xr.DataTree.from_dict(groups)
    tree.attrs = {
        "friction": layout.friction,
        "effects": json.dumps(list(layout.effects)),
        "parameters": json.dumps(parameter_names(problem)),
        "sampled": json.dumps([name for name, _ in layout.shapes]),
        "converged": int(not complaints),
        "complaints": json.dumps(complaints),
        "seed": seed,
        "contradictions": json.dumps(
            [told for run in problem.runs if (told := contradiction(run))]
        ),
        "runs": json.dumps({run.name: run.checksum for run in problem.runs}),
        "base_length": float(data.base_length),
        "tension": float(data.tension),
        "reduction": json.dumps({run: e._asdict() for run, e in problem.reduction.items()}),
        "origin": json.dumps(sorted({run.metadata.origin for run in problem.runs})),
        "versions": json.dumps(
            {name: version(name) for name in LIBRARIES} | {"python": platform.python_version()}
        ),
    }
    return Posterior(tree)


def _per_run(predictions: list[Prediction], key: str) -> xr.Dataset:
    variables = {}
    for one in predictions:
        value = getattr(one, key)
        axis = f"{one.run}_interval"
        dims = [axis] if value.ndim == 1 else ["chain", "draw", axis]
        variables[one.run] = (dims, value if value.ndim == 1 else value[None], {"units": one.unit})
    return xr.Dataset(variables)


def _labelled(predictions: list[Prediction], key: str) -> xr.Dataset:
    return _per_run(predictions, key).rename({one.run: f"{one.run}:{key}" for one in predictions})


def _log_likelihood(problem: Problem, draws: dict[str, Any]) -> xr.Dataset:
    """Log density of each reading given the earlier ones, for each run."""
    layout, data = problem.layout, problem.data
    pieces: dict[int, list[np.ndarray]] = {}
    vectors = np.asarray(unconstrained(draws, layout, data))
    fits = [fits_with(predictions_at(v, layout, data), v, layout, data) for v in vectors]
    for group, (lanes, owners) in enumerate(zip(data.lanes, problem.lane_runs, strict=True)):
        density = np.stack([np.asarray(fit[group].log_density) for fit in fits])
        observed = np.asarray(lanes.weight) > 0
        for lane, owner in enumerate(owners):
            seen = observed[lane]
            pieces.setdefault(owner, []).append(density[:, lane][:, seen])
    return xr.Dataset(
        {
            problem.runs[i].name: (
                ["chain", "draw", f"{problem.runs[i].name}_interval"],
                np.concatenate(parts, axis=-1)[None],
            )
            for i, parts in pieces.items()
        }
    )
