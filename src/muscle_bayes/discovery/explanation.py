"""A model fitted to the runs, and the search that found it."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from muscle_bayes.discovery.holding import without_runs
from muscle_bayes.discovery.search import Report
from muscle_bayes.inference.model.lane_model import Values
from muscle_bayes.inference.model.problem import Problem
from muscle_bayes.inference.model.reduction import with_swings, without_swings
from muscle_bayes.inference.running.programs import unconstrained
from muscle_bayes.inference.search.descent import Fitted, descend
from muscle_bayes.inference.search.nested import Nested, values_at
from muscle_bayes.inference.search.pivots import pivoted
from muscle_bayes.inference.search.secants import polished

SETTLED = 1.0
"""Rise of the log density below which a fit and what its point tells of the motion agree [nat]."""
MOST_ROUNDS = 4


@dataclass(frozen=True)
class Search:
    """What every step needs."""

    whole: Nested
    train: Nested
    """The same, held-out runs known by their starts only."""
    held: tuple[str, ...]
    seed: int
    report: Report
    workers: int = 1
    """Candidates that are searched side by side; results do not depend on it."""

    def over(self, nested: Nested) -> "Search":
        """The same search in another nested model."""
        return replace(self, whole=nested, train=nested.on(without_runs(nested.problem, self.held)))

    def without_swings(self) -> "Search":
        """The same search in slow motion alone: what inertia adds to it is one point's own."""
        return self.over(self.whole.on(without_swings(self.whole.problem)))


@dataclass(frozen=True)
class Explanation:
    """A model at its most probable point, in the nested model it was searched in."""

    search: Search
    fitted: Fitted

    def settled(self) -> "Explanation":
        """The same with what its own point tells of the motion, and fitted with it.

        A search adds what inertia did to slow motion at the point where it began, and is linear in
        segments' starts about those that were most probable there; an effect that moves the
        parameters far makes the rotor swing, and segments begin, otherwise. A point counts by the
        density with its own motion alone.
        """
        found = self._with_own_motion()
        for _ in range(MOST_ROUNDS - 1):
            nested, here = found.search.train, found.fitted
            further = Explanation(found.search, descend(nested, here.effects, here.point))
            # Far from where it was solved the motion is wrong, and may look likelier than any.
            trial = further._with_own_motion()
            if not trial.fitted.potential < here.potential - SETTLED:
                break
            found = trial
        return found

    def polished(self) -> Fitted:
        """The fit with derivatives over the posterior's width (`secants`), which may move it on.

        It stays where it is if the point it would move to is less likely with its own motion.
        """
        train, here = self.search.train, self.fitted
        found = polished(train, here)
        judged = Explanation(self.search, found)._with_own_motion().fitted
        worse = not judged.potential <= here.potential + SETTLED
        return polished(train, here, rounds=0) if worse else found

    def _with_own_motion(self) -> "Explanation":
        nested, fitted = self.search.whole, self.fitted
        values = values_at(jnp.asarray(fitted.point), fitted.choice, nested.layout, nested.data)
        search = self.search.over(nested.on(_solved(nested.problem, values)))
        return Explanation(search, descend(search.train, fitted.effects, fitted.point, 0))


def _solved(problem: Problem, values: Values) -> Problem:
    """With segments' pivots, and with what inertia adds, at these values."""
    draws = {name: jnp.asarray(values[name])[None] for name, _ in problem.layout.shapes}
    vector = unconstrained(draws, problem.layout, problem.data)[0]
    data = pivoted(vector, problem.layout, problem.data)
    return with_swings(replace(problem, data=data), values)
