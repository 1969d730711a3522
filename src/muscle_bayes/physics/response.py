"""What a sensor shows of a plant's motion, interval by interval: what readings are compared with."""

import dataclasses
from typing import NamedTuple

import diffrax
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from muscle_bayes.physics.effect import TemperatureFilter
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.plant import Plant
from muscle_bayes.physics.refinement import FineGrid
from muscle_bayes.physics.schedule import Schedule, filtered
from muscle_bayes.physics.simulation import at_rest, initial_state, simulate
from muscle_bayes.physics.solvers import QuasiStatic, StickSlip
from muscle_bayes.physics.solvers.node_loop import NodeLoop
from muscle_bayes.physics.state import Drive, PlantState


class Response(NamedTuple):
    """What the plant did, one value for each interval of the schedule."""

    sensed: Float[Array, " interval"]
    """Coordinate that the sensor shows [rad or m]: mid-interval if quasi-static, at its end if inertial."""
    averaged: Float[Array, " interval"]
    """The same as its mean over the interval if quasi-static, at its end if inertial: what readings
    show."""
    hyst: Float[Array, "interval 2"]
    """sigma_hyst of sides A and B at the interval's end."""
    speed: Float[Array, " interval"]
    """dq/dt [rad/s or m/s] at the interval's end; the interval's mean if quasi-static."""
    finite: Bool[Array, ""]
    """Whether every value is finite; a response that is not must be rejected."""


def _solve(
    plant: Plant, drive: Schedule, state: PlantState, solver: QuasiStatic | StickSlip
) -> tuple[PlantState, Bool[Array, ""]]:
    """States at the drive's nodes, and whether they could be found; derivatives by forward mode."""
    found = simulate(plant, drive, state, solver=solver, adjoint=NodeLoop(), throw=False)
    states: PlantState = found.ys  # type: ignore[assignment]
    return states, jnp.asarray(found.result == diffrax.RESULTS.successful)


def _sensed(plant: Plant, q: Array, states: PlantState, drives: Drive) -> Float[Array, " interval"]:
    def one(q: Scalar, state: PlantState, drive: Drive) -> Scalar:
        return plant.remembering(state.memory).sensed(q, state.hyst, drive)

    return jax.vmap(one)(q, states, drives)


def _passed(
    plant: Plant, schedule: Schedule, state: PlantState, time: Array, course: Array
) -> Float[Array, " interval"]:
    """A course at these times [s], behind the effects that look at the whole of it."""
    if not plant.reading_filters:
        return course
    first = plant.remembering(state.memory).sensed(state.q, state.hyst, schedule.first)
    time = jnp.concatenate([schedule.time[:1], time])
    course = jnp.concatenate([first[None], course])
    for one in plant.reading_filters:
        course = one(time, course)
    return course[1:]


def _behind_filters(plant: Plant, schedule: Schedule) -> tuple[Plant, Schedule]:
    """The plant without its temperature filters, and what they pass: they run once."""
    effects = tuple(one for one in plant.effects if not isinstance(one, TemperatureFilter))
    return dataclasses.replace(plant, effects=effects), filtered(
        schedule, plant.temperature_filters
    )


def _after_each(states: PlantState) -> PlantState:
    """States at the ends of the intervals."""
    return jax.tree.map(lambda leaf: leaf[1:], states)


def quasi_static_response(
    plant: Plant, schedule: Schedule, q: Scalar, hyst: Float[Array, "2"]
) -> Response:
    """Response without inertia, from rest at q [rad or m] with HYST strains `hyst`."""
    plant, schedule = _behind_filters(plant, schedule)
    state = initial_state(plant, schedule, q, 0.0, hyst)
    states, solved = _solve(plant, schedule, state, QuasiStatic())
    begin, ends = states.q[:-1], _after_each(states)
    duration = jnp.diff(schedule.time)
    lasts = duration > 0.0
    middle = jnp.where(lasts, ends.q - 0.5 * duration * ends.speed, ends.q)
    heat = schedule.temperature
    drives = Drive(0.5 * (heat[1:] + heat[:-1]), schedule.load, schedule.applied)
    mean, at = (
        0.25 * (begin + 2.0 * middle + ends.q),
        0.5 * (schedule.time[1:] + schedule.time[:-1]),
    )
    sensed, averaged = (
        _passed(plant, schedule, state, at, _sensed(plant, course, ends, drives))
        for course in (middle, mean)
    )
    speed = jnp.where(lasts, (ends.q - begin) / jnp.where(lasts, duration, 1.0), 0.0)
    finite = solved & jnp.isfinite(averaged).all() & jnp.isfinite(sensed).all()
    return Response(sensed, averaged, ends.hyst, speed, finite)


def inertial_response(
    plant: Plant, schedule: Schedule, q: Scalar, speed: Scalar, hyst: Float[Array, "2"]
) -> Response:
    """Response with full inertia from q [rad or m], speed [rad/s or m/s] and HYST strains `hyst`."""
    plant, schedule = _behind_filters(plant, schedule)
    return _inertial(plant, schedule, initial_state(plant, schedule, q, speed, hyst))


def _inertial(plant: Plant, schedule: Schedule, state: PlantState) -> Response:
    states, solved = _solve(plant, schedule, state, StickSlip())
    ends = _after_each(states)
    drives = Drive(schedule.temperature[1:], schedule.load, schedule.applied)
    sensed = _sensed(plant, ends.q, ends, drives)
    sensed = _passed(plant, schedule, state, schedule.time[1:], sensed)
    finite = solved & jnp.isfinite(sensed).all()
    return Response(sensed, sensed, ends.hyst, ends.speed, finite)


def refined_response(plant: Plant, grid: FineGrid, q: Scalar, hyst: Float[Array, "2"]) -> Response:
    """What `quasi_static_response` says of the grid's former intervals, with full inertia."""
    plant, schedule = _behind_filters(plant, grid.schedule)
    state = at_rest(plant, schedule, initial_state(plant, schedule, q, 0.0, hyst))
    whole = _inertial(plant, schedule, state)
    start = plant.remembering(state.memory).sensed(state.q, hyst, schedule.first)
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
