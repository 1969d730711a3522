"""What the best input could do: duties optimised directly, knowing the joint and the future."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import least_squares

from muscle_bayes.control.closed_loop import Trace, resting_plant, start_of
from muscle_bayes.control.judging.metrics import Metrics, metrics
from muscle_bayes.control.judging.specification import HOTTEST
from muscle_bayes.control.laws.law import FULL_DUTY
from muscle_bayes.control.plant.draws import JointDraws
from muscle_bayes.control.plant.heater import HeaterState
from muscle_bayes.control.plant.joint import Joint
from muscle_bayes.control.plant.rotor import Motion
from muscle_bayes.control.scenarios.scenario import Course, Scenario, course_of
from muscle_bayes.inference.running.blas import one_blas_thread
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.physics.state import Drive
from muscle_bayes.progress import Report, silent

FEEDBACK = 2e4
"""Gain of the ideal feedback whose duties the optimisation starts from [duty / rad]."""
UNHURRIED = 15.0
"""Time after a jump from which errors count wholly [s]."""
LEAP = 0.1
"""Most that the angle moves between instants [rad]: where a muscle goes slack, slopes vanish."""
PER_KNOT = 4
"""Instants from knot to knot of the duties."""


HOT = 1.0
"""What a kelvin above HOTTEST costs, as an error of so many times the setpoint."""


@one_blas_thread
def feasible(
    draws: JointDraws,
    scenarios: Sequence[Scenario],
    period: float = 0.03,
    *,
    joints: int | None = None,
    knots: int = 60,
    rounds: int = 20,
    report: Report = silent,
) -> dict[str, Metrics]:
    """Metrics of joints under the best duties between 0 and 255 that keep 100 C, a row each.

    `joints` of the draws, by default half of them and 24 at most. Each has its own duties, which know it
    and the future; its rotor has dry friction and no inertia. Least squares of the error over time, by
    Gauss-Newton steps within bounds (a local optimum), from the duties of an ideal feedback of the true
    error. Fast scenarios are cut to what so many knots resolve.
    """
    chosen = range(min(joints or max(min(len(draws) // 2, 24), 4), len(draws)))
    found = {}
    for number, scenario in enumerate(scenarios):
        best = partial(_best, draws, *_thinned(scenario.course, period, knots), rounds)
        rows = [best(0)]  # alone, so that one thread compiles for all
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            rows += pool.map(best, chosen[1:])
        found[scenario.name] = Metrics(*map(np.asarray, zip(*rows, strict=True)))
        report("feasible", number + 1, len(scenarios))
    return found


def _thinned(course: Course, period: float, knots: int) -> tuple[Course, float]:
    """The course at PER_KNOT instants a knot, and the time between them [s]."""
    swings = np.flatnonzero(np.diff(np.sign(course.setpoint)) != 0)
    longest = course.setpoint.size * period
    if swings.size > 2:  # five knots from one crossing to the next
        longest = min(longest, float(np.median(np.diff(swings))) * period * knots / 5.0, 120.0)
    step = longest / (knots * PER_KNOT)
    at = (np.arange(knots * PER_KNOT) * step / period).astype(int)
    thin = course_of(
        course.setpoint[at],
        course.load[at],
        trained=bool(course.trained),
        judged_from=int(course.judged_from * period / step),
    )
    # Rounding of instants makes a smooth setpoint stand still now and then: jumps are the course's.
    kept = {k: getattr(course, k)[at] for k in ("turned", "loaded", "late", "towards", "late_of")}
    since = (course.since[at] * period / step).astype(int)
    return thin._replace(since=since, **kept), step


def _response(
    joint: Joint, course: Course, start: Motion, step: Array, knots: Array, feedback: float = 0.0
) -> Trace:
    """Angle and temperatures while duties change from knot to knot; `feedback` [duty / rad] adds to
    them what the true error asks for, at once."""
    plant, heat_step, room = resting_plant(joint), joint.heater.step(step), joint.heater.room
    duties = jnp.repeat(knots, PER_KNOT, axis=0)
    still, sides = jnp.zeros(()), jnp.array([-1.0, 1.0])

    def instant(state: tuple, now: tuple) -> tuple[tuple, Trace]:
        q, hyst, heat = state
        duty, load, setpoint = now
        drive = Drive(room + heat.excess, load, still)
        # One Newton step to where dry friction holds, which moves little from one instant to the next.
        force, slope = jax.jvp(lambda x: plant.force(x, still, hyst, drive), (q,), (1.0 + still,))
        dry = plant.dry_friction(q, still, hyst, drive)
        moving = force - jnp.clip(force, -dry, dry)
        leap = jnp.clip(moving / jnp.minimum(slope, -1e-6), -LEAP, LEAP)
        q = jnp.clip(q - leap, *plant.stops)
        duty = jnp.clip(duty + feedback * (setpoint - q) * sides, 0.0, FULL_DUTY)
        seen = Trace(q, room + heat.excess, duty, hyst)
        hyst = hyst + step * plant.hyst_rate(q, still, hyst, drive)
        return (q, hyst, heat_step(heat, duty)), seen

    first = (start.q, start.hyst, HeaterState(jnp.zeros(2), jnp.zeros(2)))
    return jax.lax.scan(instant, first, (duties, course.load, course.setpoint))[1]


@jax.jit
def _residuals(
    flat: Array, joint: Joint, course: Course, start: Motion, step: Array
) -> Float[Array, " residual"]:
    trace = _response(joint, course, start, step, flat.reshape(-1, 2))
    size = jnp.sqrt(jnp.mean(course.setpoint**2))
    judged = jnp.arange(trace.angle.size) >= course.judged_from
    # Right after a jump errors count little: else it would pay to leave for the next jump before it comes.
    fresh = jnp.clip((course.since * step / UNHURRIED) ** 3, 1e-3, 1.0)
    judged = judged * jnp.where(course.turned | course.loaded, fresh, 1.0)
    hot = jnp.maximum(trace.temperature - (HOTTEST - 1.0), 0.0).reshape(-1)
    return jnp.concatenate([judged * (course.setpoint - trace.angle) / size, HOT * hot])


_slopes = jax.jit(jax.jacfwd(_residuals))


@double_precision
def _best(draws: JointDraws, course: Course, step: float, rounds: int, index: int) -> Metrics:
    """Metrics of one draw's joint under the duties that follow the course best."""
    joint = draws.one(index)
    start = eqx.filter_jit(start_of)(
        joint, jnp.asarray(course.load[0]), jnp.asarray(course.trained)
    )
    rest = (joint, course, start, jnp.asarray(step))
    none = jnp.zeros((course.setpoint.size // PER_KNOT, 2))
    follows = eqx.filter_jit(_response)(*rest, none, FEEDBACK).duty
    each = np.asarray(follows).reshape(-1, PER_KNOT, 2).mean(1)

    def residuals(flat: np.ndarray) -> np.ndarray:
        return np.asarray(_residuals(jnp.asarray(flat), *rest))

    def slopes(flat: np.ndarray) -> np.ndarray:
        return np.asarray(_slopes(jnp.asarray(flat), *rest))

    best = least_squares(
        residuals,
        np.clip(each.reshape(-1), 3.0, FULL_DUTY - 3.0),
        slopes,
        bounds=(0.0, FULL_DUTY),
        max_nfev=rounds,
    )
    trace = eqx.filter_jit(_response)(*rest, jnp.asarray(best.x).reshape(-1, 2))
    return jax.tree.map(float, eqx.filter_jit(metrics)(course, trace, step))
