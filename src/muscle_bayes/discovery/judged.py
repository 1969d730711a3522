"""What a fitted point predicts of every run, with the uncertainty of its parameters."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from muscle_bayes.inference.posteriors.predict import Prediction, disturbances
from muscle_bayes.inference.search.descent import Fitted
from muscle_bayes.inference.search.nested import Nested, values_at
from muscle_bayes.inference.search.nested_programs import explained_at

DRAWS = 60
SHARE = 0.05
"""Of a draw's distance from the fitted point, at which the model's response to it is read."""


def laplace_draws(fitted: Fitted, count: int, seed: int) -> np.ndarray:
    """Points drawn from the normal approximation of the posterior."""
    kicks = np.random.default_rng(seed).standard_normal((fitted.used, count))
    points = np.tile(fitted.point, (count, 1))
    points[:, : fitted.used] += fitted.precision.spread(kicks).T
    return points


def predictions(nested: Nested, fitted: Fitted, seed: int) -> list[Prediction]:
    """Readings of every run of `nested`'s data about a fitted point.

    Models are taken for linear in the parameters: m(x) + (m(x + SHARE d) - m(x)) / SHARE for draws d
    of their normal approximation, which would itself leave the curved ridges of the posterior.
    Directions that cannot be simulated are left out.
    """
    layout, data, problem = nested.layout, nested.data, nested.problem
    values = dict(values_at(jnp.asarray(fitted.point), fitted.choice, layout, data))

    def models_at(point: np.ndarray) -> list[np.ndarray] | None:
        found = explained_at(jnp.asarray(point), fitted.choice, layout, data)
        if not np.isfinite(float(found.potential)):
            return None
        lanes = zip(data.lanes, found.residuals, strict=True)
        return [np.asarray(one.reading - residual) for one, residual in lanes]

    middle = models_at(fitted.point)
    assert middle is not None, "a fitted point can be simulated"
    models: list[list[np.ndarray]] = [[] for _ in data.lanes]
    noises: list[list[np.ndarray]] = [[] for _ in data.lanes]
    keys = jax.random.split(jax.random.key(seed), DRAWS)
    for key, point in zip(keys, laplace_draws(fitted, DRAWS, seed), strict=True):
        near = models_at(fitted.point + SHARE * (point - fitted.point))
        if near is None:
            continue
        for group, (lanes, regime) in enumerate(zip(data.lanes, layout.regimes, strict=True)):
            now = jax.random.fold_in(key, group)
            extra = disturbances(now, values, jnp.asarray(middle[group]), lanes, regime)
            models[group].append(middle[group] + (near[group] - middle[group]) / SHARE)
            noises[group].append(np.asarray(extra))
    parts: dict[int, list[dict[str, np.ndarray]]] = {}
    for group, (lanes, owners) in enumerate(zip(data.lanes, problem.lane_runs, strict=True)):
        model = np.stack(models[group])
        model += middle[group] - model.mean(axis=0)  # the mean of few draws scatters
        reading = model + np.stack(noises[group])
        hyst = np.asarray(fitted.found.hyst[group])
        for lane, owner in enumerate(owners):
            seen = np.asarray(lanes.weight[lane] > 0)
            parts.setdefault(owner, []).append(
                {
                    "time": np.asarray(lanes.time[lane])[seen],
                    "observed": np.asarray(lanes.reading[lane])[seen],
                    "model": model[:, lane][:, seen],
                    "reading": reading[:, lane][:, seen],
                    "hyst": np.tile(hyst[lane][seen], (len(model), 1)),
                    "temperature": np.asarray(lanes.schedule.temperature[lane, 1:, 0])[seen],
                    "load": np.asarray(lanes.schedule.load[lane])[seen],
                }
            )
    result = []
    for owner in sorted(parts):
        run = problem.runs[owner]
        joined: dict[str, Any] = {
            key: np.concatenate([part[key] for part in parts[owner]], axis=-1)
            for key in parts[owner][0]
        }
        scale = run.sensor.sign * run.sensor.scale
        result.append(Prediction(run=run.name, unit=run.unit, scale=scale, **joined))
    return result
