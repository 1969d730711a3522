"""What a reading shows besides the model: noise, quantisation, and a slow discrepancy."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.physics.linkage import Scalar


class NoiseParameters(NamedTuple):
    """Of one regime, in units of the sensor's reading.

    reading = model + discrepancy(s) + white;  discrepancy is an Ornstein-Uhlenbeck process,
    cov(s, s') = discrepancy^2 exp(-|s - s'| / correlation_time): readings 0.03 s apart are not
    independent, and no model is exact. In slow runs its clock s runs while the model moves
    (`time_in_motion`), in others s is time.
    """

    noise: Scalar
    """Standard deviation of one reading's white noise."""
    discrepancy: Scalar
    """Stationary standard deviation of the discrepancy."""
    correlation_time: Scalar
    """Its correlation time in motion, s."""


AT_REST = 0.01
"""Speed of the discrepancy's clock while the model is at rest: a model may be wrong about resting."""


SMOOTH = 0.01
"""Way, in reaches of a jolt, below which its size is rounded off."""
REACH = 2.0**0.5
"""Standard deviations of a jolt that the model moves while it fades to 1/e."""


class Jolts(NamedTuple):
    """What jumps of the load have added to the discrepancy, and the model's motion undoes."""

    way: Float[Array, " interval"]
    """By which the model moves up to each reading, other than by a jump of the load, in reaches."""
    left: Float[Array, " interval"]
    """Variance that is left from before each interval [log's unit^2]."""


def jolts_of(predicted: Float[Array, " interval"], jolted: Float[Array, " interval"]) -> Jolts:
    """Jolts of these variances [log's unit^2], each of which fades by exp(-2 way).

    Wherever a jolted rotor stuck, once it is driven on for as far as it was off, it is where friction
    has it. So the way counts in REACH standard deviations of the last jolt.
    """
    moved = jnp.diff(predicted, prepend=predicted[:1])
    # Means of the interval after a jump, too, differ from those before by the jump.
    jumped = (jolted > 0.0) | (jnp.roll(jolted, 1).at[0].set(0.0) > 0.0)

    def step(now, one):
        added, last = now
        moved, jumped, jolt = one
        reach = REACH * jnp.sqrt(jnp.where(last > 0.0, last, 1.0))
        way = jnp.sqrt((moved / reach) ** 2 + SMOOTH**2) - SMOOTH
        way = jnp.where(jumped | (last == 0.0), 0.0, way)
        left = jnp.exp(-2.0 * way) * added + jolt
        return (left, jnp.where(jolt > 0.0, left, last)), (way, added)

    nothing = jnp.zeros(())
    return Jolts(*jax.lax.scan(step, (nothing, nothing), (moved, jumped, jolted))[1])


def time_in_motion(
    predicted: Float[Array, " interval"],
    time: Float[Array, " interval"],
    jolts: Jolts,
    lasting: Float[Array, " interval"],
    parameters: NoiseParameters,
) -> Float[Array, " interval"]:
    """Time by which the discrepancy's clock goes on up to each reading [s]; 0 up to the first.

    A rotor that friction holds keeps the error with which it stopped, however long: the clock runs
    at m^2 / (m^2 + d^2 + v), m being how far the model moves per correlation time, d the size of the
    discrepancy and of other errors that last, and v what jolts have added, and at AT_REST at least.
    Motion that undoes a jolt makes it run by way v / (v + d^2) correlation times more.
    """
    gaps = jnp.diff(time, prepend=time[:1])
    moved = jnp.diff(predicted, prepend=predicted[:1])
    stationary = parameters.discrepancy**2 + lasting
    period = jnp.where(gaps > 0.0, gaps, 1.0) / parameters.correlation_time
    still = (stationary + jolts.left) * period**2
    running = gaps * (AT_REST + (1.0 - AT_REST) * moved**2 / (moved**2 + still))
    undone = jolts.way * jolts.left / (jolts.left + stationary)
    return running + parameters.correlation_time * undone


def elapsed_time(
    predicted: Float[Array, " interval"],
    time: Float[Array, " interval"],
    jolted: Float[Array, " interval"],
    lasting: Float[Array, " interval"],
    parameters: NoiseParameters,
    regime: str,
) -> Float[Array, " interval"]:
    """The discrepancy's time up to each reading [s]: in motion where the run is slow.

    A rotor that swings is at rest at every turn, and keeps nothing there.
    """
    if regime == "slow":
        return time_in_motion(predicted, time, jolts_of(predicted, jolted), lasting, parameters)
    return jnp.diff(time, prepend=time[:1])


def added_variance(
    elapsed: Float[Array, " interval"],
    jolted: Float[Array, " interval"],
    lasting: Float[Array, " interval"],
    parameters: NoiseParameters,
) -> Float[Array, " interval"]:
    """Variance that enters the discrepancy up to each reading [log's unit^2].

    Jolts, and errors that last (`lasting_variance`): as motion renews the discrepancy, so it renews these.
    A rotor that turns back and rests keeps the error of the temperature at which it did.
    """
    renewed = -jnp.expm1(-2.0 * elapsed / parameters.correlation_time)
    return jolted + renewed.at[0].set(1.0) * lasting


def reading_variance(
    parameters: NoiseParameters, weight: Array, coarse: Array, quantum: float
) -> Array:
    """Variance of a mean of `weight` readings, without the discrepancy.

    noise^2 / weight + quantum^2 coarse, with `coarse` the quantisation variance in squared quanta
    (Sheppard: 1/12 for one reading).
    """
    return parameters.noise**2 / jnp.maximum(weight, 1.0) + quantum**2 * coarse


class Whitened(NamedTuple):
    """Standardised one-step-ahead errors; zero where nothing is observed."""

    errors: Float[Array, "interval column"]
    log_scale: Float[Array, " interval"]
    """Log of the predictive standard deviation; 0 where nothing is observed."""


def whiten(
    residual: Float[Array, "interval column"],
    elapsed: Float[Array, " interval"],
    variance: Float[Array, " interval"],
    jolted: Float[Array, " interval"],
    observed: Float[Array, " interval"],
    parameters: NoiseParameters,
) -> Whitened:
    """Kalman filter of the discrepancy: each column's errors given the column's past.

    `elapsed` is by how much its clock goes on up to each reading [s] (`elapsed_time`), `jolted` the
    variance that a jump of the load has added by then.
    Gains do not depend on the residual, so columns (a residual and its sensitivities) share them,
    and the log density of column k is -sum(errors[:, k]^2)/2 - sum(log_scale) - n log(2 pi)/2.
    """
    stationary = parameters.discrepancy**2
    fade = jnp.exp(-elapsed / parameters.correlation_time)

    def step(carry, now):
        state, spread = carry
        value, decay, noise, jolt, seen = now
        state = decay * state
        spread = decay**2 * spread + (1.0 - decay**2) * stationary + jolt
        total = spread + noise
        gain = seen * spread / total
        error = value - state
        scale = jnp.sqrt(total)
        out = seen * error / scale, seen * jnp.log(scale)
        return (state + gain * error, (1.0 - gain) * spread), out

    start = jnp.zeros(residual.shape[1]), stationary
    _, (errors, log_scale) = jax.lax.scan(step, start, (residual, fade, variance, jolted, observed))
    return Whitened(errors, log_scale)
