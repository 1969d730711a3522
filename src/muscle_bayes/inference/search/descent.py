"""The most probable point of one candidate, and the evidence for it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from muscle_bayes.inference.model.discrepancy import LOG_2PI
from muscle_bayes.inference.search.damped_steps import LONGEST_MOVE, damped_move
from muscle_bayes.inference.search.factored import FactoredPrecision
from muscle_bayes.inference.search.nested import Choice, Nested
from muscle_bayes.inference.search.nested_programs import (
    Explained,
    Slope,
    explained_at,
    slope_at,
)

MAX_STEPS = 40
LEAST_GAIN = 0.1
"""Decrease of the potential below which a descent ends: far less than any comparison's uncertainty."""
CUT = 0.99
"""Share of the longest move from which on a step counts as cut short."""
LEAST_PRECISION = 1e-4
"""Least prior precision of a direction, for flat or concave priors."""
FIRST_DAMPING, MOST_DAMPING = 1e-2, 1e8
"""Of a descent's first step, and from which on it ends."""


@dataclass(frozen=True)
class Fitted:
    """A candidate at its most probable point."""

    effects: tuple[str, ...]
    choice: Choice
    point: Float[np.ndarray, " n"]
    potential: float
    """Negative log posterior density; inf where its derivatives are not finite."""
    found: Explained
    slope: Slope
    used: int
    """Entries of the point that mean something; the rest are empty slots."""
    damping: float
    """Of the step that a descent would take from here."""

    @cached_property
    def jacobian(self) -> Float[np.ndarray, "error n"]:
        """Derivatives of all standardised errors in the used entries."""
        flat = [np.asarray(part).reshape(len(self.point), -1) for part in self.slope.errors]
        return np.concatenate(flat, axis=1).T[:, : self.used]

    @cached_property
    def errors(self) -> Float[np.ndarray, " error"]:
        """All standardised one-step-ahead errors; 0 where nothing is observed."""
        return np.concatenate([np.asarray(fit.errors).ravel() for fit in self.found.fits])

    @cached_property
    def log_densities(self) -> Float[np.ndarray, " error"]:
        """Log density of each observed reading given the earlier ones; 0 where none."""
        return np.concatenate([np.asarray(fit.log_density).ravel() for fit in self.found.fits])

    @cached_property
    def information(self) -> Float[np.ndarray, "n n"]:
        """Fisher information of the likelihood plus prior precision, in the used entries."""
        return _information(self.slope)[: self.used, : self.used]

    @cached_property
    def precision(self) -> FactoredPrecision:
        """The information, factored."""
        return FactoredPrecision(self.information)

    @property
    def log_evidence(self) -> float:
        """Laplace's approximation: log density at the mode times the volume of the posterior."""
        if not self.slope.finite:
            return -np.inf
        volume = 0.5 * self.used * LOG_2PI - 0.5 * self.precision.log_determinant
        return -self.potential + volume

    @property
    def occam(self) -> float:
        """What the log evidence holds besides the log likelihood: prior and volume."""
        return self.log_evidence - float(self.log_densities.sum())


def _information(slope: Slope) -> Float[np.ndarray, "n n"]:
    """Fisher information plus the prior's precision.

    Of normal errors e = r / s: (de)(de)' + (d ln s)(d ln s)'. Errors alone would tell half of what is
    known of noise parameters, whose steps would then be twice too long.
    """
    size = slope.prior.size
    parts = [np.asarray(part).reshape(size, -1) for part in (*slope.errors, *slope.scales)]
    flat = np.concatenate(parts, axis=1)
    return flat @ flat.T + np.diag(np.maximum(np.asarray(slope.prior), LEAST_PRECISION))


def descend(
    nested: Nested,
    effects: Sequence[str],
    start: Float[np.ndarray, " n"],
    limit: int = MAX_STEPS,
    held: Sequence[str] = (),
) -> Fitted:
    """Levenberg-Marquardt from `start`, damped until a step descends; entries named in `held` stay.

    No step leads to a point whose derivatives are not finite, nor from such a start.
    """
    choice = nested.choice(effects)
    point = np.asarray(start, float)
    found, slope = _seen(nested, choice, point), _slope(nested, choice, point)
    used = nested.shared + len(nested.slots_of(effects))
    potential = float(found.potential) if slope.finite else np.inf
    fitted = Fitted(tuple(effects), choice, point, potential, found, slope, used, FIRST_DAMPING)
    return go_on(nested, fitted, limit, held)


def go_on(
    nested: Nested, fitted: Fitted, limit: int = MAX_STEPS, held: Sequence[str] = ()
) -> Fitted:
    """`limit` more trials of a step from where a descent ended, as if it had not; `held` as there."""
    if not fitted.slope.finite:
        return fitted
    free = np.array([name not in held for name in nested.shared_names()])
    rest = np.ones(fitted.point.size - free.size, bool)
    free = np.flatnonzero(np.concatenate([free, rest]))
    choice, information = fitted.choice, _information(fitted.slope)
    for _ in range(limit):
        move = np.zeros(fitted.point.size)
        gradient = np.asarray(fitted.slope.gradient)[free]
        part = information[np.ix_(free, free)]
        move[free] = damped_move(part, gradient, fitted.damping)
        point = fitted.point + move
        found = _seen(nested, choice, point)
        gain = fitted.potential - float(found.potential)
        if gain > 0.0 and (slope := _slope(nested, choice, point)).finite:
            information = _information(slope)
            fitted = replace(
                fitted,
                point=point,
                potential=float(found.potential),
                found=found,
                slope=slope,
                damping=max(0.2 * fitted.damping, 1e-9),
            )
            # A step that was cut short gains little far from the end as well.
            if gain < LEAST_GAIN and np.abs(move).max() < CUT * LONGEST_MOVE:
                break
        else:
            fitted = replace(fitted, damping=6.0 * fitted.damping)
            if fitted.damping > MOST_DAMPING:
                break
    return fitted


def _seen(nested: Nested, choice: Choice, point: np.ndarray) -> Explained:
    return explained_at(jnp.asarray(point), choice, nested.layout, nested.data)


def _slope(nested: Nested, choice: Choice, point: np.ndarray) -> Slope:
    return slope_at(jnp.asarray(point), choice, nested.layout, nested.data)
