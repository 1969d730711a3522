"""A fitted posterior: draws, what they were made from, and whether to trust them."""

import json
import platform
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import arviz as az
import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import xarray as xr

from muscle_bayes.conventions import Friction
from muscle_bayes.data.run import Run
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.density import constrain, lane_fits, muscle_of
from muscle_bayes.inference.optimise import STARTS, find_mode
from muscle_bayes.inference.precision import double_precision
from muscle_bayes.inference.predict import (
    SETTLING_SHARE,
    Prediction,
    predict,
    resting_starts,
    settled_starts,
)
from muscle_bayes.inference.prior import MUSCLE_PARAMETERS
from muscle_bayes.inference.problem import Problem, pose
from muscle_bayes.inference.sampler import Draws, compile_for, draw

MAX_RHAT = 1.01
MIN_ESS = 400
PREDICTIVE_DRAWS = 200
PRIOR_DRAWS = 1000
LIBRARIES = ("muscle-bayes", "jax", "numpyro", "diffrax", "arviz", "numpy")


@dataclass(frozen=True)
class Effort:
    """How long to sample."""

    chains: int = 4
    warmup: int = 200
    draws: int = 1000
    min_ess: int = MIN_ESS


QUICK = Effort(chains=4, warmup=100, draws=300, min_ess=200)
FULL = Effort()
EFFORTS = {"quick": QUICK, "full": FULL}


@dataclass(frozen=True)
class Posterior:
    """Draws as an ArviZ DataTree, with the few things asked of it most."""

    tree: xr.DataTree

    @property
    def friction(self) -> Friction:
        return self.tree.attrs["friction"]

    @property
    def effects(self) -> tuple[str, ...]:
        return tuple(json.loads(self.tree.attrs["effects"]))

    @property
    def converged(self) -> bool:
        return bool(self.tree.attrs["converged"])

    @property
    def complaints(self) -> tuple[str, ...]:
        """Why the draws are not to be trusted; empty if they are."""
        return tuple(json.loads(self.tree.attrs["complaints"]))

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the plant's parameters and of the effects'."""
        return tuple(json.loads(self.tree.attrs["parameters"]))

    def summary(self):
        """Table of the parameters: mean, sd, 90 % interval, ESS and R-hat."""
        return az.summary(
            self.tree, var_names=list(self.parameters), ci_prob=0.9, ci_kind="eti", round_to="none"
        )

    def save(self, path: Path) -> None:
        """Write NetCDF, replacing `path` only when it is whole."""
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(".partial")
        self.tree.to_netcdf(partial, engine="h5netcdf")
        partial.replace(path)

    @classmethod
    def load(cls, path: Path) -> "Posterior":
        """Read a posterior. Raises MuscleBayesError if the file is none."""
        try:
            tree = xr.load_datatree(path, engine="h5netcdf")
        except (OSError, ValueError) as error:
            raise MuscleBayesError(f"{path}: cannot be read as a posterior ({error})") from error
        if "converged" not in tree.attrs or "posterior" not in tree:
            raise MuscleBayesError(
                f"{path}: is NetCDF, but not a posterior written by `muscle-bayes fit`"
            )
        return cls(tree)

    def _repr_html_(self) -> str:
        verdict = "converged" if self.converged else "NOT CONVERGED: " + "; ".join(self.complaints)
        return f"<p><b>Posterior</b>, {verdict}</p>{self.summary()._repr_html_()}"

    def __repr__(self) -> str:
        verdict = "converged" if self.converged else "NOT CONVERGED"
        return f"Posterior({verdict}, {', '.join(self.parameters)})\n{self.summary()}"


def _as_prior(given: Posterior, friction: Friction) -> dict[str, dist.Distribution]:
    """Log-normal priors of J and D with the moments of an earlier posterior's logarithms."""
    if given.friction != friction:
        raise MuscleBayesError(
            f"the given posterior has {given.friction} friction, this fit {friction}; "
            "its D means another thing. Give one of the same friction"
        )
    group = given.tree["posterior"]
    logs = {name: np.log(group[name].to_numpy()) for name in ("J", "D") if name in group}
    return {name: dist.LogNormal(log.mean(), log.std()) for name, log in logs.items()}


def _run_axis(problem: Problem, name: str) -> list[str]:
    return [f"{name.split('.')[0]}_run"] if problem.sites[name].prior.shape() else []


def _named(problem: Problem, values: dict[str, Any]) -> dict[str, Any]:
    """Sampled values together with Table 2's parameters."""
    values = dict(values)
    muscle = muscle_of(values, problem.data)
    if muscle is not None:
        values |= {name: getattr(muscle, name) for name in MUSCLE_PARAMETERS}
    return {name: np.asarray(value) for name, value in values.items()}


def parameter_names(problem: Problem) -> list[str]:
    """The plant's parameters, then the effects', in the order of the thesis' tables."""
    sampled = [name for name, _ in problem.layout.shapes]
    names = [name for name in ("J", "D") if name in sampled]
    names += list(MUSCLE_PARAMETERS) if "contraction" in sampled else []
    return names + [name for name in sampled if name.split(".")[0] in problem.layout.effects]


def _dataset(problem: Problem, values: dict[str, np.ndarray], lead: list[str]) -> xr.Dataset:
    units = {name: site.unit for name, site in problem.sites.items()}
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


def _complaints(problem: Problem, dataset: xr.Dataset, draws: Draws, effort: Effort) -> list[str]:
    found = []
    if count := int(draws.diverging.sum()):
        found.append(f"{count} divergent transitions")
    sampled = dataset[[name for name, _ in problem.layout.shapes]]
    rhat, ess = az.rhat(sampled), az.ess(sampled)
    for name in sampled.data_vars:
        if float(rhat[name].max()) > MAX_RHAT:
            found.append(f"R-hat of {name} is {float(rhat[name].max()):.3f}, over {MAX_RHAT}")
        if float(ess[name].min()) < effort.min_ess:
            found.append(
                f"bulk ESS of {name} is {float(ess[name].min()):.0f}, below {effort.min_ess}"
            )
    return found


@double_precision
def fit(
    runs: Sequence[Run],
    friction: Friction = "coulomb",
    effects: Sequence[str] = (),
    *,
    effort: Effort = FULL,
    given: "Posterior | None" = None,
    seed: int = 0,
    report: Callable[[str, int, int], None] = lambda stage, done, total: None,
) -> Posterior:
    """Posterior of everything that is unknown about these runs.

    `given` is an earlier posterior of the fixture: its J and D become this fit's prior.
    `report(stage, done, total)` follows the progress. Raises MuscleBayesError for runs that cannot
    be fitted together or simulated; poor convergence is told by `converged` and `complaints`.
    """
    problem = pose(runs, friction, effects, None if given is None else _as_prior(given, friction))
    keys = jax.random.split(jax.random.key(seed), 2)
    total, done, tried = effort.chains * (effort.warmup + effort.draws), 0, 0

    def searched(_: str) -> None:
        nonlocal tried
        tried += 1
        report("searching", tried, STARTS)

    def sampled(count: int) -> None:
        nonlocal done
        done += count
        report("sampling", done, total)

    with ThreadPoolExecutor(1) as pool:
        ready = pool.submit(compile_for, problem.layout, problem.data, effort.warmup)
        mode = find_mode(keys[0], problem.layout, problem.data, searched)
        ready.result()
    drawn = draw(
        keys[1],
        mode,
        problem.layout,
        problem.data,
        chains=effort.chains,
        warmup=effort.warmup,
        draws=effort.draws,
        report=sampled,
    )
    report("predicting", 0, 1)
    posterior = assemble(problem, drawn, effort, seed)
    report("predicting", 1, 1)
    return posterior


def assemble(problem: Problem, drawn: Draws, effort: Effort, seed: int) -> Posterior:
    """The DataTree of a problem's draws: posterior, predictive, likelihood, prior, statistics, data."""
    layout, data = problem.layout, problem.data
    expand = jax.jit(jax.vmap(jax.vmap(lambda v: constrain(v, layout, data))))
    values = expand(jnp.asarray(drawn.vector))
    posterior = _dataset(problem, _named(problem, values), ["chain", "draw"])
    prior_keys = jax.random.split(jax.random.key(seed + 1), len(layout.shapes))
    prior = {
        name: data.priors[name].sample(key, (1, PRIOR_DRAWS))
        for key, (name, _) in zip(prior_keys, layout.shapes, strict=True)
    }
    thinned = thin(values, PREDICTIVE_DRAWS)
    predictions = predict(problem, thinned, seed + 2)
    statistics = {
        "diverging": drawn.diverging,
        "n_steps": drawn.steps,
        "acceptance_rate": drawn.acceptance,
        "energy": drawn.energy,
        "lp": drawn.log_density,
    }
    complaints = _complaints(problem, posterior, drawn, effort)
    groups = {
        "posterior": posterior,
        "prior": _dataset(problem, _named(problem, prior), ["chain", "draw"]),
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
        "runs": json.dumps({run.name: run.checksum for run in problem.runs}),
        "base_length": float(data.base_length),
        "origin": json.dumps(sorted({run.metadata.origin for run in problem.runs})),
        "versions": json.dumps(
            {name: version(name) for name in LIBRARIES} | {"python": platform.python_version()}
        ),
    }
    return Posterior(tree)


def thin(values: dict[str, Any], count: int) -> dict[str, Any]:
    """`count` draws spread evenly over all chains, chain and draw axes merged."""
    chains, draws = next(iter(values.values())).shape[:2]
    chosen = np.linspace(0, chains * draws - 1, min(count, chains * draws)).astype(int)
    return {
        name: jnp.asarray(np.asarray(value).reshape(chains * draws, *value.shape[2:])[chosen])
        for name, value in values.items()
    }


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
    evaluate = jax.jit(
        lambda d: jax.lax.map(
            lambda v: [fit.log_density for fit in lane_fits(v, layout, data)], d, batch_size=4
        )
    )
    pieces: dict[int, list[np.ndarray]] = {}
    for density, lanes, owners in zip(evaluate(draws), data.lanes, problem.lane_runs, strict=True):
        for lane, owner in enumerate(owners):
            seen = np.asarray(lanes.weight[lane] > 0)
            pieces.setdefault(owner, []).append(np.asarray(density[:, lane])[:, seen])
    return xr.Dataset(
        {
            problem.runs[i].name: (
                ["chain", "draw", f"{problem.runs[i].name}_interval"],
                np.concatenate(parts, axis=-1)[None],
            )
            for i, parts in pieces.items()
        }
    )


@double_precision
def predict_runs(
    posterior: Posterior, runs: Sequence[Run], *, draws: int = PREDICTIVE_DRAWS, seed: int = 0
) -> list[Prediction]:
    """Predictions of runs, whether the posterior has seen them or not.

    A run with the name of a fitted one keeps that run's own zero, start and first HYST strain, so
    that a record continued past the fitted part is predicted ahead. Another run's own unknowns are
    told by its first SETTLING_SHARE, and the rest is predicted ahead. Raises MuscleBayesError if the
    runs need parameters that the posterior lacks.
    """
    seen = set(json.loads(posterior.tree.attrs["runs"]))
    found: dict[str, Prediction] = {}
    for known in (True, False):
        part = [run for run in runs if (run.name in seen) == known]
        if part:
            for one in _predict_part(posterior, part, known, draws, seed):
                found[one.run] = one
    return [found[run.name] for run in runs]


def _shared_values(posterior: Posterior, problem: Problem, thinned: dict[str, Any]) -> Any:
    """Draws of what the problem shares with the posterior: everything that is no run's own."""
    shared = [name for name, shape in problem.layout.shapes if not shape]
    if missing := [name for name in shared if name not in thinned]:
        raise MuscleBayesError(
            f"the posterior has no {', '.join(missing)}, which these runs need; "
            "fit runs of their kind as well"
        )
    values = {name: thinned[name] for name in shared}
    scale = posterior.tree.attrs["base_length"] / float(problem.data.base_length)
    if "modulus" in values and not np.isclose(scale, 1.0):
        # K in N/m is the material's number that is carried over; stiffness per strain is K L_base.
        values |= {key: values[key] / scale for key in ("modulus", "stiffness_hyst")}
    return values


def _predict_part(
    posterior: Posterior, runs: Sequence[Run], known: bool, draws: int, seed: int
) -> list[Prediction]:
    problem = pose(runs, posterior.friction, posterior.effects)
    group = posterior.tree["posterior"].to_dataset()
    names = json.loads(posterior.tree.attrs["sampled"])
    thinned = thin({name: group[name].to_numpy() for name in names}, draws)
    values = _shared_values(posterior, problem, thinned)
    if not known:
        settled = settled_starts(problem, resting_starts(problem, values), seed + 1)
        share = {run.name: SETTLING_SHARE * run.duration for run in runs}
        predictions = predict(problem, settled, seed)
        return [one._replace(ahead_from=share[one.run]) for one in predictions]
    for name, shape in problem.layout.shapes:
        if shape:
            regime = name.split(".")[0]
            there = [str(run) for run in group[f"{regime}_run"].to_numpy()]
            chosen = [there.index(run) for run in problem.site_runs[regime]]
            values[name] = thinned[name][:, jnp.asarray(chosen)]
    return predict(problem, values, seed)


@double_precision
def predict_from_prior(
    runs: Sequence[Run],
    friction: Friction = "coulomb",
    effects: Sequence[str] = (),
    *,
    draws: int = PREDICTIVE_DRAWS,
    seed: int = 0,
) -> list[Prediction]:
    """What the priors alone say of these runs: draws that could not be real show a poor prior."""
    problem = pose(runs, friction, effects)
    keys = jax.random.split(jax.random.key(seed), len(problem.layout.shapes))
    values = {
        name: problem.data.priors[name].sample(key, (draws,))
        for key, (name, _) in zip(keys, problem.layout.shapes, strict=True)
    }
    return predict(problem, values, seed + 1)
