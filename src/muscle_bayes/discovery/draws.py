"""Draws of a fitted model's posterior, and what they say of its parameters and of every run."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp

from muscle_bayes.discovery.conditions import is_settled
from muscle_bayes.discovery.fit import Search
from muscle_bayes.discovery.fitted import Fitted, Start
from muscle_bayes.discovery.nominal import error_of_reading
from muscle_bayes.discovery.result import Curve, Estimate
from muscle_bayes.discovery.split_student import split_student
from muscle_bayes.inference.posteriors.predict import Prediction, by_run, disturbances
from muscle_bayes.inference.running.batches import of_draws
from muscle_bayes.inference.search.nested import Nested, general
from muscle_bayes.inference.search.nested_programs import values_of
from muscle_bayes.physics.effects.empirical import TERMS, function_type, polynomial

LEVELS = (0.05, 0.5, 0.95)
"""Quantiles by which estimates are told: median and central 90 %."""


@dataclass(frozen=True)
class Draws:
    """Equally weighted draws of a model's posterior, by importance sampling."""

    points: Float[np.ndarray, "draw n"]
    log_evidence: float
    """By importance sampling; Laplace's where too few draws count."""
    laplace: float
    """Log evidence by Laplace's approximation."""
    effective: float
    """Effective number of the draws; the mode's normal stands for them where `good` is False."""
    good: bool

    @classmethod
    def laplace_of(
        cls, fitted: Fitted, seed: int, count: int = 320, effective: float = 0.0
    ) -> "Draws":
        """Draws of the normal at the mode."""
        kicks = np.random.default_rng(seed).standard_normal((fitted.used, count))
        points = np.tile(fitted.point, (count, 1))
        points[:, : fitted.used] += fitted.precision.spread(kicks).T
        evidence = fitted.log_evidence
        return cls(points, evidence, evidence, effective, good=False)

    def text(self, name: str) -> str:
        """What the check of Laplace's approximation says."""
        if not self.good:
            return (
                f"{name}: Laplace's approximation is not confirmed: only {self.effective:.0f} draws "
                "count. Its probability and intervals rest on the normal at the mode"
            )
        off = self.log_evidence - self.laplace
        count = f"{self.effective:.0f} draws count"
        return f"{name}: sampled log evidence {off:+.1f} nat off Laplace's, {count}"


def sampled(
    search: Search,
    fitted: Fitted,
    *,
    count: int = 320,
    rounds: int = 3,
    enough: float = 0.2,
    least: float = 20.0,
) -> Draws:
    """Draws of the posterior about a fitted point, by importance sampling.

    From a split Student t about the mode; while less than the share `enough` of the draws count, again from
    the weighted draws' own mean and covariance, mixed with the former (population Monte Carlo; weights
    are truncated as in Ionides, J. Comput. Graph. Stat. 17, 2008). Fewer than `least` effective draws
    are not trusted.
    """
    rng, used = np.random.default_rng(search.seed), fitted.used

    def points(moves: Float[np.ndarray, "draw n"]) -> Float[np.ndarray, "draw n"]:
        found = np.tile(fitted.point, (len(moves), 1))
        found[:, :used] += moves
        return found

    def potential(moves: Float[np.ndarray, "draw n"]) -> Float[np.ndarray, " draw"]:
        rows = [Start(fitted.effects, point, fitted.data) for point in points(moves)]
        levels = np.array([float(one.potential) for one in search.explained(rows)])
        return np.nan_to_num(levels, nan=np.inf, posinf=np.inf)

    prior = np.diag(fitted.seen.prior)[:used]
    proposal = split_student(
        lambda moves: potential(moves) - fitted.potential, fitted.precision.inverse(), prior
    )
    best = None
    for _ in range(rounds):
        moves, log_q = proposal.draw(rng, count)
        log_weight = -potential(moves) - log_q
        evidence = float(logsumexp(log_weight) - np.log(count))
        share = np.exp(log_weight - logsumexp(log_weight))
        effective = float(1.0 / np.sum(share**2)) if np.isfinite(evidence) else 0.0
        if best is None or effective > best[0]:
            best = effective, evidence, moves, share
        if effective > enough * count or effective == 0.0:
            break
        cut = np.minimum(share, 1.0 / np.sqrt(count))
        proposal = proposal.moved(moves, cut / cut.sum())
    assert best is not None
    effective, evidence, moves, share = best
    if effective < least:
        return Draws.laplace_of(fitted, search.seed, count, effective)
    chosen = points(moves)[rng.choice(count, count, p=share)]
    return Draws(chosen, evidence, fitted.log_evidence, effective, good=True)


def _of_effect(nested: Nested, fitted: Fitted, draws: Draws, effect: str) -> dict[str, np.ndarray]:
    """Draws of an effect's parameters, as the nested model names them."""
    drawn = of_draws(values_of, draws.points, fitted.choice, nested.layout, fitted.data)
    return {name: np.asarray(drawn[name]) for name in nested.slots_of((effect,))}


def estimates(nested: Nested, fitted: Fitted, draws: Draws, effect: str) -> dict[str, Estimate]:
    """Median and central 90 % of an effect's parameters."""
    found = {}
    for name, drawn in _of_effect(nested, fitted, draws, effect).items():
        low, median, high = map(float, np.quantile(drawn, LEVELS))
        found[name.split(".")[1]] = Estimate(median, low, high, nested.problem.sites[name].unit)
    return found


def curve(nested: Nested, fitted: Fitted, draws: Draws, effect: str, points: int = 101) -> Curve:
    """Pointwise median and central 90 % of a function that nobody has named."""
    function = function_type(effect)
    drawn = _of_effect(nested, fitted, draws, effect)
    names = [f"{general(effect)}.c{order}" for order in range(1, TERMS + 1)]
    signal = np.linspace(function.low, function.high, points)
    coefficients = jnp.stack([jnp.asarray(drawn[name]) for name in names], axis=1)
    added = curves(coefficients, jnp.asarray(signal), function.low, function.high)
    low, median, high = np.quantile(np.asarray(added), LEVELS, axis=0)
    return Curve(signal, median, low, high, nested.problem.sites[names[0]].unit)


def curves(
    coefficients: Float[jax.Array, "draw term"],
    signal: Float[jax.Array, " point"],
    low: float,
    high: float,
) -> Float[jax.Array, "draw point"]:
    """The function of every draw of its coefficients at these values of the signal."""
    ends = jnp.asarray(low), jnp.asarray(high)
    return jax.vmap(lambda c: polynomial(tuple(c), signal, *ends))(coefficients)


def undetermined(
    nested: Nested, before: Fitted, after: Fitted, loose: float = 0.5
) -> tuple[str, ...]:
    """The plant's parameters whose posterior was narrower than `loose` of the prior, and is not after."""

    def spread(fitted: Fitted) -> np.ndarray:
        variance = np.diag(fitted.precision.inverse())[: nested.shared]
        return np.sqrt(variance * np.diag(fitted.seen.prior)[: nested.shared])

    names = np.array(nested.shared_names())
    own = np.array(["." in name for name in names])  # of a run or a sensor
    lost = (spread(before) < loose) & (spread(after) >= loose) & ~own
    return tuple(str(name) for name in names[lost])


def noise_floor(search: Search) -> dict[str, float]:
    """RMS that noise and rounding alone give in each run's settled mean readings [the log's unit]."""
    nested, error, start = search.nested, error_of_reading(search), 0
    squares: dict[str, list[np.ndarray]] = {}
    for lanes, owners in zip(nested.data.lanes, nested.problem.lane_runs, strict=True):
        whole = jax.tree.map(np.asarray, lanes)
        for lane, owner in enumerate(owners):
            one = jax.tree.map(lambda x, lane=lane: x[lane], whole)
            weight, schedule = one.weight, one.schedule
            seen = (weight > 0) & is_settled(one.time, schedule.load, schedule.temperature[1:, 0])
            own = error[start : start + weight.size][seen]
            start += weight.size
            squares.setdefault(nested.problem.runs[owner].name, []).append(own**2)
    return {name: float(np.sqrt(np.mean(np.concatenate(s)))) for name, s in squares.items()}


def predictions(
    search: Search, fitted: Fitted, draws: Draws, *, count: int = 60, share: float = 0.05
) -> list[Prediction]:
    """Readings of every run about a fitted point, held-out parts included.

    Models are taken for linear in the parameters: m(x) + (m(x + share d) - m(x)) / share for draws d,
    which would themselves leave the curved ridges of the posterior. Directions that cannot be simulated
    are left out.
    """
    nested, layout = search.nested, search.nested.layout
    data = search.whole(fitted).data
    values = values_of(fitted.point, fitted.choice, layout, data)
    chosen = draws.points[np.linspace(0, len(draws.points) - 1, count).astype(int)]
    near = fitted.point + share * (chosen - fitted.point)
    rows = [Start(fitted.effects, point, data) for point in (fitted.point, *near)]
    found = [one for one in search.explained(rows) if np.isfinite(one.potential)]
    keys = jax.random.split(jax.random.key(search.seed), len(found))
    models, readings, strains = [], [], []
    for group, (lanes, regime) in enumerate(zip(data.lanes, layout.regimes, strict=True)):
        every = [np.asarray(lanes.reading - one.residuals[group]) for one in found]
        middle = every[0]
        model = np.stack([middle + (one - middle) / share for one in every[1:]])
        model += middle - model.mean(axis=0)  # the mean of few draws scatters
        extra = [
            np.asarray(
                disturbances(
                    jax.random.fold_in(key, group), values, jnp.asarray(middle), lanes, regime
                )
            )
            for key in keys[1:]
        ]
        models.append(model)
        readings.append(model + np.stack(extra))
        hyst = np.asarray(fitted.seen.hyst[group])
        strains.append(np.broadcast_to(hyst, (len(model), *hyst.shape)))
    return by_run(nested.problem, data.lanes, models, readings, strains)
