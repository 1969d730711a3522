"""What a fitted point tells of its parameters."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from muscle_bayes.discovery.judged import laplace_draws
from muscle_bayes.discovery.result import Curve, Estimate
from muscle_bayes.discovery.settling import settled
from muscle_bayes.discovery.tolerance import noise_by_regime
from muscle_bayes.inference.search.descent import Fitted
from muscle_bayes.inference.search.nested import Nested, general
from muscle_bayes.inference.search.nested_programs import values_of
from muscle_bayes.physics.effects.empirical import TERMS, function_type, polynomial

DRAWS = 400
POINTS = 101
"""Of a curve."""
LEVELS = (0.05, 0.5, 0.95)
LOOSE = 0.5
"""Posterior standard deviation, as a share of the prior's, above which a parameter is not determined."""
OWN = ("zero", "start", "speed", "hyst_force", "noise", "discrepancy", "correlation_time")
"""Quantities of runs and sensors: not the plant's."""


def estimates(nested: Nested, fitted: Fitted, effect: str, seed: int) -> dict[str, Estimate]:
    """Median and central 90 % of an effect's parameters, by the normal approximation."""
    found = {}
    for name, drawn in _drawn(nested, fitted, effect, seed).items():
        low, median, high = map(float, np.quantile(drawn, LEVELS))
        found[name.split(".")[1]] = Estimate(median, low, high, nested.problem.sites[name].unit)
    return found


def curve(nested: Nested, fitted: Fitted, effect: str, seed: int) -> Curve:
    """Pointwise median and central 90 % of a function that nobody has named, by the same draws."""
    function = function_type(effect)
    drawn = _drawn(nested, fitted, effect, seed)
    names = [f"{general(effect)}.c{order}" for order in range(1, TERMS + 1)]
    signal = np.linspace(function.low, function.high, POINTS)
    added = polynomial(
        [jnp.asarray(drawn[name])[:, None] for name in names],
        jnp.asarray(signal),
        jnp.asarray(function.low),
        jnp.asarray(function.high),
    )
    low, median, high = np.quantile(np.asarray(added), LEVELS, axis=0)
    return Curve(signal, median, low, high, nested.problem.sites[names[0]].unit)


def _drawn(
    nested: Nested, fitted: Fitted, effect: str, seed: int
) -> dict[str, Float[np.ndarray, " draw"]]:
    """Draws of an effect's parameters, as the nested model names them."""
    points = laplace_draws(fitted, DRAWS, seed)
    drawn = values_of(jnp.asarray(points), fitted.choice, nested.layout, nested.data)
    return {name: np.asarray(drawn[name]) for name in nested.slots_of((effect,))}


def _spread(nested: Nested, fitted: Fitted) -> Float[np.ndarray, " shared"]:
    """Posterior over prior standard deviation of every shared entry."""
    variance = np.diag(fitted.precision.inverse())[: nested.shared]
    prior = np.asarray(fitted.slope.prior)[: nested.shared]
    return np.sqrt(variance * np.maximum(prior, 1e-12))


def undetermined(nested: Nested, before: Fitted, after: Fitted) -> tuple[str, ...]:
    """The plant's parameters that were determined before and are not after."""
    names = np.array(nested.shared_names())
    own = np.array([name.split(".")[-1].split("[")[0] in OWN for name in names])
    lost = (_spread(nested, before) < LOOSE) & (_spread(nested, after) >= LOOSE) & ~own
    return tuple(str(name) for name in names[lost])


def noise_floor(nested: Nested) -> dict[str, float]:
    """RMS that noise and rounding alone give in each run's settled mean readings [the log's unit]."""
    variance: dict[str, list[np.ndarray]] = {}
    problem, level = nested.problem, noise_by_regime(nested.problem)
    groups = zip(nested.data.lanes, problem.lane_runs, problem.layout.regimes, strict=True)
    for lanes, owners, regime in groups:
        for lane, owner in enumerate(owners):
            run = problem.runs[owner]
            weight, coarse = np.asarray(lanes.weight[lane]), np.asarray(lanes.coarse[lane])
            load = np.asarray(lanes.schedule.load[lane])
            heat = np.asarray(lanes.schedule.temperature[lane, 1:, 0])
            seen = (weight > 0) & settled(np.asarray(lanes.time[lane]), load, heat)
            noise = level[regime] ** 2 / weight[seen]
            rounding = run.sensor.resolution**2 * coarse[seen]
            variance.setdefault(run.name, []).append(noise + rounding)
    return {
        name: float(np.sqrt(np.mean(np.concatenate(parts)))) for name, parts in variance.items()
    }
