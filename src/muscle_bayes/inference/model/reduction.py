"""Slow motion without inertia: corrected for its error at the mode where that is small.

Where it is not, inertia is kept.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from muscle_bayes.data import Run
from muscle_bayes.inference.model.density import log_prior
from muscle_bayes.inference.model.lane_model import Values, physical_of, plant_of
from muscle_bayes.inference.model.lanes import Lanes
from muscle_bayes.inference.model.problem import Data, Layout, Problem
from muscle_bayes.inference.model.temperature_errors import with_temperature_errors
from muscle_bayes.inference.running.program import program
from muscle_bayes.inference.running.programs import (
    constrained_at,
    potential_at,
    solved_at,
    unconstrained,
)
from muscle_bayes.physics.refinement import FineGrid, refined, swing_rate
from muscle_bayes.physics.response import Response
from muscle_bayes.physics.state import Drive

TOLERANCE, SHARE = 0.5, 0.02
"""Largest RMS distance of a reduced run from one with full inertia: in the sensor's resolution or the
standard deviation of the run's misfit, or in the standard deviation of its readings, whichever is larger.
Swings so small depend on the drive's details, which no thermometer tells."""
SWING_STEP = 0.4
"""Steps with full inertia, in radians of the rotor's swing: half of it changes no distance by 1 %."""
LONGEST_STEP, SHORTEST_STEP = 0.02, 1e-3
"""Bounds of these steps, s."""
LEAST_STEPS = 2**14
"""Runs are padded to this many steps, half as many more, or twice either: few shapes to compile."""
MOST_STEPS = 2**20
"""Runs that take more steps than this with full inertia are solved without: they last for so many swings
that a swing is short beside what drives the slow motion."""
INERTIAS = (1.0, 1 / 8, 1 / 64)
"""Factors on a J that nothing has told yet."""
UNLIKELY = 10.0
"""Log prior density by which another J may fall short."""


class ReductionError(NamedTuple):
    """How far a run's reduced solution is from the one with full inertia, at the mode.

    Where the reduced solution is used, that distance, as it is at the mode, is added to it.
    """

    rms: float
    """[the log's unit]"""
    largest: float
    """[the log's unit]"""
    tolerance: float
    """RMS up to which the reduced solution is used [the log's unit]."""

    @property
    def solved(self) -> bool:
        """Whether full inertia could be solved; rms is not finite where it could not."""
        return bool(np.isfinite(self.rms))

    @property
    def tolerable(self) -> bool:
        """Whether the reduced solution is used: also without a solution with full inertia, for then
        there is no other."""
        return not (self.solved and self.rms > self.tolerance)


def _responses(values: Values, layout: Layout, data: Data) -> list[Response]:
    draws = {name: jnp.asarray(values[name])[None] for name, _ in layout.shapes}
    return solved_at(unconstrained(draws, layout, data)[0], layout, data).responses


@program
def _swing_rates(
    values: Values, response: Response, lanes: Lanes, layout: Layout, data: Data
) -> Float[Array, "lane interval"]:
    """Angular rate at which the rotor would swing, around every state of slow motion [rad/s]."""
    physical = physical_of(values, layout, data)

    def of_lane(lane: Lanes, response: Response) -> Array:
        plant = plant_of(lane.plant, physical, layout)
        schedule = lane.schedule
        drive = Drive(schedule.temperature[1:], schedule.load, schedule.applied)
        return jax.vmap(partial(swing_rate, plant))(response.sensed, response.hyst, drive)

    return jax.vmap(of_lane)(lanes, response)


def _padded(steps: int) -> int:
    """The least size that holds them of LEAST_STEPS times 1, 3/2, 2, 3, 4, 6..."""
    size = LEAST_STEPS
    while size < steps:
        size *= 2
    return 3 * size // 4 if size > LEAST_STEPS and steps <= 3 * size // 4 else size


def _longest_steps(rates: Float[np.ndarray, "lane interval"]) -> Float[np.ndarray, "lane interval"]:
    return np.clip(SWING_STEP / np.maximum(rates, 1e-9), SHORTEST_STEP, LONGEST_STEP)


def _fine(lanes: Lanes, rates: Float[np.ndarray, "lane interval"]) -> FineGrid:
    """Fine grids of all lanes, stacked."""
    longest = _longest_steps(rates)
    whole = jax.tree.map(np.asarray, lanes.schedule)
    schedules = [jax.tree.map(lambda x, i=i: x[i], whole) for i in range(len(longest))]
    sizes = [grid.schedule.load.size for grid in map(refined, schedules, longest)]
    size = _padded(max(sizes))
    parts = zip(schedules, longest, np.asarray(lanes.deceleration), strict=True)
    grids = [refined(one, limit, size, slowing) for one, limit, slowing in parts]
    return jax.tree.map(lambda *leaves: jnp.asarray(np.stack(leaves)), *grids)


def unsolved(errors: Mapping[str, ReductionError]) -> dict[str, ReductionError]:
    """The errors where full inertia, wanted, could not be solved: unknown.

    Seen on a heavy carriage that swings across the tension at which MODULUS shuts. Steps follow the
    swings of slow motion, 34 rad/s with MODULUS open; shut, at 490 rad/s, they are unstable. Motion
    stays bounded by the other side, but its derivatives grow tenfold every 13 steps and overflow.
    """
    return {
        name: one if one.tolerable else one._replace(rms=float("inf"))
        for name, one in errors.items()
    }


def _is_reduced(lanes: Lanes, regime: str) -> bool:
    return regime == "slow" and lanes.fine is None


def with_inertia(problem: Problem, values: Values, names: Collection[str]) -> Problem:
    """The problem with full inertia in the named runs, on grids that are fine enough at `values`.

    Runs that would take more than `MOST_STEPS` steps stay without.
    """
    if not names:
        return problem
    layout, data = problem.layout, problem.data
    reduced = _responses(values, layout, data)
    parts = []
    groups = zip(
        data.lanes, layout.regimes, layout.segmented, problem.lane_runs, reduced, strict=True
    )
    for lanes, regime, cut, owners, response in groups:
        chosen = np.array([problem.runs[i].name in names for i in owners])
        if not (_is_reduced(lanes, regime) and chosen.any()):
            parts.append((lanes, regime, cut, owners))
            continue
        rates = np.asarray(_swing_rates(values, response, lanes, layout, data))
        steps = np.sum(np.diff(np.asarray(lanes.schedule.time)) / _longest_steps(rates), axis=1)
        chosen &= steps <= MOST_STEPS
        for which, inertial in ((~chosen, False), (chosen, True)):
            if which.any():
                index = np.flatnonzero(which)
                part = jax.tree.map(lambda x, index=index: x[index], lanes)
                if inertial:
                    part = part._replace(
                        fine=_fine(part, rates[index]), swing=jnp.zeros_like(part.swing)
                    )
                parts.append((part, regime, cut, tuple(owners[i] for i in index)))
    columns = [tuple(column) for column in zip(*parts, strict=True)]
    all_lanes, regimes, segmented, lane_runs = columns
    return replace(
        problem,
        layout=replace(layout, regimes=regimes, segmented=segmented),
        data=data._replace(lanes=all_lanes),
        lane_runs=lane_runs,
    )


def without_swings(problem: Problem, names: Collection[str]) -> Problem:
    """The problem without what inertia adds to the slow motion of the named runs."""

    def cleared(lanes: Lanes, owners: tuple[int, ...]) -> Lanes:
        there = np.array([problem.runs[i].name in names for i in owners])
        return lanes._replace(swing=jnp.where(there[:, None], 0.0, lanes.swing))

    lanes = tuple(map(cleared, problem.data.lanes, problem.lane_runs))
    return replace(problem, data=problem.data._replace(lanes=lanes))


def _averages(
    problem: Problem, values: Values, *, inertial: bool = False
) -> dict[int, Float[np.ndarray, " interval"]]:
    """Mean readings of slow runs, by number of the run: of those reduced, or with full inertia."""
    layout, data = problem.layout, problem.data

    def is_wanted(lanes: Lanes, regime: str) -> bool:
        return regime == "slow" and (lanes.fine is not None) == inertial

    groups = list(zip(data.lanes, layout.regimes, layout.segmented, problem.lane_runs, strict=True))
    if inertial:  # the others need not be compiled with them
        groups = [one for one in groups if is_wanted(*one[:2])]
    if not any(is_wanted(*one[:2]) for one in groups):
        return {}
    lanes, regimes, cut, owners = (tuple(column) for column in zip(*groups, strict=True))
    layout = replace(layout, regimes=regimes, segmented=cut)
    responses = _responses(values, layout, data._replace(lanes=lanes))
    return {
        owner: np.asarray(response.averaged[lane])
        for one, regime, group, response in zip(lanes, regimes, owners, responses, strict=True)
        if is_wanted(one, regime)
        for lane, owner in enumerate(group)
    }


def _error_of(run: Run, away: Float[np.ndarray, " n"], values: Values) -> ReductionError:
    """How far the run with full inertia is `away` [the log's unit] from the reduced one."""
    misfit = np.hypot(values["slow.noise"], values["slow.discrepancy"])
    return ReductionError(
        rms=float(np.sqrt(np.mean(away**2))),
        largest=float(np.max(np.abs(away))),
        tolerance=max(
            TOLERANCE * max(run.sensor.resolution, float(misfit)),
            SHARE * float(run.table["reading"].std()),
        ),
    )


def with_swings(problem: Problem, values: Values) -> Problem:
    """The problem with what inertia adds at these values to every reduced run, and how much that is;
    and with what errors of the temperature add to the variance of readings.

    Slow motion plus a constant is right at `values` and, to first order, near them: what stays is how
    the rotor's swings change with the parameters.
    """
    names = [run.name for run in problem.runs]
    problem = with_temperature_errors(without_swings(problem, names), values)
    data = problem.data
    reduced = _averages(problem, values)
    if not reduced:
        return problem
    names = [problem.runs[i].name for i in reduced]
    full = _averages(with_inertia(problem, values, names), values, inertial=True)
    errors = {}
    swings = [np.array(lanes.swing) for lanes in data.lanes]
    for group, owners in enumerate(problem.lane_runs):
        for lane, owner in enumerate(owners):
            if owner not in reduced:
                continue
            run = problem.runs[owner]
            lasting = np.diff(np.asarray(data.lanes[group].schedule.time[lane])) > 0.0
            away = full.get(owner, np.full_like(lasting, np.nan, float)) - reduced[owner]
            errors[run.name] = _error_of(run, away[lasting], values)
            solved = np.isfinite(away[lasting]).all()
            swings[group][lane] = np.where(lasting & solved, away, 0.0)
    parts = [
        lanes._replace(swing=jnp.asarray(swing))
        for lanes, swing in zip(data.lanes, swings, strict=True)
    ]
    return replace(
        problem,
        data=data._replace(lanes=tuple(parts)),
        reduction={**problem.reduction, **errors},
    )


def with_likely_inertia(problem: Problem, vector: Float[Array, " n"]) -> Float[Array, " n"]:
    """The vector, with the likeliest of a few J where only slow runs tell of it and it matters to them.

    Their mode without inertia knows nothing of J, so that its prior's median stands there: with such a
    rotor they may swing as no reading does.
    """
    layout, data = problem.layout, problem.data
    names = [name for name, shape in layout.shapes for _ in range(int(np.prod(shape)))]
    if "J" not in names or set(layout.regimes) != {"slow"}:
        return vector
    place, levels = names.index("J"), {}
    for factor in INERTIAS:
        moved = vector.at[place].add(np.log(factor))
        if log_prior(moved, layout, data) < log_prior(vector, layout, data) - UNLIKELY:
            continue
        swung = with_swings(problem, constrained_at(moved, layout, data))
        if factor == 1.0 and all(error.tolerable for error in swung.reduction.values()):
            return vector
        levels[factor] = potential_at(moved, layout, swung.data)
    return vector.at[place].add(np.log(min(levels, key=levels.__getitem__)))


def solved_adequately(problem: Problem, values: Values) -> Problem:
    """The problem with full inertia wherever leaving it out changes readings by too much.

    And, elsewhere, with what it changes added.
    """
    problem = with_swings(problem, values)
    poor = [name for name, error in problem.reduction.items() if not error.tolerable]
    return with_inertia(problem, values, poor)
