"""Solving a plant over a schedule: diffrax drives the two structured steps."""

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from muscle_bayes.physics.breakaway import dry_levels
from muscle_bayes.physics.inertial import FastState, fast_step
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.memory import Motion, Remembered, remembering, starting
from muscle_bayes.physics.overshoot import ahead
from muscle_bayes.physics.plant import Drive, Plant
from muscle_bayes.physics.quasistatic import SlowState, arrive, cross, slow_step
from muscle_bayes.physics.refinement import FineGrid
from muscle_bayes.physics.schedule import Schedule, filtered
from muscle_bayes.physics.slide import settle


class Response(NamedTuple):
    """What the plant did, one value for each interval of the schedule."""

    sensed: Float[Array, " interval"]
    """Coordinate that the sensor shows [rad or m]: mid-interval if slow, at its end if fast."""
    averaged: Float[Array, " interval"]
    """The same as its mean over the interval if slow, at its end if fast: what readings show."""
    hyst: Float[Array, "interval 2"]
    """sigma_hyst of sides A and B at the interval's end."""
    speed: Float[Array, " interval"]
    """dq/dt [rad/s or m/s] at the interval's end; the interval's mean if slow."""
    finite: Bool[Array, ""]
    """Whether every value is finite; a response that is not must be rejected."""


class StructuredStep(diffrax.AbstractSolver):
    """A diffrax solver whose step is one of ours; its own state counts the intervals.

    `args` of the integration is (plant, schedule); times must be the schedule's nodes.
    """

    term_structure: ClassVar = diffrax.ODETerm
    interpolation_cls: ClassVar = diffrax.LocalLinearInterpolation
    advance: Callable = eqx.field(static=True)
    accuracy: int = eqx.field(static=True)

    def order(self, terms: Any) -> int:
        return self.accuracy

    def init(self, terms: Any, t0: Any, t1: Any, y0: Any, args: Any) -> Any:
        return jnp.asarray(0)

    def step(
        self, terms: Any, t0: Any, t1: Any, y0: Any, args: Any, solver_state: Any, made_jump: Any
    ) -> Any:
        y1 = self.advance(args[0], y0, args[1], solver_state)
        dense_info = {"y0": y0, "y1": y1}
        return y1, None, dense_info, solver_state + 1, diffrax.RESULTS.successful

    def func(self, terms: Any, t0: Any, y0: Any, args: Any) -> Any:
        return terms.vf(t0, y0, args)


STICK_SLIP = StructuredStep(fast_step, 4)
"""Full inertia, reversals of speed resolved inside the step; fourth order."""
QUASI_STATIC = StructuredStep(slow_step, 2)
"""Rotor inertia eliminated, dry friction as a play operator; second order."""
REMEMBERING = {
    STICK_SLIP: StructuredStep(
        remembering(
            Motion(
                cross=fast_step,
                middle=lambda begun, end: 0.5 * (begun.q + end.q),
                arrive=lambda plant, end, schedule, index: end,
            )
        ),
        2,
    ),
    QUASI_STATIC: StructuredStep(
        remembering(Motion(cross, lambda begun, crossed: crossed.q_middle, arrive)), 2
    ),
}
"""The same where effects remember; second order."""


def _solve(solver: StructuredStep, plant: Plant, schedule: Schedule, start: Any) -> Any:
    """States of the motion at the end of every interval."""
    if plant.memory:
        solver, start = REMEMBERING[solver], Remembered(start, plant.memory)
    # The steps advance the state themselves; diffrax asks for a term but never evaluates it.
    term = diffrax.ODETerm(lambda t, y, args: jax.tree.map(jnp.zeros_like, y))
    intervals = schedule.load.shape[0]
    ticks = jnp.arange(intervals + 1, dtype=schedule.time.dtype)
    solution = diffrax.diffeqsolve(
        term,
        solver,
        ticks[0],
        ticks[-1],
        None,
        start,
        (plant, schedule),
        saveat=diffrax.SaveAt(steps=True),
        stepsize_controller=diffrax.StepTo(ts=ticks),
        adjoint=diffrax.ForwardMode(),
        max_steps=intervals,
        throw=False,
    )
    return solution.ys.motion if plant.memory else solution.ys


def _all_finite(*values: Array) -> Bool[Array, ""]:
    return jnp.stack([jnp.isfinite(value).all() for value in values]).all()


def simulate_slow(plant: Plant, schedule: Schedule, q: Scalar, hyst: Float[Array, "2"]) -> Response:
    """Quasi-static response from rest at q [rad or m] with HYST strains `hyst`."""
    schedule = filtered(schedule, plant.temperature_filters)
    first = schedule.first
    plant = starting(plant, q, hyst, first)
    temperature = schedule.temperature + ahead(plant, q, hyst, schedule)
    schedule = schedule._replace(temperature=temperature)
    # The first rest is that of one more interval: a program that looks for rests in few places compiles
    # sooner.
    states = _solve(QUASI_STATIC, plant, schedule.from_rest, SlowState(q, hyst, q))
    begun, states = states.q[:-1], jax.tree.map(lambda one: one[1:], states)
    middle = 0.5 * (schedule.temperature[1:] + schedule.temperature[:-1])
    drives = Drive(middle, schedule.load, schedule.applied)
    sensed = jax.vmap(plant.sensed)(states.q_middle, states.hyst, drives)
    mean = 0.25 * (begun + 2.0 * states.q_middle + states.q)
    averaged = jax.vmap(plant.sensed)(mean, states.hyst, drives)
    duration = jnp.diff(schedule.time)
    speed = jnp.where(
        duration > 0.0, (states.q - begun) / jnp.where(duration > 0.0, duration, 1.0), 0.0
    )
    finite = _all_finite(averaged, states.hyst, speed)
    return Response(sensed, averaged, states.hyst, speed, finite)


def simulate_fast(
    plant: Plant, schedule: Schedule, q: Scalar, speed: Scalar, hyst: Float[Array, "2"]
) -> Response:
    """Response with full inertia from q [rad or m], speed [rad/s or m/s] and HYST strains `hyst`."""
    schedule = filtered(schedule, plant.temperature_filters)
    return _swung(starting(plant, q, hyst, schedule.first), schedule, FastState(q, speed, hyst))


def _swung(plant: Plant, schedule: Schedule, start: FastState) -> Response:
    states = _solve(STICK_SLIP, plant, schedule, start)
    drives = Drive(schedule.temperature[1:], schedule.load, schedule.applied)
    sensed = jax.vmap(plant.sensed)(states.q, states.hyst, drives)
    finite = _all_finite(sensed, states.hyst, states.speed)
    return Response(sensed, sensed, states.hyst, states.speed, finite)


def simulate_inertial(plant: Plant, grid: FineGrid, q: Scalar, hyst: Float[Array, "2"]) -> Response:
    """What `simulate_slow` says of the grid's former intervals, with full inertia."""
    schedule = filtered(grid.schedule, plant.temperature_filters)
    first = schedule.first
    plant = starting(plant, q, hyst, first)
    still = jnp.zeros_like(q)
    q = settle(plant, q, hyst, first, still, dry_levels(plant, q, hyst, first, still))
    whole = _swung(plant, schedule, FastState(q, jnp.zeros_like(q), hyst))
    start = plant.sensed(q, hyst, first)
    ends = jnp.concatenate([start[None], whole.sensed])
    steps = jnp.diff(schedule.time)
    area = jnp.concatenate([jnp.zeros(1), jnp.cumsum(0.5 * (ends[1:] + ends[:-1]) * steps)])
    last = grid.end + 1
    before = jnp.concatenate([jnp.zeros(1, last.dtype), last[:-1]])
    duration = schedule.time[last] - schedule.time[before]
    lasts = duration > 0.0
    mean = (area[last] - area[before]) / jnp.where(lasts, duration, 1.0)
    return Response(
        sensed=whole.sensed[grid.middle],
        averaged=jnp.where(lasts, mean, whole.sensed[grid.end]),
        hyst=whole.hyst[grid.end],
        speed=whole.speed[grid.end],
        finite=whole.finite,
    )
