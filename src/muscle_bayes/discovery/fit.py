"""Fit all: every candidate from every start is a row of one batch of least squares."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from muscle_bayes.inference.model.discrepancy import LOG_2PI
from muscle_bayes.inference.model.lane_model import Values
from muscle_bayes.inference.model.noise import NoiseParameters
from muscle_bayes.inference.model.problem import TYPICAL_MISFIT_TIME, Data
from muscle_bayes.inference.model.reduction import with_swings
from muscle_bayes.inference.running.batches import of_rows
from muscle_bayes.inference.running.programs import unconstrained
from muscle_bayes.inference.search.factored import FactoredPrecision
from muscle_bayes.inference.search.least_squares import least_squares
from muscle_bayes.inference.search.nested import Choice, Nested, values_at
from muscle_bayes.inference.search.nested_programs import Explained, Look, explained_at, look_at
from muscle_bayes.inference.search.pivots import pivoted

Tick = Callable[[], None]
"""Called between steps: raises where a search has to stop."""
Report = Callable[[str, int, int], None]
"""Is told stage, done and total."""


class Start(NamedTuple):
    """A row of the batch: a model, and where its descent begins."""

    effects: tuple[str, ...]
    point: Float[np.ndarray, " n"]
    data: Data


@dataclass(frozen=True)
class Fitted:
    """A model at its most probable point."""

    effects: tuple[str, ...]
    point: Float[np.ndarray, " n"]
    data: Data
    """What it was fitted to, with the motion at its own point: swings, segments' pivots."""
    choice: Choice
    look: Look
    used: int
    """Entries of the point that mean something; the rest are empty slots."""

    @property
    def potential(self) -> float:
        """Negative log posterior density; inf where it cannot be evaluated."""
        parts = self.look.potential, self.look.gradient, self.look.information
        return float(parts[0]) if all(np.isfinite(part).all() for part in parts) else np.inf

    @cached_property
    def jacobian(self) -> Float[np.ndarray, "error n"]:
        """Derivatives of all standardised errors in the used entries."""
        return np.asarray(self.look.jacobian)[: self.used].T

    @cached_property
    def errors(self) -> Float[np.ndarray, " error"]:
        """All standardised one-step-ahead errors; 0 where nothing is observed."""
        return np.asarray(self.look.errors)

    @cached_property
    def log_densities(self) -> Float[np.ndarray, " error"]:
        """Log density of each observed reading given the earlier ones; 0 where none."""
        return np.asarray(self.look.log_densities)

    @cached_property
    def precision(self) -> FactoredPrecision:
        """Fisher information of the likelihood plus prior precision, in the used entries."""
        return FactoredPrecision(np.asarray(self.look.information)[: self.used, : self.used])

    @cached_property
    def log_evidence(self) -> float:
        """Laplace's approximation: log density at the mode times the volume of the posterior."""
        if not np.isfinite(self.potential):
            return -np.inf
        volume = 0.5 * self.used * LOG_2PI - 0.5 * self.precision.log_determinant
        return -self.potential + volume

    @property
    def occam(self) -> float:
        """What the log evidence holds besides the log likelihood: prior and volume."""
        return self.log_evidence - float(self.log_densities.sum())

    @property
    def start(self) -> Start:
        """To go on from here."""
        return Start(self.effects, self.point, self.data)


def fit_all(
    nested: Nested,
    starts: Sequence[Start],
    held: Sequence[str] = (),
    steps: int = 40,
    *,
    behind: float = np.inf,
    groups: Sequence[Hashable] | None = None,
    workers: int = 1,
    tick: Tick = lambda: None,
) -> list[Fitted]:
    """Descend from all starts together; entries named in `held` stay. A fit for each start.

    Rows that fall `behind` the best of their group [nat] rest. No step leads to a point whose
    derivatives are not finite; a start that has none keeps its point and the potential inf.
    """
    layout = nested.layout
    choices = [nested.choice(start.effects) for start in starts]

    def looker(points: Sequence[np.ndarray], index: Sequence[int]) -> list[Look]:
        tick()
        found: dict[int, Look] = {}
        for size in sorted({point.size for point in points}):
            chosen = [k for k, point in enumerate(points) if point.size == size]
            rows = [(points[k], choices[index[k]], starts[index[k]].data) for k in chosen]
            found |= zip(chosen, of_rows(look_at, rows, layout, workers), strict=True)
        return [found[k] for k in range(len(points))]

    stay = [i for i, name in enumerate(nested.shared_names()) if name in held]
    rows = least_squares(
        looker,
        [start.point for start in starts],
        stay,
        steps,
        least_gain=0.1,
        behind=behind,
        groups=groups,
    )
    return [
        Fitted(
            start.effects,
            row.point,
            start.data,
            choice,
            row.look,
            nested.shared + len(nested.slots_of(start.effects)),
        )
        for start, choice, row in zip(starts, choices, rows, strict=True)
    ]


def explained_all(nested: Nested, starts: Sequence[Start], workers: int = 1) -> list[Explained]:
    """How every start explains the readings, without derivatives."""
    rows = [(start.point, nested.choice(start.effects), start.data) for start in starts]
    found: dict[int, Explained] = {}
    for size in sorted({row[0].size for row in rows}):
        chosen = [k for k, row in enumerate(rows) if row[0].size == size]
        parts = of_rows(explained_at, [rows[k] for k in chosen], nested.layout, workers)
        found |= zip(chosen, jax.device_get(parts), strict=True)
    return [found[k] for k in range(len(rows))]


def noise_names(nested: Nested) -> list[str]:
    """Names of the noise parameters among the shared entries."""
    keys = NoiseParameters._fields
    return [name for name in nested.shared_names() if name.rpartition(".")[2] in keys]


def misfit(nested: Nested, residuals: Sequence, data: Data) -> dict[str, tuple[float, float]]:
    """RMS residual of each regime's intervals [log's unit], and the readings in a usual interval."""
    found: dict[str, tuple[float, float]] = {}
    for regime in sorted(set(nested.layout.regimes)):
        groups = [k for k, name in enumerate(nested.layout.regimes) if name == regime]
        weights = [np.asarray(data.lanes[k].weight) for k in groups]
        seen = np.concatenate([w[w > 0] for w in weights])
        parts = [np.asarray(residuals[k])[w > 0] for k, w in zip(groups, weights, strict=True)]
        rms = float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
        found[regime] = (rms if np.isfinite(rms) else 1e6, float(np.median(seen)))
    return found


def tempered(
    nested: Nested, start: Start, residuals: Sequence, noise: dict[str, float] | None = None
) -> Start:
    """The start with its misfit taken for white noise, or, `noise` of a reading given, for lasting."""
    names, point = nested.shared_names(), start.point.copy()
    lasts: Mapping[str, float] = TYPICAL_MISFIT_TIME  # type: ignore[assignment]
    for regime, (rms, readings) in misfit(nested, residuals, start.data).items():
        values = {"noise": rms * np.sqrt(readings), "discrepancy": 1e-3 * rms}
        if noise is not None:
            values = {"noise": noise[regime], "discrepancy": max(rms, 0.1 * noise[regime])}
            values["correlation_time"] = lasts[regime]
        for key, value in values.items():
            point[names.index(f"{regime}.{key}")] = np.log(max(value, 1e-300))
    return start._replace(point=point)


def annealed(
    nested: Nested,
    starts: Sequence[Start],
    noise: dict[str, float],
    groups: Sequence[Hashable],
    *,
    rounds: Sequence[tuple[float, int]] = ((1.0, 4), (1.0, 6)),
    behind: float = 300.0,
    workers: int = 1,
    tick: Tick = lambda: None,
) -> list[Start]:
    """Starts after descents in which all misfit is white noise, best of each group first.

    Each of the `rounds` takes the first share of every run, and so many steps. The noise is set to the
    misfit before each: large first, so that a lasting discrepancy does not hide what causes it, then as
    small as the misfit has become. Starts that cannot be evaluated, or end `behind` the best of their group
    [nat], are left out; what is returned has lasting noise.
    """
    held = noise_names(nested)
    rows = list(zip(starts, groups, (start.data for start in starts), strict=True))
    for share, count in rounds:
        cut = [start._replace(data=first_share(data, share)) for start, _, data in rows]
        seen = explained_all(nested, cut, workers)
        begun = [
            (tempered(nested, start, one.residuals), *row[1:])
            for start, one, row in zip(cut, seen, rows, strict=True)
            if np.isfinite(float(one.potential))
        ]
        owners = [group for _, group, _ in begun]
        fits = fit_all(
            nested,
            [start for start, _, _ in begun],
            held,
            count,
            behind=behind,
            groups=owners,
            workers=workers,
            tick=tick,
        )
        best: dict[Hashable, float] = {}
        for fit, group in zip(fits, owners, strict=True):
            best[group] = min(fit.potential, best.get(group, np.inf))
        kept = [
            (fit.potential, fit.start, *row[1:])
            for fit, row in zip(fits, begun, strict=True)
            if np.isfinite(fit.potential) and fit.potential <= best[row[1]] + behind
        ]
        rows = [row for _, *row in sorted(kept, key=lambda one: one[0])]  # type: ignore[misc]
    ends = [start._replace(data=data) for start, _, data in rows]
    seen = explained_all(nested, ends, workers)
    return [tempered(nested, s, one.residuals, noise) for s, one in zip(ends, seen, strict=True)]


def first_share(data: Data, share: float, fewest: int = 12) -> Data:
    """The data with this share of every lane's observed intervals, from the first on; `fewest` at least."""
    lanes = []
    for group in data.lanes:
        rank = jnp.cumsum(group.weight > 0, axis=1)
        seen = rank <= jnp.maximum(share * rank[:, -1:], fewest)
        lanes.append(group._replace(weight=jnp.where(seen, group.weight, 0.0)))
    return data._replace(lanes=tuple(lanes))


def settled(nested: Nested, fitted: Fitted, rounds: int = 3, workers: int = 1) -> Fitted:
    """The fit with what its own point tells of the motion, and fitted with it.

    Slow runs leave inertia out but for what it adds at one point, and segments are linear in their starts
    about those that were most probable at one point. A model counts by the density with the motion of its
    own point alone: of rounds, each with the motion of the last, the likeliest such.
    """
    best = _with_own_motion(nested, fitted)
    for _ in range(rounds - 1):
        (further,) = fit_all(nested, [best.start], workers=workers)
        trial = _with_own_motion(nested, further)
        if not trial.potential < best.potential - 1.0:
            break
        best = trial
    return best


def _with_own_motion(nested: Nested, fitted: Fitted) -> Fitted:
    values = values_at(jnp.asarray(fitted.point), fitted.choice, nested.layout, fitted.data)
    start = fitted.start._replace(data=_own_motion(nested, values, fitted.data))
    (found,) = fit_all(nested, [start], steps=0)
    return found


def _own_motion(nested: Nested, values: Values, data: Data) -> Data:
    """The data with segments' pivots, and with what inertia adds, at these values."""
    draws = {name: jnp.asarray(values[name])[None] for name, _ in nested.layout.shapes}
    vector = unconstrained(draws, nested.layout, data)[0]
    data = pivoted(vector, nested.layout, data)
    return with_swings(replace(nested.problem, data=data), values).data


def in_slow_motion(fitted: Fitted) -> Start:
    """The fit as a start in data without what inertia adds to slow motion, which is one point's own."""
    lanes = tuple(one._replace(swing=jnp.zeros_like(one.swing)) for one in fitted.data.lanes)
    return fitted.start._replace(data=fitted.data._replace(lanes=lanes))


def whole_weights(nested: Nested, data: Data) -> Data:
    """The data with every reading counted again."""
    pairs = zip(data.lanes, nested.data.lanes, strict=True)
    return data._replace(lanes=tuple(one._replace(weight=all_.weight) for one, all_ in pairs))


def sampled_values(nested: Nested, fitted: Fitted) -> dict[str, Any]:
    """What is sampled at a fit, effects that are not on off: `nested.point` makes a point of it again."""
    found = values_at(jnp.asarray(fitted.point), fitted.choice, nested.layout, fitted.data)
    values: dict[str, Any] = {name: np.asarray(found[name]) for name, _ in nested.layout.shapes}
    for regime, least in nested.least.items():
        # What is allowed in any case comes on top again.
        size = values[f"{regime}.discrepancy"]
        values[f"{regime}.discrepancy"] = np.sqrt(max(size**2 - least**2, (1e-6 * size) ** 2))
    return values


def with_effects(nested: Nested, fitted: Fitted, effects: Sequence[str]) -> Start:
    """A start of the model with some of the fit's effects alone, in this order."""
    point = nested.point(sampled_values(nested, fitted), effects)
    return Start(tuple(effects), point, fitted.data)
