"""What a posterior says of a run, fitted or not."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from muscle_bayes.inference.model.lanes import Lanes
from muscle_bayes.inference.model.likelihood import lasting_variance, noise_of
from muscle_bayes.inference.model.noise import (
    NoiseParameters,
    added_variance,
    elapsed_time,
    reading_variance,
)
from muscle_bayes.inference.model.problem import Problem
from muscle_bayes.inference.running.batches import of_draws
from muscle_bayes.inference.running.program import program
from muscle_bayes.inference.running.programs import solved_at, unconstrained

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
    unsolved: int = 0
    """Draws that were left out, for a run could not be solved in them."""

    def ahead(self) -> "Prediction":
        """The part that is predicted ahead."""
        return self.only(self.time >= self.ahead_from)

    def only(self, chosen: Bool[np.ndarray, " interval"]) -> "Prediction":
        """The chosen intervals."""
        cut = {
            key: getattr(self, key)[..., chosen]
            for key in ("time", "observed", "model", "reading", "hyst", "temperature", "load")
        }
        return self._replace(**cut)


@program
def disturbances(
    key: Array,
    values: Mapping[str, Array],
    predicted: Float[Array, "lane interval"],
    lanes: Lanes,
    regime: str,
) -> Float[Array, "lane interval"]:
    """Discrepancy and noise of every lane for one draw, where the model predicts these readings."""
    noise: NoiseParameters = noise_of(values, regime)
    key_first, key_lasting, key_white = jax.random.split(key, 3)
    unsure = lasting_variance(lanes, noise.noise)
    elapsed = jax.vmap(partial(elapsed_time, parameters=noise, regime=regime))(
        predicted, lanes.time, lanes.jolted, unsure
    )
    fade = jnp.exp(-elapsed / noise.correlation_time)
    kicks = jax.random.normal(key_lasting, lanes.time.shape)
    first = noise.discrepancy * jax.random.normal(key_first, lanes.time.shape[:1])

    def step(state, now):
        decay, kick, jolt = now
        spread = (1.0 - decay**2) * noise.discrepancy**2 + jolt
        state = decay * state + jnp.sqrt(spread) * kick
        return state, state

    added = jax.vmap(added_variance, (0, 0, 0, None))(elapsed, lanes.jolted, unsure, noise)
    _, lasting = jax.lax.scan(step, first, (fade.T, kicks.T, added.T))
    variance = reading_variance(noise, lanes.weight, lanes.coarse, lanes.quantum[:, None])
    return lasting.T + jnp.sqrt(variance) * jax.random.normal(key_white, lanes.time.shape)


@program
def _disturbances_of_draws(
    keys: Array,
    values: Mapping[str, Array],
    predicted: Float[Array, "draw lane interval"],
    lanes: Lanes,
    regime: str,
) -> Float[Array, "draw lane interval"]:
    def one(key: Array, values: Mapping[str, Array], predicted: Array) -> Array:
        return disturbances(key, values, predicted, lanes, regime)

    return jax.vmap(one)(keys, values, predicted)


def predict(problem: Problem, draws: Draws, seed: int) -> list[Prediction]:
    """Predictions of the problem's runs under draws of all its sampled values.

    A run that is cut into segments is predicted segment by segment, each from its own data's start.
    """
    draws = {name: jnp.asarray(draws[name]) for name, _ in problem.layout.shapes}
    count = len(next(iter(draws.values())))
    keys = jax.random.split(jax.random.key(seed), count)
    vectors = unconstrained(draws, problem.layout, problem.data)
    outcomes = of_draws(solved_at, vectors, problem.layout, problem.data).responses
    models, readings, strains = [], [], []
    for response, lanes, regime in zip(
        outcomes, problem.data.lanes, problem.layout.regimes, strict=True
    ):
        extra = _disturbances_of_draws(keys, draws, response.averaged, lanes, regime)
        models.append(np.asarray(response.averaged))
        readings.append(models[-1] + np.asarray(extra))
        strains.append(np.asarray(response.hyst)[..., 0])
    return by_run(problem, problem.data.lanes, models, readings, strains)


def by_run(
    problem: Problem,
    groups: Sequence[Lanes],
    models: Sequence[np.ndarray],
    readings: Sequence[np.ndarray],
    strains: Sequence[np.ndarray],
) -> list[Prediction]:
    """Draws (draw, lane, interval) of each group of lanes, joined run by run; unobserved left out."""
    pieces: dict[int, list[dict[str, np.ndarray]]] = {}
    for lanes, owners, model, reading, hyst in zip(
        groups, problem.lane_runs, models, readings, strains, strict=True
    ):
        # In NumPy: of a JAX array, every lane's slice is compiled.
        lanes = jax.tree.map(np.asarray, lanes)
        for lane, owner in enumerate(owners):
            seen = lanes.weight[lane] > 0
            piece = {
                "time": lanes.time[lane],
                "observed": lanes.reading[lane],
                "model": model[:, lane],
                "reading": reading[:, lane],
                "hyst": hyst[:, lane],
                "temperature": lanes.schedule.temperature[lane, 1:, 0],
                "load": lanes.schedule.load[lane],
            }
            cut = {key: np.asarray(value)[..., seen] for key, value in piece.items()}
            pieces.setdefault(owner, []).append(cut)
    result = []
    for owner in sorted(pieces):
        run, own = problem.runs[owner], pieces[owner]
        parts = {key: np.concatenate([one[key] for one in own], axis=-1) for key in own[0]}
        scale = run.output_sensor.sign * run.output_sensor.scale
        result.append(Prediction(run=run.name, unit=run.unit, scale=scale, **parts))
    return result


def thin(values: dict[str, Any], count: int) -> dict[str, Any]:
    """`count` draws spread evenly over all chains, chain and draw axes merged."""
    chains, draws = next(iter(values.values())).shape[:2]
    chosen = np.linspace(0, chains * draws - 1, min(count, chains * draws)).astype(int)
    return {
        name: jnp.asarray(np.asarray(value).reshape(chains * draws, *value.shape[2:])[chosen])
        for name, value in values.items()
    }
