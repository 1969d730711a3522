"""The most probable model without any candidate: where discovery starts from."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro import distributions as dist

from muscle_bayes.conventions import Friction
from muscle_bayes.data.run import Run
from muscle_bayes.discovery.holding import without_runs
from muscle_bayes.discovery.tolerance import tolerated
from muscle_bayes.inference.model.density import unconstrain
from muscle_bayes.inference.model.muscle_prior import strain_under
from muscle_bayes.inference.model.problem import Problem, pose
from muscle_bayes.inference.model.reduction import with_swings
from muscle_bayes.inference.records.regime import regime_of
from muscle_bayes.inference.running.programs import constrained_at
from muscle_bayes.inference.search.mode import Mode, find_mode, refine
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.pivots import pivoted
from muscle_bayes.physics.effect import MUSCLE_PORTS
from muscle_bayes.physics.effects import effect_type

FIXTURE_SPREAD = 0.1
"""Standard deviation of log J and log D that runs without a muscle give to the search with one: more
than they know, for a missing effect misleads them."""


class Nominal(NamedTuple):
    """A problem without candidates, and its mode."""

    problem: Problem
    """With segments' pivots, and with what inertia adds to slow motion."""
    mode: Mode


def nominal(
    runs: Sequence[Run],
    friction: Friction,
    effects: Sequence[str],
    seed: int,
    hold_out: Sequence[str] = (),
) -> Nominal:
    """Search the mode of all runs: first of those without a muscle, then of those with one.

    Runs in `hold_out` count with their first part only.
    """
    key = jax.random.key(seed)
    problem = pose(runs, friction, effects)
    seen = without_runs(problem, hold_out)
    parts = [[run for run in runs if regime_of(run) == regime] for regime in ("fast", "slow")]
    if not all(parts):
        return _improved(problem, find_mode(key, seen.layout, seen.data), hold_out)
    rotor = [name for name in effects if acts_on_rotor(name)]
    first = without_runs(pose(parts[0], friction, rotor), hold_out)
    found = find_mode(key, first.layout, first.data)
    values = constrained_at(found.vector, first.layout, first.data)
    known = {name: dist.LogNormal(np.log(values[name]), FIXTURE_SPREAD) for name in ("J", "D")}
    second = without_runs(pose(parts[1], friction, effects, known), hold_out)
    found = find_mode(key, second.layout, second.data)
    muscle = _referred(constrained_at(found.vector, second.layout, second.data), second, problem)
    # J and D as the runs without a muscle tell them: a larger D could hold their rotor still, and
    # nothing would tell the descent how to free it.
    both = muscle | values
    start = Mode(unconstrain(both, problem.layout, problem.data), np.inf, jnp.zeros((0, 0)), 0)
    return _improved(problem, refine(start, seen.layout, seen.data), hold_out)


def _improved(problem: Problem, mode: Mode, hold_out: Sequence[str]) -> Nominal:
    """With what inertia adds to slow motion at a mode, and that once more at the new mode."""
    seen = without_runs(_solved(problem, mode), hold_out)
    mode = refine(mode, seen.layout, seen.data)
    return Nominal(_solved(problem, mode), mode)


def _solved(problem: Problem, mode: Mode) -> Problem:
    problem = replace(problem, data=pivoted(mode.vector, problem.layout, problem.data))
    # Also where it is more than a fit would leave to slow motion: each candidate would cost minutes,
    # and what inertia adds is found anew with every effect.
    return with_swings(problem, constrained_at(mode.vector, problem.layout, problem.data))


def acts_on_rotor(effect: str) -> bool:
    """Whether an effect acts without a muscle as well."""
    return effect_type(effect).port not in MUSCLE_PORTS


def _referred(values: dict[str, Any], told: Problem, asked: Problem) -> dict[str, Array]:
    """Values of a muscle's problem in the reference tension of another with more runs."""
    before, after = told.data.tension, asked.data.tension
    values = dict(values)
    relaxed = values["taut_strain"] - strain_under(before, values)
    return values | {"taut_strain": relaxed + strain_under(after, values)}


def nest(start: Nominal, candidates: Sequence[str]) -> tuple[Nested, Float[np.ndarray, " n"]]:
    """The nested model of these candidates over the nominal problem, and the nominal mode in it."""
    problem = start.problem
    kept = problem.layout.effects
    posed = pose(problem.runs, problem.layout.friction, (*kept, *candidates))
    layout = replace(
        posed.layout, regimes=problem.layout.regimes, segmented=problem.layout.segmented
    )
    data = posed.data._replace(lanes=problem.data.lanes)
    whole = replace(
        posed, layout=layout, data=data, lane_runs=problem.lane_runs, reduction=problem.reduction
    )
    nested = Nested(whole, tolerated(whole))
    values = constrained_at(start.mode.vector, problem.layout, problem.data)
    return nested, nested.point(values, kept)
