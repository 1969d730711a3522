"""What a posterior says of a run, fitted or not."""

from collections.abc import Mapping
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.inference.density import (
    NoiseParameters,
    lane_fits,
    noise_of,
    physical_of,
    plant_of,
    responses,
)
from muscle_bayes.inference.noise import reading_variance
from muscle_bayes.inference.problem import Data, Lanes, Layout, Problem
from muscle_bayes.physics.element import Muscle
from muscle_bayes.physics.plant import Plant

Draws = Mapping[str, Array]
"""Sampled values, each with a leading draw axis."""


class Prediction(NamedTuple):
    """Draws of one run's readings on the grid on which it is solved, unobserved intervals left out."""

    run: str
    unit: str
    time: Float[np.ndarray, " interval"]
    """s after the first row."""
    observed: Float[np.ndarray, " interval"]
    """Mean reading of each interval."""
    model: Float[np.ndarray, "draw interval"]
    """Reading that the model gives: uncertainty of the parameters only."""
    reading: Float[np.ndarray, "draw interval"]
    """Reading with discrepancy, noise and the variance of rounding added: what would be logged."""
    hyst: Float[np.ndarray, "draw interval"]
    """sigma_hyst of side A."""
    temperature: Float[np.ndarray, " interval"]
    """Logged temperature of side A [C]."""
    load: Float[np.ndarray, " interval"]
    """kg."""
    scale: float
    """Coordinate per unit of reading, with sign [rad or m]."""
    ahead_from: float = 0.0
    """Readings before this time told the run's own start; only later ones are predicted ahead [s]."""

    def ahead(self) -> "Prediction":
        """The part that is predicted ahead."""
        later = self.time >= self.ahead_from
        cut = {
            key: getattr(self, key)[..., later]
            for key in ("time", "observed", "model", "reading", "hyst", "temperature", "load")
        }
        return self._replace(**cut)


@partial(jax.jit, static_argnames="layout")
def _responses(draws: dict[str, Array], layout: Layout, data: Data):
    return jax.lax.map(lambda values: responses(values, layout, data), draws, batch_size=4)


@partial(jax.jit, static_argnames=("layout", "regime"))
def _disturbances(key, values: dict[str, Array], lanes: Lanes, layout: Layout, regime: str):
    """Discrepancy and noise of every lane for one draw."""
    noise: NoiseParameters = noise_of(values, regime)
    key_lasting, key_white = jax.random.split(key)
    gaps = jnp.diff(lanes.time, axis=1, prepend=lanes.time[:, :1])
    fade = jnp.exp(-gaps / noise.correlation_time)
    kicks = jax.random.normal(key_lasting, lanes.time.shape)
    first = kicks[:, 0] * noise.discrepancy

    def step(state, now):
        decay, kick = now
        state = decay * state + noise.discrepancy * jnp.sqrt(1.0 - decay**2) * kick
        return state, state

    _, lasting = jax.lax.scan(step, first, (fade.T, kicks.T))
    variance = reading_variance(noise, lanes.weight, lanes.coarse, lanes.quantum[:, None])
    return lasting.T + jnp.sqrt(variance) * jax.random.normal(key_white, lanes.time.shape)


def predict(problem: Problem, draws: Draws, seed: int) -> list[Prediction]:
    """Predictions of the problem's runs under draws of all its sampled values.

    A run that is cut into segments is predicted segment by segment, each from its own data's start.
    """
    draws = {name: jnp.asarray(draws[name]) for name, _ in problem.layout.shapes}
    count = len(next(iter(draws.values())))
    keys = jax.random.split(jax.random.key(seed), count)
    outcomes = _responses(draws, problem.layout, problem.data)
    result: dict[int, list] = {}
    groups = zip(
        outcomes, problem.data.lanes, problem.layout.regimes, problem.lane_runs, strict=True
    )
    for response, lanes, regime, owners in groups:

        def disturb(key, values, lanes=lanes, regime=regime):
            return _disturbances(key, values, lanes, problem.layout, regime)

        extra = jax.vmap(disturb)(keys, draws)
        for lane, owner in enumerate(owners):
            result.setdefault(owner, []).append(_piece(lanes, lane, response, extra))
    return [_joined(problem, index, result[index]) for index in sorted(result)]


def _piece(lanes: Lanes, lane: int, response, extra) -> dict[str, np.ndarray]:
    seen = np.asarray(lanes.weight[lane] > 0)
    model = np.asarray(response.sensed[:, lane])[:, seen]
    temperature = lanes.schedule.temperature[lane, 1:, 0]
    return {
        "time": np.asarray(lanes.time[lane])[seen],
        "observed": np.asarray(lanes.reading[lane])[seen],
        "model": model,
        "reading": model + np.asarray(extra[:, lane])[:, seen],
        "hyst": np.asarray(response.hyst[:, lane, :, 0])[:, seen],
        "temperature": np.asarray(temperature)[seen],
        "load": np.asarray(lanes.schedule.load[lane])[seen],
    }


def _joined(problem: Problem, index: int, pieces: list[dict[str, np.ndarray]]) -> Prediction:
    run = problem.runs[index]
    parts = {key: np.concatenate([p[key] for p in pieces], axis=-1) for key in pieces[0]}
    return Prediction(
        run=run.name, unit=run.unit, scale=run.sensor.sign * run.sensor.scale, **parts
    )


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
