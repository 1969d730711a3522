"""The distribution of a run's readings under the model's predictions and the noise parameters."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from muscle_bayes.inference.model.discrepancy import OUDiscrepancy
from muscle_bayes.inference.model.lane_model import LanePrediction, Values
from muscle_bayes.inference.model.lanes import Lanes
from muscle_bayes.inference.model.noise import (
    NoiseParameters,
    added_variance,
    elapsed_time,
    reading_variance,
)


def noise_of(values: Values, regime: str) -> NoiseParameters:
    """Noise parameters of a regime."""
    return NoiseParameters(*(values[f"{regime}.{key}"] for key in NoiseParameters._fields))


SWING_UNSURE = 0.5
"""Share of what inertia adds to slow motion that is uncertain: it depends on details of the drive."""


def lasting_variance(lane: Lanes, noise: Array | float) -> Float[Array, "*lane interval"]:
    """Variance of the readings by errors that last as long as the rotor rests [log's unit^2].

    Of the temperature, and of the swings of a rotor that turns back or stops: at most that of a reading's
    `noise` [log's unit], for where J is unknown swings at the mode may be of any size.
    """
    return lane.thermal + jnp.minimum((SWING_UNSURE * lane.swing) ** 2, noise**2)


class _Parts(NamedTuple):
    """Arguments of `OUDiscrepancy`, of one record or with a leading axis of records."""

    prediction: Float[Array, "*lane interval"]
    elapsed: Float[Array, "*lane interval"]
    white_variance: Float[Array, "*lane interval"]
    observed: Float[Array, "*lane interval"]
    added: Float[Array, "*lane interval"]
    basis: Float[Array, "*lane interval 2"] | None


def _parts(
    lane: Lanes, zero: Array, prediction: LanePrediction, noise: NoiseParameters, regime: str
) -> _Parts:
    reading = jnp.where(jnp.isfinite(prediction.reading), prediction.reading, 0.0)
    lasting = lasting_variance(lane, noise.noise)
    elapsed = elapsed_time(reading, lane.time, lane.jolted, lasting, noise, regime)
    return _Parts(
        _expected(lane, zero, prediction),
        elapsed,
        reading_variance(noise, lane.weight, lane.coarse, lane.quantum),
        (lane.weight > 0).astype(lane.reading.dtype),
        added_variance(elapsed, lane.jolted, lasting, noise),
        prediction.reach,
    )


def _expected(lane: Lanes, zero: Array, prediction: LanePrediction) -> Float[Array, " interval"]:
    expected = zero + prediction.reading
    if prediction.reach is not None:
        back = (lane.start - lane.pivot) / lane.start_spread
        expected = expected + prediction.reach @ back
    return expected


def expected_reading(
    lanes: Lanes, zero: Array, prediction: LanePrediction
) -> Float[Array, "lane interval"]:
    """Readings that predictions of lanes expect; segments begin where their first readings say."""
    return jax.vmap(_expected)(lanes, zero, prediction)


def reading_distribution(
    lanes: Lanes,
    zero: Array,
    prediction: LanePrediction,
    noise: NoiseParameters,
    regime: str,
) -> OUDiscrepancy:
    """Distribution of the readings of one lane, or of lanes along a leading axis.

    Args:
        lanes: when readings were taken, and how well.
        zero: reading at q = 0 [the log's unit], one a lane.
        prediction: of the readings above that.
        noise: of the regime.
        regime: "slow" or "fast"; the discrepancy's clock depends on it.
    """

    def of_lane(lane: Lanes, zero: Array, prediction: LanePrediction) -> _Parts:
        return _parts(lane, zero, prediction, noise, regime)

    batched = lanes.reading.ndim == 2
    found = (jax.vmap(of_lane) if batched else of_lane)(lanes, zero, prediction)
    return OUDiscrepancy(noise=noise, **found._asdict(), validate_args=False)
