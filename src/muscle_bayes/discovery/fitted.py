"""A model of a search: where its descent begins, and its most probable point."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from muscle_bayes.inference.model.discrepancy import LOG_2PI
from muscle_bayes.inference.model.noise import NoiseParameters
from muscle_bayes.inference.model.problem import Data
from muscle_bayes.inference.search.factored import FactoredPrecision
from muscle_bayes.inference.search.nested import Choice, Nested
from muscle_bayes.inference.search.nested_programs import Explained, Look, values_of


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
    def seen(self) -> Explained:
        """How the point explains the readings."""
        return self.look.seen

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
        return np.asarray(self.seen.errors)

    @cached_property
    def log_densities(self) -> Float[np.ndarray, " error"]:
        """Log density of each observed reading given the earlier ones; 0 where none."""
        return np.asarray(self.seen.log_densities)

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


def noise_names(nested: Nested) -> list[str]:
    """Names of the noise parameters among the shared entries."""
    keys = NoiseParameters._fields
    return [name for name in nested.shared_names() if name.rpartition(".")[2] in keys]


def first_share(data: Data, share: float, fewest: int = 12) -> Data:
    """The data with this share of every lane's observed intervals, from the first on; `fewest` at least."""
    lanes = []
    for group in data.lanes:
        weight = np.asarray(group.weight)
        rank = np.cumsum(weight > 0, axis=1)
        seen = rank <= np.maximum(share * rank[:, -1:], fewest)
        lanes.append(group._replace(weight=jnp.asarray(np.where(seen, weight, 0.0))))
    return data._replace(lanes=tuple(lanes))


def whole_weights(nested: Nested, data: Data) -> Data:
    """The data with every reading counted again."""
    pairs = zip(data.lanes, nested.data.lanes, strict=True)
    return data._replace(lanes=tuple(one._replace(weight=all_.weight) for one, all_ in pairs))


def sampled_values(nested: Nested, fitted: Fitted) -> dict[str, Any]:
    """What is sampled at a fit, effects that are not on off: `nested.point` makes a point of it again."""
    found = values_of(fitted.point, fitted.choice, nested.layout, fitted.data)
    values: dict[str, Any] = {name: np.asarray(found[name]) for name, _ in nested.layout.shapes}
    for regime, least in nested.least.items():
        # What is allowed in any case comes on top again.
        size = values[f"{regime}.discrepancy"]
        values[f"{regime}.discrepancy"] = np.sqrt(max(size**2 - least**2, (1e-6 * size) ** 2))
    return values
