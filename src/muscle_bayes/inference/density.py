"""Log posterior density of a problem, on an unconstrained vector, as a pure function of the data."""

from collections.abc import Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float
from numpyro.distributions import biject_to

from muscle_bayes.inference.noise import NoiseParameters, reading_variance, whiten
from muscle_bayes.inference.prior import muscle_parameters
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
    return muscle_parameters(values, data.base_length) if "contraction" in values else None


def plant_of(rig: Plant, values: Values, layout: Layout, data: Data) -> Plant:
    """A rig with the sampled values filled in and the layout's effects added."""
    friction = FRICTION_LAWS[layout.friction](values["D"])
    inertia = values.get("J", jnp.zeros(()))
    plant = with_parameters(rig, inertia, friction, muscle_of(values, data))
    for name in layout.effects:
        kind = effect_type(name)
        plant = plant + kind(**{key: values[f"{name}.{key}"] for key in kind.parameters})
    return plant


class LaneStart(NamedTuple):
    """How a lane begins."""

    zero: Float[Array, ""]
    """Reading at q = 0."""
    reading: Float[Array, ""]
    """First reading [log's unit]."""
    speed: Float[Array, ""]
    """First speed [log's unit per s]."""
    hyst: Float[Array, "2"]
    """sigma_hyst of both sides."""


def starts(values: Values, lanes: Lanes, regime: str, segmented: bool) -> LaneStart:
    """The start of every lane, from the per-run unknowns (or the rough start of a segment)."""
    count = lanes.run.shape[0]
    nothing = jnp.zeros(count)

    def own(key: str) -> Array:
        site = values.get(f"{regime}.{key}")
        return nothing if site is None or segmented else site[lanes.run]

    hyst = jnp.repeat(own("hyst")[:, None], 2, axis=1)
    if segmented:
        return LaneStart(nothing, lanes.start[:, 0], lanes.start[:, 1], hyst)
    speed = own("speed") * (1.0 - lanes.released)
    return LaneStart(own("zero"), own("start"), speed, hyst)


def lane_response(plant: Plant, lane: Lanes, start: LaneStart, regime: str) -> Response:
    """Response of one lane, `sensed` turned into readings of the log's unit."""
    q = lane.scale * (start.reading - start.zero)
    if regime == "slow":
        response = simulate_slow(plant, lane.schedule, q, start.hyst)
    else:
        speed = lane.scale * start.speed
        response = simulate_fast(plant, lane.schedule, q, speed, start.hyst)
    return response._replace(sensed=start.zero + response.sensed / lane.scale)


def responses(values: Values, layout: Layout, data: Data) -> list[Response]:
    """Response of every lane, one entry a group, each with a leading lane axis."""
    result = []
    for lanes, regime, cut in zip(data.lanes, layout.regimes, layout.segmented, strict=True):

        def one(lane, start, regime=regime):
            return lane_response(plant_of(lane.plant, values, layout, data), lane, start, regime)

        result.append(jax.vmap(one)(lanes, starts(values, lanes, regime, cut)))
    return result


def noise_of(values: Values, regime: str) -> NoiseParameters:
    """Noise parameters of a regime."""
    return NoiseParameters(*(values[f"{regime}.{key}"] for key in NoiseParameters._fields))


class LaneFit(NamedTuple):
    """How well one lane is explained."""

    log_density: Float[Array, "interval"]
    """Log density of each observed mean reading given the earlier ones; 0 where none."""
    errors: Float[Array, "interval"]
    """Standardised one-step-ahead errors, what a free start explains taken out; 0 where none."""
    finite: Bool[Array, ""]


def _guarded(residual: Array) -> Array:
    """Residuals that a failed solve made infinite become zero; the caller rejects the proposal."""
    return jnp.where(jnp.isfinite(residual), residual, 0.0)


def _known_start(lane: Lanes, start: LaneStart, noise: NoiseParameters, plant, regime) -> LaneFit:
    response = lane_response(plant, lane, start, regime)
    variance = reading_variance(noise, lane.weight, lane.coarse, lane.quantum)
    seen = (lane.weight > 0).astype(lane.reading.dtype)
    residual = _guarded(lane.reading - response.sensed)
    errors, log_scale = whiten(residual[:, None], lane.time, variance, seen, noise)
    log_density = -0.5 * errors[:, 0] ** 2 - log_scale - 0.5 * LOG_2PI * seen
    return LaneFit(log_density, errors[:, 0], response.finite)


def _free_start(lane: Lanes, start: LaneStart, noise: NoiseParameters, plant, regime) -> LaneFit:
    """Density with the start integrated out: the response is linear in it over a short segment.

    With errors z and start sensitivities S (both whitened), prior covariance P of the start:
    log N(z; 0, I + S P S') by the matrix inversion and determinant lemmas.
    """

    def sensed(x):
        moved = start._replace(reading=x[0], speed=x[1])
        response = lane_response(plant, lane, moved, regime)
        return response.sensed, response.finite

    rough = jnp.stack([start.reading, start.speed])
    reach = jax.vmap(lambda d: jax.jvp(lambda x: sensed(x)[0], (rough,), (d,))[1])(
        jnp.diag(lane.start_spread)
    )
    predicted, finite = sensed(rough)
    variance = reading_variance(noise, lane.weight, lane.coarse, lane.quantum)
    seen = (lane.weight > 0).astype(lane.reading.dtype)
    columns = _guarded(jnp.stack([lane.reading - predicted, reach[0], reach[1]], axis=1))
    errors, log_scale = whiten(columns, lane.time, variance, seen, noise)
    z, s = errors[:, 0], errors[:, 1:]
    # reach is per standard deviation of the start, so its prior covariance here is the identity.
    information = jnp.eye(2) + s.T @ s
    found = jnp.linalg.solve(information, s.T @ z)
    volume = 0.5 * jnp.linalg.slogdet(information)[1]
    share = seen / jnp.maximum(seen.sum(), 1.0)
    explained = 0.5 * (s @ found) * z - volume * share
    log_density = -0.5 * z**2 - log_scale - 0.5 * LOG_2PI * seen + explained
    return LaneFit(log_density, z - s @ found, finite)


def lane_fits(values: Values, layout: Layout, data: Data) -> list[LaneFit]:
    """How every lane is explained, one entry a group, each with a leading lane axis."""
    result = []
    for lanes, regime, cut in zip(data.lanes, layout.regimes, layout.segmented, strict=True):
        noise = noise_of(values, regime)
        explain = _free_start if cut else _known_start

        def one(lane, start, regime=regime, noise=noise, explain=explain):
            plant = plant_of(lane.plant, values, layout, data)
            return explain(lane, start, noise, plant, regime)

        result.append(jax.vmap(one)(lanes, starts(values, lanes, regime, cut)))
    return result


def constrain(vector: Float[Array, "n"], layout: Layout, data: Data) -> dict[str, Array]:
    """Sampled values from the unconstrained vector."""
    values, position = {}, 0
    for name, shape in layout.shapes:
        size = int(np.prod(shape))
        part = vector[position : position + size].reshape(shape)
        values[name] = biject_to(data.priors[name].support)(part)
        position += size
    return values


def unconstrain(values: Values, layout: Layout, data: Data) -> Float[Array, "n"]:
    """The unconstrained vector of sampled values."""
    parts = [
        jnp.ravel(biject_to(data.priors[name].support).inv(jnp.asarray(values[name])))
        for name, _ in layout.shapes
    ]
    return jnp.concatenate(parts)


def log_prior(vector: Float[Array, "n"], layout: Layout, data: Data) -> Float[Array, ""]:
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


def log_likelihood(values: Values, layout: Layout, data: Data) -> Float[Array, ""]:
    """Log likelihood; -inf where a solve failed."""
    fits = lane_fits(values, layout, data)
    total = sum(fit.log_density.sum() for fit in fits)
    finite = jnp.stack([fit.finite.all() for fit in fits]).all()
    return jnp.where(finite & jnp.isfinite(total), total, -jnp.inf)


def potential(vector: Float[Array, "n"], layout: Layout, data: Data) -> Float[Array, ""]:
    """Negative log posterior density of the unconstrained vector."""
    likelihood = log_likelihood(constrain(vector, layout, data), layout, data)
    return -(log_prior(vector, layout, data) + likelihood)


def standardised_errors(vector: Float[Array, "n"], layout: Layout, data: Data) -> Array:
    """Every standardised error in one vector: their Jacobian gives the Fisher information."""
    fits = lane_fits(constrain(vector, layout, data), layout, data)
    return jnp.concatenate([fit.errors.ravel() for fit in fits])
