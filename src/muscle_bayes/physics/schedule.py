"""What is imposed on a plant over one run: a diffrax path on a grid of times."""

import dataclasses
from functools import partial
from typing import Any

import diffrax
import equinox.internal as eqxi
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Int

from muscle_bayes.physics.effect import TemperatureFilter
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.state import Drive

Index = Int[Array, ""]


class Segment(diffrax.AbstractPath):
    """A path within one interval of a schedule: temperature linear, load and force constant.

    Its own start and end belong to it, whatever jumps there; `left` does not count.
    """

    t0: Scalar  # type: ignore[misc]
    """s"""
    t1: Scalar  # type: ignore[misc]
    """s"""
    first: Drive
    """At its start."""
    temperature_rate: Float[Array, "2"]
    """C/s"""
    interval: Index
    """Of the schedule."""

    def evaluate(self, t0: Any, t1: Any = None, left: bool = True) -> Drive:
        """The drive at t0 [s]; its change from t0 to t1 where t1 is given."""
        if t1 is not None:
            return _change(self.evaluate(t0), self.evaluate(t1))
        heat = self.first.temperature + (t0 - self.t0) * self.temperature_rate
        return self.first._replace(temperature=heat)


class Schedule(diffrax.AbstractPath):
    """Node times and, between nodes, the drive: temperature linear, load and force constant.

    Load and force jump at nodes: `evaluate(t, left=True)` gives their values before a node,
    `left=False` those after it. Beyond the nodes the nearest drive lasts. Intervals of no length pad
    runs to one shape and do nothing. `Schedule.sampled` makes one from numbers and arrays.
    """

    time: Float[Array, " node"]
    """Seconds after the first row, not falling."""
    temperature: Float[Array, "node 2"]
    """Heater temperature of sides A and B [C]."""
    load: Float[Array, " interval"]
    """Hanging mass [kg]."""
    applied: Float[Array, " interval"]
    """Logged drive [N m, N, A, V or duty]."""

    @classmethod
    def sampled(
        cls,
        time: ArrayLike,
        temperature: ArrayLike = 25.0,
        load: ArrayLike = 0.0,
        applied: ArrayLike = 0.0,
    ) -> "Schedule":
        """A schedule of these nodes [s].

        Temperature [C]: one for all, one a node, or two a node for sides A and B. Load [kg] and
        applied force [N m or N]: one for all, or one an interval.
        """
        time, heat = jnp.asarray(time, float), jnp.asarray(temperature, float)
        heat = heat[:, None] if heat.ndim == 1 else heat
        between = (time.shape[0] - 1,)
        return cls(
            time,
            jnp.broadcast_to(heat, (time.shape[0], 2)),
            jnp.broadcast_to(jnp.asarray(load, float), between),
            jnp.broadcast_to(jnp.asarray(applied, float), between),
        )

    @property
    def t0(self) -> Scalar:  # type: ignore[override]
        return self.time[0]

    @property
    def t1(self) -> Scalar:  # type: ignore[override]
        return self.time[-1]

    @property
    def first(self) -> Drive:
        """What is imposed in the first row."""
        return Drive(self.temperature[0], self.load[0], self.applied[0])

    @property
    def jump_ts(self) -> Float[Array, " inner"]:
        """Times at which load and force may jump and temperature bends [s], for a step-size controller."""
        return self.time[1:-1]

    def _interval(self, t: Scalar, left: bool) -> Index:
        """Index of the interval that holds t; at a node, of that before it if `left`, else after it."""
        inner = self.time[1:-1]
        return jnp.sum(inner < t if left else inner <= t, dtype=jnp.int32)

    def _interval_near(self, near: Index | None, t0: Scalar, t1: Scalar) -> Index:
        """The same of a step's start; without a search where that is `near` or the next."""
        if near is None:
            return self._interval(t0, left=False)
        last = self.load.shape[0] - 1
        following = jnp.minimum(near + 1, last)
        place = jnp.where(self.time[following] <= t0, following, near)
        holds = (self.time[place] <= t0) & ((t0 < self.time[place + 1]) | (place == last))
        lost = eqxi.unvmap_any(~holds & (t1 > t0))
        return jax.lax.cond(lost, lambda: self._interval(t0, left=False), lambda: place)

    def _heat(self, interval: Index, t: Scalar) -> Float[Array, "2"]:
        """Temperatures [C] at t within an interval."""
        begin, duration = self.time[interval], self.time[interval + 1] - self.time[interval]
        share = (t - begin) / jnp.where(duration > 0.0, duration, 1.0)
        before, after = self.temperature[interval], self.temperature[interval + 1]
        return before + jnp.clip(share, 0.0, 1.0) * (after - before)

    def evaluate(self, t0: Any, t1: Any = None, left: bool = True) -> Drive:
        """The drive at t0 [s]; its change from t0 to t1 where t1 is given.

        At a node `left` chooses what is imposed before it, else after it.
        """
        if t1 is not None:
            return _change(self.evaluate(t0, left=left), self.evaluate(t1, left=left))
        interval = self._interval(t0, left)
        return Drive(self._heat(interval, t0), self.load[interval], self.applied[interval])

    def segment(self, t0: Scalar, t1: Scalar, near: Index | None = None) -> Segment:
        """The path over a step from t0 to t1 [s] that holds no node inside: one search for the step.

        None is needed where the step starts in the interval `near` or the next.
        """
        interval = self._interval_near(near, t0, t1)
        begin, end = self._heat(interval, t0), self._heat(interval, t1)
        lasts = t1 > t0
        rate = jnp.where(lasts, (end - begin) / jnp.where(lasts, t1 - t0, 1.0), 0.0)
        first = Drive(begin, self.load[interval], self.applied[interval])
        return Segment(t0, t1, first, rate, interval)


def _change(begin: Drive, end: Drive) -> Drive:
    return jax.tree.map(lambda a, b: b - a, begin, end)


def filtered(schedule: Schedule, filters: tuple[TemperatureFilter, ...]) -> Schedule:
    """The schedule with each filter applied to the courses of both temperatures."""
    for one in filters:
        passed = jax.vmap(partial(one, schedule.time), 1, 1)(schedule.temperature)
        schedule = dataclasses.replace(schedule, temperature=passed)
    return schedule
