"""Levenberg-Marquardt of many rows at once: the package's one implementation of least squares.

optimistix solves one problem a call. Here rows of a batch differ in what is free and in their data, end one
by one, and stop early where they fall behind; what is evaluated together is left to the caller.
"""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from jaxtyping import Float

from muscle_bayes.inference.search.factored import FactoredPrecision


class Look(Protocol):
    """A point, seen. May hold more than this."""

    @property
    def potential(self) -> Any:
        """What is minimised; not finite where the point is out of bounds."""

    @property
    def gradient(self) -> Any:
        """Of the potential, in the entries of the row."""

    @property
    def information(self) -> Any:
        """Its Gauss-Newton Hessian, positive definite."""


@dataclass(frozen=True)
class Row[L: Look]:
    """Where one descent stands."""

    point: Float[np.ndarray, " n"]
    look: L
    damping: float = 1e-2
    steps: int = 0
    ended: bool = False
    age: int = 0
    """Steps since derivatives were evaluated: those of the look are secants' where it is not 0."""
    sure: "Row[L] | None" = None
    """Where derivatives were evaluated last, if not here."""

    @cached_property
    def potential(self) -> float:
        """inf where anything of the look is not finite: no step leads there."""
        parts = self.look.potential, self.look.gradient, self.look.information
        return float(parts[0]) if all(np.isfinite(part).all() for part in parts) else np.inf


type Looker[L: Look] = Callable[[Sequence[np.ndarray], Sequence[int]], Sequence[L]]
"""Looks at points, given with the numbers of their rows."""
type Glancer[L: Look] = Callable[
    [Sequence[np.ndarray], Sequence[int], Sequence[Row[L]]], Sequence[L]
]
"""Looks at points near their rows' without derivatives of the model, which are the rows' and secants'."""


def least_squares[L: Look](
    looker: Looker[L],
    starts: Sequence[np.ndarray],
    held: Sequence[int] = (),
    steps: int = 60,
    *,
    glancer: Glancer[L] | None = None,
    oldest: int = 4,
    least_gain: float = 1e-3,
    longest: float = 2.0,
    behind: float = np.inf,
    groups: Sequence[Hashable] | None = None,
) -> list[Row[L]]:
    """Descend from every start, damped until a step descends.

    With a `glancer`, derivatives are updated by secants (Broyden) and evaluated anew where a step fails,
    promises little, or is the `oldest` since they were. Source: Madsen, Nielsen and Tingleff, Methods for
    Non-Linear Least Squares Problems (2004), section 3.5.

    Args:
        looker: evaluates points of several rows.
        starts: first points.
        held: entries that stay.
        steps: most trials of a step for each row.
        glancer: see above; default: derivatives are evaluated at every trial.
        oldest: see above.
        least_gain: decrease of the potential below which a row ends, made or promised.
        longest: longest step of any entry; many prior standard deviations at once leave the region in
            which the model is good. A step that was cut short ends no row.
        behind: rows whose potential is higher than the least of their group by more than this rest.
        groups: of each row; default: all rows are one.

    Returns:
        A row for each start; derivatives of those whose age is not 0 are secants'. Starts that cannot
        be evaluated have the potential inf.
    """
    groups = [0] * len(starts) if groups is None else groups
    looks = looker(starts, range(len(starts)))
    rows = [Row(np.asarray(p, float), look) for p, look in zip(starts, looks, strict=True)]
    for _ in range(steps):
        best: dict[Hashable, float] = {}
        for group, row in zip(groups, rows, strict=True):
            best[group] = min(row.potential, best.get(group, np.inf))
        active = [
            index
            for index, row in enumerate(rows)
            if not row.ended
            and np.isfinite(row.potential)
            and row.potential <= best[groups[index]] + behind
        ]
        if not active:
            break
        trials = [rows[i].point + damped_move(rows[i], held, longest) for i in active]
        if glancer is None:
            seen = looker(trials, active)
        else:
            seen = glancer(trials, active, [rows[i] for i in active])
        age = 0 if glancer is None else 1
        for index, trial, look in zip(active, trials, seen, strict=True):
            there = Row(trial, look, age=age * (rows[index].age + 1))
            rows[index] = _judged(rows[index], there, least_gain, longest)
        old = [i for i in active if rows[i].age and (rows[i].ended or rows[i].age >= oldest)]
        anew = looker([rows[i].point for i in old], old) if old else []
        for index, look in zip(old, anew, strict=True):
            rows[index] = _renewed(rows[index], look, held, least_gain, longest)
    return rows


def damped_move(row: Row, held: Sequence[int], longest: float) -> Float[np.ndarray, " n"]:
    """Minimum of g'd + d'(I + damping diag I)d / 2 but in the entries held, cut to `longest` in any."""
    gradient, information = np.asarray(row.look.gradient), np.asarray(row.look.information)
    chosen = np.setdiff1d(np.arange(gradient.size), np.asarray(held, int))
    part = information[np.ix_(chosen, chosen)]
    move = np.zeros(gradient.size)
    damped = FactoredPrecision(part + row.damping * np.diag(np.diag(part)))
    move[chosen] = -damped.solve(gradient[chosen])
    return move * min(1.0, longest / max(np.abs(move).max(), 1e-300))


def _promised(row: Row, move: Float[np.ndarray, " n"]) -> float:
    """Decrease of the potential along a move, were it quadratic."""
    bend = np.asarray(row.look.information) @ move
    return -float(move @ (np.asarray(row.look.gradient) + 0.5 * bend))


def _judged[L: Look](row: Row[L], trial: Row[L], least_gain: float, longest: float) -> Row[L]:
    """The row after a trial of a step. It ends where the step gained, or had promised, little.

    With secants it ends also where a step failed: until its derivatives are evaluated.
    """
    gain, move, steps = row.potential - trial.potential, trial.point - row.point, row.steps + 1
    if not gain > 0.0:
        ended = row.age > 0 or _promised(row, move) < least_gain
        return replace(row, damping=6.0 * row.damping, steps=steps, ended=ended)
    cut = np.abs(move).max() > 0.99 * longest
    ended, damping = gain < least_gain and not cut, max(0.2 * row.damping, 1e-9)
    sure = None if trial.age == 0 else row.sure or row
    return replace(trial, damping=damping, steps=steps, ended=ended, sure=sure)


def _renewed[L: Look](
    row: Row[L], look: L, held: Sequence[int], least_gain: float, longest: float
) -> Row[L]:
    """The row with its derivatives; back where they were evaluated last if here they are not finite."""
    found = replace(row, look=look, age=0, sure=None, ended=False)
    if not np.isfinite(found.potential) and row.sure is not None:
        return replace(row.sure, damping=36.0 * row.sure.damping, steps=row.steps)
    promised = _promised(found, damped_move(found, held, longest))
    return replace(found, ended=promised < least_gain)
