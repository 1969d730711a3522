"""A model fitted to the runs, and the search that found it."""

from dataclasses import dataclass, replace

import jax.numpy as jnp

from muscle_bayes.discovery.holding import without_runs
from muscle_bayes.discovery.search import Report
from muscle_bayes.inference.descent import Fitted, descend
from muscle_bayes.inference.lane_model import Values
from muscle_bayes.inference.nested import Nested, values_at
from muscle_bayes.inference.pivots import pivoted
from muscle_bayes.inference.problem import Problem
from muscle_bayes.inference.programs import unconstrained
from muscle_bayes.inference.reduction import with_swings

SETTLED = 1.0
"""Change of the log density below which a fit and what inertia adds to it agree [nat]."""
MOST_ROUNDS = 3


@dataclass(frozen=True)
class Search:
    """What every step needs."""

    whole: Nested
    train: Nested
    """The same, held-out runs known by their starts only."""
    held: tuple[str, ...]
    seed: int
    report: Report

    def over(self, nested: Nested) -> "Search":
        """The same search in another nested model."""
        return replace(self, whole=nested, train=nested.on(without_runs(nested.problem, self.held)))


@dataclass(frozen=True)
class Explanation:
    """A model at its most probable point, in the nested model it was searched in."""

    search: Search
    fitted: Fitted

    def settled(self) -> "Explanation":
        """The same with what its own point tells of the motion, and fitted with it.

        A search adds what inertia did to slow motion at the point where it began, and is linear in
        segments' starts about those that were most probable there; an effect that moves the
        parameters far makes the rotor swing, and segments begin, otherwise.
        """
        search, fitted = self.search, self.fitted
        for _ in range(MOST_ROUNDS):
            nested = search.whole
            values = values_at(jnp.asarray(fitted.point), fitted.choice, nested.layout, nested.data)
            before = fitted.potential
            search = search.over(nested.on(_solved(nested.problem, values)))
            fitted = descend(search.train, fitted.effects, fitted.point)
            if abs(before - fitted.potential) < SETTLED:
                break
        return Explanation(search, fitted)


def _solved(problem: Problem, values: Values) -> Problem:
    """With segments' pivots, and with what inertia adds, at these values."""
    draws = {name: jnp.asarray(values[name])[None] for name, _ in problem.layout.shapes}
    vector = unconstrained(draws, problem.layout, problem.data)[0]
    data = pivoted(vector, problem.layout, problem.data)
    return with_swings(replace(problem, data=data), values)
