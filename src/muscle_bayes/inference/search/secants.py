"""The most probable point where derivatives jump: Gauss-Newton by wide differences."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from muscle_bayes.inference.search.damped_steps import damped_move
from muscle_bayes.inference.search.descent import Fitted
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.nested_programs import explained_at, slope_at

ROUNDS = 8
"""Steps at most."""
LEAST_GAIN = 0.05
"""Decrease of the potential that is not worth another round, once widths have settled."""
WIDEST = 0.3
"""Longest difference, in units of the unconstrained vector."""
SETTLED = 1.5
"""Largest factor by which widths still change when they have settled."""
DAMPINGS = (1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2)


@dataclass(frozen=True)
class Together:
    """Entries that are moved together: each acts on errors of its own alone."""

    entries: Int[np.ndarray, " entry"]
    owner: Int[np.ndarray, " error"]
    """Which of the entries acts on each error; -1 for none."""


def _groups(nested: Nested, used: int) -> list[Together]:
    """Entries to be moved one after the other: a run's own ones together with all other runs'."""
    names, data, layout = nested.shared_names(), nested.data, nested.layout
    shapes = [np.asarray(lanes.weight).shape for lanes in data.lanes]
    twice = [1 if lanes.again is None else 2 for lanes in data.lanes]
    sizes = [lanes * intervals * n for (lanes, intervals), n in zip(shapes, twice, strict=True)]
    own: dict[str, list[tuple[int, np.ndarray]]] = {}
    groups = []
    for entry in range(used):
        name = names[entry] if entry < len(names) else ""
        if not name.endswith("]"):
            groups.append(Together(np.array([entry]), np.zeros(sum(sizes), int)))
            continue
        regime, _, rest = name.partition(".")
        kind, _, index = rest.rstrip("]").partition("[")
        acts_on = [
            np.repeat(
                (np.asarray(lanes.run) == int(index)) & (lane_regime == regime), size // shape[0]
            )
            for lanes, lane_regime, size, shape in zip(
                data.lanes, layout.regimes, sizes, shapes, strict=True
            )
        ]
        own.setdefault(kind, []).append((entry, np.concatenate(acts_on)))
    for members in own.values():
        owner = np.full(sum(sizes), -1)
        for number, (_, mine) in enumerate(members):
            owner[mine] = number
        groups.append(Together(np.array([entry for entry, _ in members]), owner))
    return groups


def _flat(parts: Sequence) -> Float[np.ndarray, " error"]:
    return np.concatenate([np.asarray(part).ravel() for part in parts])


def _secants(
    nested: Nested,
    fitted: Fitted,
    groups: Sequence[Together],
    widths: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n error"]:
    """Changes of all errors across two widths, per unit; to one side where the other is impossible."""

    def errors_at(point: np.ndarray) -> np.ndarray | None:
        found = explained_at(jnp.asarray(point), fitted.choice, nested.layout, nested.data)
        if not np.isfinite(float(found.potential)):
            return None
        return _flat([fit.errors for fit in found.fits])

    slopes = np.zeros((fitted.used, fitted.errors.size))
    for group in groups:
        step = np.zeros(fitted.point.size)
        step[group.entries] = widths[group.entries]
        above, below = errors_at(fitted.point + step), errors_at(fitted.point - step)
        sides = 2.0 if above is not None and below is not None else 1.0
        if above is None and below is None:
            slopes[group.entries] = fitted.jacobian.T[group.entries]
            continue
        above = fitted.errors if above is None else above
        below = fitted.errors if below is None else below
        change = (above - below) / sides
        for number, entry in enumerate(group.entries):
            mine = group.owner == number
            slopes[entry, mine] = change[mine] / widths[entry]
    return slopes


def _with_secants(fitted: Fitted, slopes: Float[np.ndarray, "n error"]) -> Fitted:
    """The fit with these derivatives of its errors, and the gradient that they give."""
    change = slopes - fitted.jacobian.T
    gradient = np.asarray(fitted.slope.gradient).copy()
    gradient[: fitted.used] += change @ fitted.errors
    full = np.zeros((fitted.point.size, fitted.errors.size))
    full[: fitted.used] = slopes
    parts, start = [], 0
    for part in fitted.slope.errors:
        size = int(np.prod(part.shape[1:]))
        parts.append(jnp.asarray(full[:, start : start + size].reshape(part.shape)))
        start += size
    slope = fitted.slope._replace(errors=parts, gradient=jnp.asarray(gradient))
    return replace(fitted, slope=slope)


def _widths(fitted: Fitted) -> Float[np.ndarray, " n"]:
    """Conditional standard deviation of every entry that is used."""
    return np.minimum(1.0 / np.sqrt(np.diag(fitted.information)), WIDEST)


def _step(nested: Nested, fitted: Fitted) -> Fitted | None:
    """The first of ever more damped steps that descends; None if none does."""
    layout, data = nested.layout, nested.data
    gradient = np.asarray(fitted.slope.gradient)[: fitted.used]

    for damping in DAMPINGS:
        point = fitted.point.copy()
        point[: fitted.used] += damped_move(fitted.information, gradient, damping)
        found = explained_at(jnp.asarray(point), fitted.choice, layout, data)
        value = float(found.potential)
        if value < fitted.potential:
            slope = slope_at(jnp.asarray(point), fitted.choice, layout, data)
            return replace(fitted, point=point, potential=value, found=found, slope=slope)
    return None


def polished(nested: Nested, fitted: Fitted, rounds: int = ROUNDS) -> Fitted:
    """`fitted`, moved on where its derivatives tell of its closest neighbourhood only.

    Where a rotor starts and stops to move, a reading's derivative jumps, and a descent by derivatives
    ends in notches far narrower than the posterior. Here errors are linearised by differences over
    the conditional standard deviation of each entry, which they tell in turn. The derivatives of the
    fit that is returned, and so its information, are these differences; with no `rounds` it stays put.
    """
    groups, widths = _groups(nested, fitted.used), _widths(fitted)
    for _ in range(rounds):
        wide = _with_secants(fitted, _secants(nested, fitted, groups, widths))
        further = _step(nested, wide)
        wider = np.maximum(widths, _widths(wide))
        settled = bool(np.all(wider < SETTLED * widths))
        widths = wider
        gain = 0.0 if further is None else wide.potential - further.potential
        if settled and gain < LEAST_GAIN:
            return wide
        fitted = further or fitted
    return _with_secants(fitted, _secants(nested, fitted, groups, widths))
