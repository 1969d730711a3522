"""Fit all: every candidate from every start is a row of one batch of least squares."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from time import monotonic
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from muscle_bayes.discovery.fitted import Fitted, Start, sampled_values, whole_weights
from muscle_bayes.inference.model.lane_model import Values
from muscle_bayes.inference.model.problem import Data
from muscle_bayes.inference.model.reduction import with_swings
from muscle_bayes.inference.running.batches import of_rows
from muscle_bayes.inference.running.programs import unconstrained
from muscle_bayes.inference.search.least_squares import Row, least_squares
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.nested_programs import (
    Explained,
    Look,
    explained_at,
    look_at,
    values_of,
)
from muscle_bayes.inference.search.pivots import pivoted
from muscle_bayes.inference.search.secants import Carried, carried
from muscle_bayes.progress import Report, silent


class OutOfTime(Exception):
    """The budget is spent."""


@dataclass
class Search:
    """One model with every candidate, and how its rows are fitted: what each step of discovery takes."""

    nested: Nested
    noise: Mapping[str, float] = field(default_factory=dict)
    """White noise of a reading in each regime [the log's unit]."""
    seed: int = 0
    held: tuple[str, ...] = ()
    """Names of runs that are held out."""
    workers: int = 1
    """Rows that are evaluated side by side; results do not depend on it."""
    report: Report = silent
    deadline: float = np.inf
    """By which an answer is wanted, as `time.monotonic` counts."""

    @property
    def patient(self) -> "Search":
        """The same without a deadline, for what is always done to its end."""
        return replace(self, deadline=np.inf)

    def tick(self) -> None:
        """Raise where time is up."""
        if monotonic() > self.deadline:
            raise OutOfTime

    def fit(
        self,
        starts: Sequence[Start],
        held: Sequence[str] = (),
        steps: int = 40,
        *,
        behind: float = np.inf,
        groups: Sequence[Hashable] | None = None,
    ) -> list[Fitted]:
        """Descend from all starts together; entries named in `held` stay. A fit for each start.

        Rows that fall `behind` the best of their group [nat] rest. No step leads to a point whose
        derivatives are not finite; a start that has none keeps its point and the potential inf.
        """
        rows = self.descended(starts, held, steps, behind=behind, groups=groups)
        old = [index for index, row in enumerate(rows) if row.age]
        sure = self._looked([starts[k]._replace(point=rows[k].point) for k in old])
        for index, look in zip(old, sure, strict=True):
            rows[index] = replace(rows[index], look=look)
        nested = self.nested
        return [
            Fitted(
                start.effects,
                row.point,
                start.data,
                nested.choice(start.effects),
                row.look,
                nested.shared + len(nested.slots_of(start.effects)),
            )
            for start, row in zip(starts, rows, strict=True)
        ]

    def descended(
        self,
        starts: Sequence[Start],
        held: Sequence[str] = (),
        steps: int = 40,
        *,
        behind: float = np.inf,
        groups: Sequence[Hashable] | None = None,
    ) -> list[Row[Look]]:
        """As `fit`, but derivatives at the ends may be secants'."""

        def at(points: Sequence[np.ndarray], index: Sequence[int]) -> list[Start]:
            self.tick()
            return [starts[k]._replace(point=p) for p, k in zip(points, index, strict=True)]

        def looker(points: Sequence[np.ndarray], index: Sequence[int]) -> list[Look]:
            return self._looked(at(points, index))

        def glancer(
            points: Sequence[np.ndarray], index: Sequence[int], rows: Sequence[Row[Look]]
        ) -> list[Look]:
            seen = self.explained(at(points, index))
            return [
                _carried(row, there, point)
                for row, there, point in zip(rows, seen, points, strict=True)
            ]

        stay = [i for i, name in enumerate(self.nested.shared_names()) if name in held]
        return least_squares(
            looker,
            [start.point for start in starts],
            stay,
            steps,
            glancer=glancer,
            least_gain=0.1,
            behind=behind,
            groups=groups,
        )

    def _looked(self, starts: Sequence[Start]) -> list[Look]:
        """Every start, with derivatives."""
        rows = [(start.point, self.nested.choice(start.effects), start.data) for start in starts]
        return jax.device_get(self._evaluated(look_at, rows))

    def explained(self, starts: Sequence[Start]) -> list[Explained]:
        """How every start explains the readings, without derivatives."""
        rows = [(start.point, self.nested.choice(start.effects), start.data) for start in starts]
        return jax.device_get(self._evaluated(explained_at, rows))

    def _evaluated(self, program: Callable[..., Any], rows: Sequence[tuple]) -> list[Any]:
        """A program of every row; points of one size share what is compiled."""
        found: dict[int, Any] = {}
        for size in sorted({row[0].size for row in rows}):
            chosen = [k for k, row in enumerate(rows) if row[0].size == size]
            same = [rows[k] for k in chosen]
            parts = of_rows(program, same, self.nested.layout, self.workers)
            found |= zip(chosen, parts, strict=True)
        return [found[k] for k in range(len(rows))]

    def misfit(self, residuals: Sequence, data: Data) -> dict[str, tuple[float, float]]:
        """RMS residual of each regime's intervals [log's unit], and the readings in a usual interval."""
        found: dict[str, tuple[float, float]] = {}
        regimes = self.nested.layout.regimes
        for regime in sorted(set(regimes)):
            groups = [k for k, name in enumerate(regimes) if name == regime]
            weights = [np.asarray(data.lanes[k].weight) for k in groups]
            seen = np.concatenate([w[w > 0] for w in weights])
            parts = [np.asarray(residuals[k])[w > 0] for k, w in zip(groups, weights, strict=True)]
            rms = float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
            found[regime] = (rms if np.isfinite(rms) else 1e6, float(np.median(seen)))
        return found

    def is_gross(self, fitted: Fitted, times: float = 3.0) -> bool:
        """Whether the misfit of some regime is so many times the noise of a reading."""
        levels = self.misfit(fitted.seen.residuals, fitted.data)
        return any(rms > times * self.noise[regime] for regime, (rms, _) in levels.items())

    def is_lost(self, fitted: Fitted, share: float = 0.1) -> bool:
        """Whether in some run the misfit's RMS is over this share of the readings' standard deviation.

        Of runs that are solved from their start alone: segments begin anew where the readings are.
        """
        groups = zip(
            fitted.seen.residuals, fitted.data.lanes, self.nested.layout.segmented, strict=True
        )
        for residuals, lanes, cut in groups:
            for residual, reading, weight in zip(
                residuals, lanes.reading, lanes.weight, strict=True
            ):
                seen = np.asarray(weight) > 0
                if not cut and seen.any():
                    spread = np.std(np.asarray(reading)[seen])
                    if np.sqrt(np.mean(np.asarray(residual)[seen] ** 2)) > share * spread:
                        return True
        return False

    def with_shared(self, start: Start, values: Mapping[str, float]) -> Start:
        """The start with other values of shared, positive quantities."""
        names, point = self.nested.shared_names(), start.point.copy()
        for name, value in values.items():
            point[names.index(name)] = np.log(max(value, 1e-300))
        return start._replace(point=point)

    def settled(self, fitted: Fitted, rounds: int = 3) -> Fitted:
        """The fit with what its own point tells of the motion, and fitted with it.

        Slow runs leave inertia out but for what it adds at one point, and segments are linear in their
        starts about those that were most probable at one point. A model counts by the density with the
        motion of its own point alone: of rounds, each with the motion of the last, the likeliest such.
        """
        best = self._with_own_motion(fitted)
        for _ in range(rounds - 1):
            (further,) = self.fit([best.start])
            trial = self._with_own_motion(further)
            if not trial.potential < best.potential - 1.0:
                break
            best = trial
        return best

    def _with_own_motion(self, fitted: Fitted) -> Fitted:
        """The data with segments' pivots, and with what inertia adds, at the fit's own point."""
        nested = self.nested
        values, data = self._pivoted(fitted, fitted.data)
        data = with_swings(replace(nested.problem, data=data), values).data
        (found,) = self.fit([fitted.start._replace(data=data)], steps=0)
        return found

    def whole(self, fitted: Fitted) -> Start:
        """The fit's point with every reading counted: of held-out segments, too, these tell the start."""
        return fitted.start._replace(
            data=self._pivoted(fitted, whole_weights(self.nested, fitted.data))[1]
        )

    def _pivoted(self, fitted: Fitted, data: Data) -> tuple[Values, Data]:
        """The fit's values, and the data with segments' pivots where they put them."""
        layout = self.nested.layout
        values = values_of(fitted.point, fitted.choice, layout, data)
        draws = {name: jnp.asarray(values[name])[None] for name, _ in layout.shapes}
        return values, pivoted(unconstrained(draws, layout, data)[0], layout, data)

    def slow(self, fitted: Fitted) -> Fitted:
        """The fit without what inertia adds to slow motion, which is one point's own."""
        lanes = tuple(one._replace(swing=jnp.zeros_like(one.swing)) for one in fitted.data.lanes)
        (found,) = self.fit([fitted.start._replace(data=fitted.data._replace(lanes=lanes))])
        return found

    def with_effects(self, fitted: Fitted, effects: Sequence[str]) -> Start:
        """A start of the model with some of the fit's effects alone, in this order."""
        point = self.nested.point(sampled_values(self.nested, fitted), effects)
        return Start(tuple(effects), point, fitted.data)


def _carried(row: Row[Look], there: Explained, point: Float[np.ndarray, " n"]) -> Look:
    """A look near a row's, with secants."""
    look, move = row.look, point - row.point
    known = Carried(*map(np.asarray, look[1:]))
    if not (np.isfinite(there.potential) and np.isfinite(there.parts).all()):
        return Look(there, *known)
    return Look(there, *carried(look.seen, known, there, move))
