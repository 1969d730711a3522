"""Slow motion: rotor inertia eliminated, dry friction as a play operator, HYST integrated."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from muscle_bayes.physics.breakaway import dry_levels
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.plant import Drive, Plant
from muscle_bayes.physics.schedule import Schedule
from muscle_bayes.physics.slide import Pair, force_over, settle

GAMMA = 1.0 - 0.5**0.5
"""Coefficient that makes the two-stage Rosenbrock method ROS2 L-stable."""


class SlowState(NamedTuple):
    """State of slow motion."""

    q: Scalar
    """Coordinate at the end of the interval [rad or m]."""
    hyst: Float[Array, "2"]
    """sigma_hyst of sides A and B."""
    q_middle: Scalar
    """Coordinate in the middle of the interval [rad or m]."""


once = jax.lax.optimization_barrier
"""Has a value computed once: else the compiler does so wherever it is used, with all derivatives."""


def _sides(plant: Plant) -> tuple[int, ...]:
    """Which of both sides has a muscle, and so a sigma_hyst that moves."""
    return tuple(i for i, side in enumerate((plant.side_a, plant.side_b)) if side.relaxes)


def _with(hyst: Pair, side: int, value: Scalar) -> Pair:
    return (value, hyst[1]) if side == 0 else (hyst[0], value)


class _Path(NamedTuple):
    """Where the rotor is while HYST moves over a step: q + sum of along * (its move), by side."""

    q: Scalar
    along: tuple[Scalar, ...]

    def at(self, moves: tuple[Scalar, ...]) -> Scalar:
        """Coordinate after these moves of sigma_hyst."""
        return self.q + sum(by * move for by, move in zip(self.along, moves, strict=True))


def _path(plant: Plant, q: Scalar, hyst: Pair, drive: Drive, duration: Scalar) -> _Path:
    """The rotor's path under a drive, to first order in sigma_hyst.

    Where the rotor slides the balance of forces sets the tension, and HYST follows that and not the
    springs' stiffness. HYST seen from a rotor at rest would give way as soon as its own spring was
    relieved: far too little, where MODULUS is stiff.
    """
    dry, static = levels = dry_levels(plant, q, hyst, drive, duration)
    at = once(settle(plant, q, hyst, drive, duration, levels))
    pull, slope = jax.jvp(lambda x: force_over(x, (plant, q, hyst, drive, duration)), (at,), (1.0,))
    relief = []
    for side in _sides(plant):

        def pull_at(value: Scalar, side=side) -> Scalar:
            return force_over(at, (plant, q, _with(hyst, side, value), drive, duration))

        relief.append(jax.jvp(pull_at, (hyst[side],), (1.0,))[1])
    # How hard would the rotor be pulled at q, temperature and HYST having moved? HYST first takes back
    # what temperature made the rotor slide, under a tension that stays; then it relaxes against a
    # rotor that rests.
    still = jax.lax.stop_gradient((at, hyst, plant, drive))
    rate, rate_slope = [], []
    for side in _sides(plant):

        def rate_at(value: Scalar, side=side) -> Scalar:
            now, hyst, plant, drive = still
            return plant.hyst_rates(now, jnp.zeros_like(now), _with(hyst, side, value), drive)[side]

        value, by_value = jax.jvp(rate_at, (still[1][side],), (1.0,))
        rate.append(value)
        rate_slope.append(jnp.minimum(by_value, 0.0))
    speeds = [by * value for by, value in zip(relief, rate, strict=True)]
    total, slide = sum(speeds), (q - at) * slope
    opposed = total * slide < 0.0
    taking = jnp.where(opposed, jnp.abs(slide) / jnp.where(opposed, jnp.abs(total), 1.0), 0.0)
    taking = jnp.minimum(taking, duration)
    left = duration - taking
    growth = sum(
        speed * left / (1.0 - left * by_value)
        for speed, by_value in zip(speeds, rate_slope, strict=True)
    )
    held = pull + slide + total * taking + growth
    direction = jnp.sign(held)
    inside = (at > plant.stops[0]) & (at < plant.stops[1])
    firm = (slope < 0.0) & inside
    free = firm & ((jnp.abs(held) > static) | (static == 0.0))
    softness = jnp.where(free, -1.0 / jnp.where(free, slope, -1.0), 0.0)
    onward = at + (pull - direction * dry) * softness
    at = jnp.where(firm & ~free, q, jnp.where(static == 0.0, at, onward))
    return _Path(at, tuple(by * softness for by in relief))


def _moved(plant: Plant, hyst: Pair, moves: tuple[Scalar, ...]) -> Pair:
    for side, move in zip(_sides(plant), moves, strict=True):
        hyst = _with(hyst, side, hyst[side] + move)
    return hyst


def _moves(
    plant: Plant, path: _Path, hyst: Pair, drive: Drive, duration: Scalar
) -> tuple[Scalar, ...]:
    """How far HYST moves in `duration` along the rotor's path, by side.

    ROS2 (Verwer et al., SIAM J. Sci. Comput. 20, 1999): second order, L-stable.
    """
    sides = _sides(plant)
    if not sides:
        return ()

    def rates(*moves: Scalar) -> tuple[Scalar, ...]:
        q = path.at(moves)
        rate = plant.hyst_rates(q, jnp.zeros_like(q), _moved(plant, hyst, moves), drive)
        return tuple(rate[side] for side in sides)

    none = tuple(jnp.zeros_like(path.q) for _ in sides)
    columns = []
    for place in range(len(sides)):

        def along(move: Scalar, place=place) -> tuple[Scalar, ...]:
            return rates(*none[:place], move, *none[place + 1 :])

        value, column = jax.jvp(along, (none[place],), (1.0,))
        columns.append(column)
    value, columns = once((value, columns))
    solve = _inverse(columns, GAMMA * duration)
    first = solve(value)
    late = rates(*(duration * one for one in first))
    second = solve(tuple(a - 2.0 * b for a, b in zip(late, first, strict=True)))
    return tuple(duration * (1.5 * a + 0.5 * b) for a, b in zip(first, second, strict=True))


def _inverse(columns, step):
    """The map x -> (1 - step * matrix)^-1 x of a matrix with one or two columns."""
    if len(columns) == 1:
        scale = 1.0 / (1.0 - step * columns[0][0])
        return lambda x: (scale * x[0],)
    (aa, ba), (ab, bb) = columns
    a, b, c, d = 1.0 - step * aa, -step * ab, -step * ba, 1.0 - step * bb
    scale = 1.0 / (a * d - b * c)
    return lambda x: (scale * (d * x[0] - b * x[1]), scale * (a * x[1] - c * x[0]))


def slow_step(
    plant: Plant, state: SlowState, schedule: Schedule, index: Int[Array, ""]
) -> SlowState:
    """One interval: slide to the middle's drive, HYST across with the rotor along, slide to the end.

    HYST sees the drive of the middle (midpoint rule), so q and sigma_hyst are second-order accurate
    in the interval's length. Where the load jumps, it should be followed by a short interval, lest
    HYST sees the new load from the old coordinate.
    """
    return arrive(plant, once(cross(plant, state, schedule, index)), schedule, index)


def cross(plant: Plant, state: SlowState, schedule: Schedule, index: Int[Array, ""]) -> SlowState:
    """HYST at the end of the interval, the rotor in its middle."""
    duration = schedule.time[index + 1] - schedule.time[index]
    before, after = schedule.temperature[index], schedule.temperature[index + 1]
    load, applied = schedule.load[index], schedule.applied[index]
    braking = 0.5 * (schedule.braking[index] + schedule.braking[index + 1])
    # Where temperature turns, its chord would cut the peak at which friction leaves the rotor.
    half = 0.5 * (before + after) + braking * duration**2 / 8.0
    middle = Drive(half, load, applied)
    begun = state.hyst[0], state.hyst[1]
    path = _path(plant, state.q, begun, middle, 0.5 * duration)
    path = once(path)
    moves = _moves(plant, path, begun, middle, duration)
    q = path.at(tuple(0.5 * move for move in moves))
    there = SlowState(q, jnp.stack(_moved(plant, begun, moves)), q)
    return _lasting(duration, index, there, state._replace(q_middle=state.q))


def arrive(plant: Plant, state: SlowState, schedule: Schedule, index: Int[Array, ""]) -> SlowState:
    """The rotor from the middle to the end of the interval."""
    duration = schedule.time[index + 1] - schedule.time[index]
    after, load, applied = (
        schedule.temperature[index + 1],
        schedule.load[index],
        schedule.applied[index],
    )
    hyst = state.hyst[0], state.hyst[1]
    drive = Drive(after, load, applied)
    levels = dry_levels(plant, state.q, hyst, drive, 0.5 * duration)
    q = settle(plant, state.q, hyst, drive, 0.5 * duration, levels)
    return _lasting(duration, index, state._replace(q=q), state)


def _lasting(
    duration: Scalar, index: Int[Array, ""], moved: SlowState, still: SlowState
) -> SlowState:
    """An interval of no length is padding, whatever its load: else the rotor would slide.

    But for the first, in which the rotor comes to rest.
    """
    padding = (duration <= 0.0) & (index > 0)
    return SlowState(*(jnp.where(padding, a, b) for a, b in zip(still, moved, strict=True)))
