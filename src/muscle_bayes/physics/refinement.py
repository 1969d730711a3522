"""A schedule cut finely enough to follow the rotor's swings, with the same course of the drive."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.schedule import Schedule
from muscle_bayes.physics.state import Drive


def swing_rate(plant: Plant, q: Scalar, hyst: Float[Array, "2"], drive: Drive) -> Scalar:
    """sqrt(k / inertia) [rad/s], k = -d force / d q at rest; 0 where nothing restores."""
    still, unit = jnp.zeros_like(q), jnp.ones_like(q)
    slope = jax.jvp(lambda x: plant.force(x, still, hyst, drive), (q,), (unit,))[1]
    inertia = plant.inertia(drive.load)
    square = jnp.maximum(-slope, 0.0) / jnp.where(inertia > 0.0, inertia, 1.0)
    return jnp.where(square > 0.0, jnp.sqrt(jnp.where(square > 0.0, square, 1.0)), 0.0)


class FineGrid(NamedTuple):
    """A schedule whose intervals are cut into steps, and where the former intervals are in it."""

    schedule: Schedule
    middle: Int[Array, " interval"]
    """Step that ends in the middle of each former interval."""
    end: Int[Array, " interval"]
    """Step that ends each former interval."""


def refined(
    schedule: Schedule,
    longest: Float[np.ndarray, " interval"],
    size: int = 0,
    deceleration: Float[np.ndarray, "node 2"] | None = None,
) -> FineGrid:
    """The schedule of one run with steps of at most `longest` [s], an even number an interval.

    Between nodes the temperature is the parabola whose bend is the mean of `deceleration` at both ends
    [C/s^2], a chord without: a chord cuts the peak at which friction leaves the rotor. Padding of no
    duration stays padding, and is lengthened to `size` steps. Arrays are NumPy's.
    """
    node_time, temperature = np.asarray(schedule.time), np.asarray(schedule.temperature)
    durations = np.diff(node_time)
    counts = np.where(durations > 0.0, 2 * np.ceil(0.5 * durations / longest), 0).astype(int)
    last = np.cumsum(counts)
    total = max(int(last[-1]), 1, size)
    owner = np.repeat(np.arange(durations.size), counts)
    place = (np.arange(owner.size) - (last - counts)[owner] + 1) / counts[owner]
    course = temperature[owner] + place[:, None] * (temperature[owner + 1] - temperature[owner])
    if deceleration is not None:
        bend = 0.5 * (deceleration[1:] + deceleration[:-1])[owner]
        course = course + 0.5 * bend * (place * (1.0 - place) * durations[owner] ** 2)[:, None]
    padding = np.zeros(total - owner.size, dtype=int)

    def on_nodes(first: np.ndarray, values: np.ndarray) -> np.ndarray:
        values = np.concatenate([first[None], values])
        return np.concatenate([values, values[padding - 1]])

    def on_steps(values: np.ndarray) -> np.ndarray:
        values = np.asarray(values)[owner]
        return np.concatenate([values, np.broadcast_to(values[-1:], padding.shape)])

    fine = Schedule(
        time=on_nodes(node_time[0], node_time[owner] + place * durations[owner]),
        temperature=on_nodes(temperature[0], course),
        load=on_steps(schedule.load),
        applied=on_steps(schedule.applied),
    )
    return FineGrid(fine, np.maximum(last - counts // 2 - 1, 0), np.maximum(last - 1, 0))
