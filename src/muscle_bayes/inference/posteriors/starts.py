"""What a run that was not fitted starts from: its own zero, first reading, speed and HYST."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro import distributions as dist

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.inference.model.density import lane_fits
from muscle_bayes.inference.model.lane_model import physical_of, plant_of, zeros_of
from muscle_bayes.inference.model.lanes import Lanes, padded_size
from muscle_bayes.inference.model.muscle_prior import resting_hyst
from muscle_bayes.inference.model.problem import Data, Layout, Problem
from muscle_bayes.inference.posteriors.predict import Draws
from muscle_bayes.inference.running.batches import of_rows
from muscle_bayes.inference.running.program import program
from muscle_bayes.inference.search.least_squares import least_squares
from muscle_bayes.physics.elements import Muscle
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.refinement import FineGrid
from muscle_bayes.physics.schedule import Schedule


def _resting_hyst(plant: Plant, q: Array, temperature: Array, load: Array):
    """sigma_hyst of side A's muscle with which it balances the load without friction."""
    muscle = plant.side_a
    assert isinstance(muscle, Muscle), "a slow run has its muscle on side A"
    tension = load * GRAVITY * plant.load_lever / muscle.linkage.lever(q)
    return muscle.hyst_under(tension, q, temperature)


def resting_starts(problem: Problem, draws: Draws) -> dict[str, Array]:
    """A first guess of the problem's own unknowns for runs that were not fitted, for each draw.

    Zero, first reading and first speed at the centre of their priors, which the first rows inform;
    HYST's first strain such that the rotor rests at the first reading without any friction, if
    side A has the muscle.
    """
    count = len(next(iter(draws.values())))
    result = dict(draws)
    for name, shape in problem.layout.shapes:
        if name not in result:
            centre = problem.data.priors[name].loc
            if isinstance(problem.data.priors[name], dist.LogNormal):
                centre = jnp.exp(centre)
            result[name] = jnp.broadcast_to(centre, (count, *shape))
    for lanes, regime in zip(problem.data.lanes, problem.layout.regimes, strict=True):
        name = f"{regime}.hyst_lag"
        free = lanes.imposed is None
        if free and name in problem.data.priors and isinstance(lanes.plant.side_a, Muscle):
            rest = partial(_resting_lag, problem=problem, lanes=lanes, regime=regime)
            lag = jax.vmap(rest)({key: result[key] for key, _ in problem.layout.shapes})
            result[name] = result[name].at[:, lanes.run].set(lag)
    return result


def _resting_lag(values, *, problem: Problem, lanes: Lanes, regime: str):
    """By how much HYST of every lane lags at the first row if the rotor rests there."""
    physical = physical_of(values, problem.layout, problem.data)
    zeros = zeros_of(values, lanes, regime, cut=False)
    start = values[f"{regime}.start"]

    def one(lane: Lanes, zero: Array) -> Array:
        plant = plant_of(lane.plant, physical, problem.layout)
        q = lane.scale * (start[lane.run] - zero)
        drive = lane.schedule.temperature[0, 0], lane.schedule.load[0]
        return _resting_hyst(plant, q, *drive) - resting_hyst(problem.data.tension, values)

    return jax.vmap(one)(lanes, zeros)


SETTLING_SHARE = 0.3
"""Share of an unfitted run that tells its own unknowns; the rest is predicted. Of three cycles nearly
one: from heating alone, zero and first stretch of HYST cannot be told apart."""
SETTLING_STEPS = 20
"""Most steps to a mode."""


def _beginning(lanes: Lanes, cuts: Array) -> Lanes:
    """The first `cuts` seconds of each lane: later readings do not count and are not simulated."""
    lanes = lanes._replace(weight=jnp.where(lanes.time <= cuts[:, None], lanes.weight, 0.0))
    nodes = int(jnp.max(jnp.sum(lanes.schedule.time <= cuts[:, None], axis=1)))
    size = min(padded_size(nodes + 1), lanes.time.shape[1])
    at_nodes, between = slice(size + 1), slice(size)
    schedule = lanes.schedule
    return lanes._replace(
        fine=None if lanes.fine is None else _first_steps(lanes.fine, size),
        schedule=Schedule(
            time=schedule.time[:, at_nodes],
            temperature=schedule.temperature[:, at_nodes],
            load=schedule.load[:, between],
            applied=schedule.applied[:, between],
        ),
        time=lanes.time[:, between],
        reading=lanes.reading[:, between],
        weight=lanes.weight[:, between],
        coarse=lanes.coarse[:, between],
        jolted=lanes.jolted[:, between],
        heat_variance=lanes.heat_variance[:, between],
        thermal=lanes.thermal[:, between],
        swing=lanes.swing[:, between],
        imposed=None if lanes.imposed is None else lanes.imposed[:, between],
    )


def _first_steps(grid: FineGrid, size: int) -> FineGrid:
    """The grid of the first `size` intervals."""
    steps = int(jnp.max(grid.end[:, size - 1])) + 1
    schedule = grid.schedule
    return FineGrid(
        Schedule(
            time=schedule.time[:, : steps + 1],
            temperature=schedule.temperature[:, : steps + 1],
            load=schedule.load[:, :steps],
            applied=schedule.applied[:, :steps],
        ),
        grid.middle[:, :size],
        grid.end[:, :size],
    )


def settled_starts(problem: Problem, draws: Draws, seed: int) -> dict[str, Array]:
    """Each run's own unknowns, drawn given the posterior draw and the first part of the run.

    For every draw of the shared parameters: Levenberg-Marquardt to the mode of zero, first reading,
    first speed and stretch of HYST, then a normal draw with the curvature there.
    """
    own = tuple(name for name, shape in problem.layout.shapes if shape)
    if not own:
        return dict(draws)
    cuts = {run.name: SETTLING_SHARE * run.duration for run in problem.runs}
    lanes = tuple(
        _beginning(group, jnp.array([cuts[problem.runs[i].name] for i in owners]))
        for group, owners in zip(problem.data.lanes, problem.lane_runs, strict=True)
    )
    data = problem.data._replace(lanes=lanes)
    unknowns = OwnUnknowns.of(own, dict(draws), data)

    shared = {name: np.asarray(value) for name, value in draws.items()}

    def looker(points: Sequence[np.ndarray], index: Sequence[int]) -> list[_Misfit]:
        rows = [
            (point, {name: value[i] for name, value in shared.items()}, unknowns, data)
            for point, i in zip(points, index, strict=True)
        ]
        return of_rows(_misfit, rows, problem.layout)

    starts = np.asarray(unknowns.start)
    rows = least_squares(looker, list(starts), (), SETTLING_STEPS)
    mode = np.stack([row.point for row in rows])
    information = np.stack([np.asarray(row.look.information) for row in rows])
    covariance = np.linalg.inv(information)
    kicks = jax.random.normal(jax.random.key(seed), mode.shape)
    free = mode + np.einsum("dij,dj->di", np.linalg.cholesky(covariance), kicks)
    return {**draws, **jax.vmap(unknowns.values)(jnp.asarray(free))}


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["start", "centre", "spread"],
    meta_fields=["names", "sizes", "logarithmic"],
)
@dataclass(frozen=True)
class OwnUnknowns:
    """The runs' own unknowns as one vector, logarithms where the prior is log-normal."""

    names: tuple[str, ...]
    sizes: tuple[int, ...]
    logarithmic: tuple[bool, ...]
    start: Float[Array, "draw free"]
    centre: Float[Array, " free"]
    """Prior means."""
    spread: Float[Array, " free"]
    """Prior standard deviations."""

    @classmethod
    def of(cls, names: tuple[str, ...], draws: dict[str, Array], data: Data) -> "OwnUnknowns":
        """Of these names, starting from their values in the draws."""
        priors = [data.priors[name] for name in names]
        logarithmic = tuple(isinstance(prior, dist.LogNormal) for prior in priors)
        starts = [
            jnp.log(draws[name]) if log else draws[name]
            for name, log in zip(names, logarithmic, strict=True)
        ]
        shapes = [prior.shape() for prior in priors]
        centres, spreads = (
            jnp.concatenate(
                [
                    jnp.broadcast_to(getattr(prior, key), shape)
                    for prior, shape in zip(priors, shapes, strict=True)
                ]
            )
            for key in ("loc", "scale")
        )
        sizes = tuple(int(shape[0]) for shape in shapes)
        return cls(names, sizes, logarithmic, jnp.concatenate(starts, axis=1), centres, spreads)

    def values(self, free: Float[Array, " free"]) -> dict[str, Array]:
        """Sampled values from one vector."""
        parts = jnp.split(free, np.cumsum(self.sizes)[:-1])
        return {
            name: jnp.exp(part) if log else part
            for name, log, part in zip(self.names, self.logarithmic, parts, strict=True)
        }


class _Misfit(NamedTuple):
    """A draw's own unknowns, as least squares looks at them."""

    potential: Float[Array, ""]
    gradient: Float[Array, " free"]
    information: Float[Array, "free free"]


@program
def _misfit(
    free: Array, values: dict[str, Array], unknowns: OwnUnknowns, layout: Layout, data: Data
) -> _Misfit:
    """Half the sum of the squared standardised errors of a draw, the prior's included."""

    def errors(free: Array) -> tuple[Array, Array]:
        fits = lane_fits({**values, **unknowns.values(free)}, layout, data)
        seen = jnp.concatenate([fit.errors.ravel() for fit in fits])
        found = jnp.concatenate([seen, (free - unknowns.centre) / unknowns.spread])
        return found, found

    slope, found = jax.jacfwd(errors, has_aux=True)(free)
    return _Misfit(0.5 * found @ found, slope.T @ found, slope.T @ slope)
