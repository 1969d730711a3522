"""Log posterior density of a problem, on an unconstrained vector, as a pure function of the data."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float
from numpyro.distributions import biject_to

from muscle_bayes.inference.forward_jacobian import with_forward_jacobian
from muscle_bayes.inference.noise import NoiseParameters, reading_variance, whiten
from muscle_bayes.inference.prior import first_hyst, muscle_parameters
from muscle_bayes.inference.problem import Data, Lanes, Layout
from muscle_bayes.inference.rig import with_parameters
from muscle_bayes.physics.effects import effect_type
from muscle_bayes.physics.friction import FRICTION_LAWS
from muscle_bayes.physics.muscle import MuscleParameters
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.simulation import Response, simulate_fast, simulate_slow

LOG_2PI = float(np.log(2.0 * np.pi))

Values = Mapping[str, Array]


def muscle_of(values: Values, data: Data) -> MuscleParameters | None:
    """Table 2's parameters, or None where the problem has no muscle."""
    if "contraction" not in values:
        return None
    return muscle_parameters(values, data.base_length, data.tension)


class Physical(NamedTuple):
    """What the plant of every lane shares."""

    inertia: Array
    """J."""
    friction: Array
    """D."""
    muscle: MuscleParameters | None
    effects: tuple[dict[str, Array], ...]
    """Parameters of each effect, in the layout's order."""


def physical_of(values: Values, layout: Layout, data: Data) -> Physical:
    """The plant's parameters from the sampled values."""
    effects = tuple(
        {key: values[f"{name}.{key}"] for key in effect_type(name).parameters}
        for name in layout.effects
    )
    return Physical(values["J"], values["D"], muscle_of(values, data), effects)


def plant_of(rig: Plant, physical: Physical, layout: Layout) -> Plant:
    """A rig with its parameters filled in and the layout's effects added."""
    friction = FRICTION_LAWS[layout.friction](physical.friction)
    plant = with_parameters(rig, physical.inertia, friction, physical.muscle)
    for name, parameters in zip(layout.effects, physical.effects, strict=True):
        plant = plant + effect_type(name)(**parameters)
    return plant


class Origin(NamedTuple):
    """What a lane's own simulation starts from; None where it is not an unknown."""

    q: Float[Array, ""]
    """First coordinate [rad or m]."""
    speed: Float[Array, ""] | None
    """First speed [rad/s or m/s]; None: at rest."""
    hyst: Float[Array, ""] | None
    """First sigma_hyst of both sides; None: no muscle."""


class Inputs(NamedTuple):
    """All that one lane's simulation depends on."""

    physical: Physical
    origin: Origin


def _zeros(values: Values, lanes: Lanes, regime: str, cut: bool) -> Array:
    """Reading at q = 0 of every lane [log's unit]."""
    zero = values.get(f"{regime}.zero")
    return jnp.zeros(lanes.run.shape) if zero is None or cut else zero[lanes.run]


def _origins(values: Values, lanes: Lanes, regime: str, cut: bool) -> Origin:
    """Start of every lane, from the per-run unknowns (or the rough start of a segment)."""
    if cut:
        return Origin(lanes.scale * lanes.start[:, 0], lanes.scale * lanes.start[:, 1], None)
    first = values[f"{regime}.start"][lanes.run] - _zeros(values, lanes, regime, cut)
    speed, held = values.get(f"{regime}.speed"), values.get(f"{regime}.hyst_tension")
    if speed is not None:
        speed = lanes.scale * speed[lanes.run] * (1.0 - lanes.released)
    hyst = None if held is None else first_hyst(values, held)[lanes.run]
    return Origin(lanes.scale * first, speed, hyst)


def _simulate(inputs: Inputs, lane: Lanes, layout: Layout, regime: str) -> Response:
    """Response of one lane; `sensed` in readings above the reading at q = 0."""
    plant = plant_of(lane.plant, inputs.physical, layout)
    q, speed, hyst = inputs.origin
    both = jnp.zeros(2) if hyst is None else jnp.repeat(hyst, 2)
    if regime == "slow":
        response = simulate_slow(plant, lane.schedule, q, both)
    else:
        moving = jnp.zeros(()) if speed is None else speed
        response = simulate_fast(plant, lane.schedule, q, moving, both)
    return response._replace(sensed=response.sensed / lane.scale)


def responses(values: Values, layout: Layout, data: Data) -> list[Response]:
    """Response of every lane, `sensed` in the log's unit, one entry a group, lanes leading."""
    result = []
    physical = physical_of(values, layout, data)
    for lanes, regime, cut in zip(data.lanes, layout.regimes, layout.segmented, strict=True):

        def one(lane, origin, zero, regime=regime):
            response = _simulate(Inputs(physical, origin), lane, layout, regime)
            return response._replace(sensed=zero + response.sensed)

        origins = _origins(values, lanes, regime, cut)
        result.append(jax.vmap(one)(lanes, origins, _zeros(values, lanes, regime, cut)))
    return result


class Prediction(NamedTuple):
    """What a lane's model says of its readings."""

    reading: Float[Array, " interval"]
    """Readings above the reading at q = 0."""
    reach: Float[Array, "interval 2"] | None
    """Change of the readings per prior standard deviation of a segment's start; None if not cut."""
    finite: Float[Array, ""]
    """1 if the solve succeeded, else 0."""


@lru_cache(maxsize=64)
def _predictor(layout: Layout, regime: str, cut: bool, structure: Any) -> Callable:
    """Prediction of one lane from the leaves of its Inputs, differentiable in any mode.

    One function object per layout: JAX then traces a simulation once, however often it is used.
    """

    def predict(leaves: Array, lane: Lanes) -> Prediction:
        physical, origin = jax.tree.unflatten(structure, list(leaves))

        def at(q, speed) -> tuple[Array, Array]:
            moved = Inputs(physical, origin._replace(q=q, speed=speed))
            response = _simulate(moved, lane, layout, regime)
            return response.sensed, response.finite

        reading, finite = at(origin.q, origin.speed)
        if not cut:
            return Prediction(reading, None, finite * 1.0)

        def along(direction: Array) -> Array:
            return jax.jvp(lambda *x: at(*x)[0], (origin.q, origin.speed), tuple(direction))[1]

        reach = jax.vmap(along, out_axes=1)(jnp.diag(lane.start_spread * lane.scale))
        return Prediction(reading, reach, finite * 1.0)

    return jax.jit(with_forward_jacobian(predict))


def _predict(inputs: Inputs, lane: Lanes, layout: Layout, regime: str, cut: bool) -> Prediction:
    """Prediction of one lane, differentiable in any mode."""
    leaves, structure = jax.tree.flatten(inputs)
    return _predictor(layout, regime, cut, structure)(jnp.stack(leaves), lane)


def rms_by_regime(values: Values, layout: Layout, data: Data) -> dict[str, Array]:
    """Root mean square of reading minus model over all readings of each regime [log's unit]."""
    squares: dict[str, Array] = {}
    counts: dict[str, Array] = {}
    predicted = predictions(values, layout, data)
    groups = zip(predicted, data.lanes, layout.regimes, layout.segmented, strict=True)
    for prediction, lanes, regime, cut in groups:
        zero = _zeros(values, lanes, regime, cut)[:, None]
        residual = _guarded(lanes.reading - zero - prediction.reading) * (lanes.weight > 0)
        squares[regime] = squares.get(regime, 0.0) + jnp.sum(residual**2)
        counts[regime] = counts.get(regime, 0.0) + jnp.sum(lanes.weight > 0)
    return {regime: jnp.sqrt(squares[regime] / counts[regime]) + 1e-12 for regime in squares}


def noise_of(values: Values, regime: str) -> NoiseParameters:
    """Noise parameters of a regime."""
    return NoiseParameters(*(values[f"{regime}.{key}"] for key in NoiseParameters._fields))


class LaneFit(NamedTuple):
    """How well one lane is explained."""

    log_density: Float[Array, " interval"]
    """Log density of each observed mean reading given the earlier ones; 0 where none."""
    errors: Float[Array, " interval"]
    """Standardised one-step-ahead errors, what a free start explains taken out; 0 where none."""
    finite: Bool[Array, ""]


def _guarded(residual: Array) -> Array:
    """Residuals that a failed solve made infinite become zero; the caller rejects the proposal."""
    return jnp.where(jnp.isfinite(residual), residual, 0.0)


def _explain(lane: Lanes, zero: Array, prediction: Prediction, noise: NoiseParameters) -> LaneFit:
    """Density of a lane's readings.

    A segment's start is integrated out: over a short segment the response is linear in it. With
    errors z and start sensitivities S (both whitened, S per prior standard deviation),
    log N(z; 0, I + S S') by the matrix inversion and determinant lemmas.
    """
    variance = reading_variance(noise, lane.weight, lane.coarse, lane.quantum)
    seen = (lane.weight > 0).astype(lane.reading.dtype)
    residual = lane.reading - zero - prediction.reading
    columns = residual[:, None]
    if prediction.reach is not None:
        columns = jnp.concatenate([columns, prediction.reach], axis=1)
    errors, log_scale = whiten(_guarded(columns), lane.time, variance, seen, noise)
    z, s = errors[:, 0], errors[:, 1:]
    log_density = -0.5 * z**2 - log_scale - 0.5 * LOG_2PI * seen
    if prediction.reach is not None:
        information = jnp.eye(2) + s.T @ s
        explained = s @ jnp.linalg.solve(information, s.T @ z)
        volume = 0.5 * jnp.linalg.slogdet(information)[1]
        share = seen / jnp.maximum(seen.sum(), 1.0)
        log_density = log_density + 0.5 * explained * z - volume * share
        z = z - explained
    return LaneFit(log_density, z, prediction.finite > 0.5)


def predictions(values: Values, layout: Layout, data: Data) -> list[Prediction]:
    """Predictions of every lane, one entry a group; they do not depend on the noise parameters."""
    result = []
    physical = physical_of(values, layout, data)
    for lanes, regime, cut in zip(data.lanes, layout.regimes, layout.segmented, strict=True):

        def one(lane, origin, regime=regime, cut=cut):
            return _predict(Inputs(physical, origin), lane, layout, regime, cut)

        result.append(jax.vmap(one)(lanes, _origins(values, lanes, regime, cut)))
    return result


def explained(
    predicted: list[Prediction], values: Values, layout: Layout, data: Data
) -> list[LaneFit]:
    """How predictions explain the readings under the values' zeros and noise, one entry a group."""
    result = []
    groups = zip(predicted, data.lanes, layout.regimes, layout.segmented, strict=True)
    for prediction, lanes, regime, cut in groups:
        noise = noise_of(values, regime)

        def one(lane, zero, prediction, noise=noise):
            return _explain(lane, zero, prediction, noise)

        result.append(jax.vmap(one)(lanes, _zeros(values, lanes, regime, cut), prediction))
    return result


def lane_fits(values: Values, layout: Layout, data: Data) -> list[LaneFit]:
    """How every lane is explained, one entry a group, each with a leading lane axis."""
    return explained(predictions(values, layout, data), values, layout, data)


def constrain(vector: Float[Array, " n"], layout: Layout, data: Data) -> dict[str, Array]:
    """Sampled values from the unconstrained vector."""
    values, position = {}, 0
    for name, shape in layout.shapes:
        size = int(np.prod(shape))
        part = vector[position : position + size].reshape(shape)
        values[name] = biject_to(data.priors[name].support)(part)
        position += size
    return values


def unconstrain(values: Values, layout: Layout, data: Data) -> Float[Array, " n"]:
    """The unconstrained vector of sampled values."""
    parts = [
        jnp.ravel(biject_to(data.priors[name].support).inv(jnp.asarray(values[name])))
        for name, _ in layout.shapes
    ]
    return jnp.concatenate(parts)


def log_prior(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, ""]:
    """Log prior density of the unconstrained vector."""
    total, position = jnp.zeros(()), 0
    for name, shape in layout.shapes:
        size = int(np.prod(shape))
        part = vector[position : position + size].reshape(shape)
        transform = biject_to(data.priors[name].support)
        value = transform(part)
        total += data.priors[name].log_prob(value).sum()
        total += jnp.sum(transform.log_abs_det_jacobian(part, value))
        position += size
    return total


def _total(fits: list[LaneFit]) -> Float[Array, ""]:
    """Log likelihood of all lanes; -inf where a solve failed."""
    total = sum(fit.log_density.sum() for fit in fits)
    finite = jnp.stack([fit.finite.all() for fit in fits]).all()
    return jnp.where(finite & jnp.isfinite(total), total, -jnp.inf)


def log_likelihood(values: Values, layout: Layout, data: Data) -> Float[Array, ""]:
    """Log likelihood; -inf where a solve failed."""
    return _total(lane_fits(values, layout, data))


def potential(vector: Float[Array, " n"], layout: Layout, data: Data) -> Float[Array, ""]:
    """Negative log posterior density of the unconstrained vector."""
    likelihood = log_likelihood(constrain(vector, layout, data), layout, data)
    return -(log_prior(vector, layout, data) + likelihood)


def potential_given(
    predicted: list[Prediction], vector: Float[Array, " n"], layout: Layout, data: Data
) -> Float[Array, ""]:
    """`potential` where the predictions at the vector are known: no solve, for noise alone to vary."""
    fits = explained(predicted, constrain(vector, layout, data), layout, data)
    return -(log_prior(vector, layout, data) + _total(fits))


def standardised_errors(vector: Float[Array, " n"], layout: Layout, data: Data) -> Array:
    """Every standardised error in one vector: their Jacobian gives the Fisher information."""
    fits = lane_fits(constrain(vector, layout, data), layout, data)
    return jnp.concatenate([fit.errors.ravel() for fit in fits])
