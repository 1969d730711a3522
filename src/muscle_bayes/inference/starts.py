"""What a run that was not fitted starts from: its own zero, first reading, speed and HYST."""

from functools import partial

import jax
import jax.numpy as jnp
import numpyro.distributions as dist
from jax.flatten_util import ravel_pytree
from jaxtyping import Array

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.inference.density import lane_fits
from muscle_bayes.inference.lane_model import physical_of, plant_of
from muscle_bayes.inference.predict import Draws
from muscle_bayes.inference.problem import Data, Lanes, Layout, Problem
from muscle_bayes.physics.element import Muscle
from muscle_bayes.physics.plant import Plant


def _resting_hyst(plant: Plant, q: Array, temperature: Array, load: Array):
    """sigma_hyst of side A's muscle with which it balances the load without friction.

    The MODULUS spring is taken in its linear range, where a taut muscle is.
    """
    muscle = plant.side_a
    assert isinstance(muscle, Muscle), "a slow run has its muscle on side A"
    lever = muscle.linkage.lever(q)
    tension = load * GRAVITY * plant.load_lever / lever
    parameters = muscle.parameters
    room = muscle.room_temperature
    effective = room + muscle.heated_fraction * (temperature - room)
    stretch = (tension - parameters.F_modulus_min) / (muscle.base_length * parameters.K_modulus)
    return muscle.strain(q) - parameters.offset(effective) - stretch


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
        name = f"{regime}.hyst_tension"
        if name in problem.data.priors and isinstance(lanes.plant.side_a, Muscle):
            rest = partial(_resting_tension, problem=problem, lanes=lanes, regime=regime)
            held = jax.vmap(rest)({key: result[key] for key, _ in problem.layout.shapes})
            result[name] = result[name].at[:, lanes.run].set(held)
    return result


def _resting_tension(values, *, problem: Problem, lanes: Lanes, regime: str):
    """Force [N] that HYST's spring holds in every lane at the first row."""
    physical = physical_of(values, problem.layout, problem.data)
    start = values[f"{regime}.start"]
    zero = values.get(f"{regime}.zero", jnp.zeros_like(start))

    def one(lane: Lanes) -> Array:
        plant = plant_of(lane.plant, physical, problem.layout)
        q = lane.scale * (start[lane.run] - zero[lane.run])
        drive = lane.schedule.temperature[0, 0], lane.schedule.load[0]
        hyst = _resting_hyst(plant, q, *drive)
        held = values["stiffness_hyst"] * hyst + values["F_hyst_min"]
        return jnp.maximum(held, 1e-3 * values["F_hyst_min"])

    return jax.vmap(one)(lanes)


SETTLING_SHARE = 0.15
"""Share of an unfitted run that tells its own unknowns; the rest is predicted."""
SETTLING_STEPS = 12


def settled_starts(problem: Problem, draws: Draws, seed: int) -> dict[str, Array]:
    """Each run's own unknowns, drawn given the posterior draw and the first part of the run.

    For every draw of the shared parameters: Gauss-Newton to the mode of zero, first reading, first
    speed and force held by HYST, then a normal draw with the curvature there.
    """
    own = [name for name, shape in problem.layout.shapes if shape]
    if not own:
        return dict(draws)
    cuts = {run.name: SETTLING_SHARE * run.duration for run in problem.runs}
    lanes = tuple(
        group._replace(
            weight=jnp.where(
                group.time <= jnp.array([cuts[problem.runs[i].name] for i in owners])[:, None],
                group.weight,
                0.0,
            )
        )
        for group, owners in zip(problem.data.lanes, problem.lane_runs, strict=True)
    )
    data = problem.data._replace(lanes=lanes)
    keys = jax.random.split(jax.random.key(seed), len(next(iter(draws.values()))))
    return _settled(keys, dict(draws), problem.layout, data, tuple(own))


@partial(jax.jit, static_argnames=("layout", "own"))
def _settled(keys, draws: dict[str, Array], layout: Layout, data: Data, own: tuple[str, ...]):
    logarithmic = {name: isinstance(data.priors[name], dist.LogNormal) for name in own}

    def to_free(values: Draws) -> dict[str, Array]:
        return {k: jnp.log(values[k]) if logarithmic[k] else values[k] for k in own}

    def from_free(free: Draws) -> dict[str, Array]:
        return {k: jnp.exp(free[k]) if logarithmic[k] else free[k] for k in own}

    def one(argument):
        key, values = argument
        start, restore = ravel_pytree(to_free(values))
        spread, _ = ravel_pytree(
            {k: jnp.broadcast_to(data.priors[k].scale, values[k].shape) for k in own}
        )
        centre, _ = ravel_pytree(
            {k: jnp.broadcast_to(data.priors[k].loc, values[k].shape) for k in own}
        )

        def errors(free: Array) -> Array:
            fits = lane_fits({**values, **from_free(restore(free))}, layout, data)
            seen = jnp.concatenate([fit.errors.ravel() for fit in fits])
            return jnp.concatenate([seen, (free - centre) / spread])

        def improve(_: int, free: Array) -> Array:
            value, slope = errors(free), jax.jacfwd(errors)(free)
            move = jnp.linalg.solve(slope.T @ slope, -slope.T @ value)
            move = jnp.clip(move, -spread, spread)
            halves = free + move * jnp.array([[1.0], [0.5], [0.2], [0.05], [0.0]])
            costs = jax.vmap(lambda at: jnp.sum(errors(at) ** 2))(halves)
            return halves[jnp.argmin(jnp.where(jnp.isfinite(costs), costs, jnp.inf))]

        mode = jax.lax.fori_loop(0, SETTLING_STEPS, improve, start)
        slope = jax.jacfwd(errors)(mode)
        factor = jnp.linalg.cholesky(jnp.linalg.inv(slope.T @ slope))
        free = mode + factor @ jax.random.normal(key, mode.shape)
        return {**values, **from_free(restore(free))}

    return jax.lax.map(one, (keys, draws), batch_size=4)
