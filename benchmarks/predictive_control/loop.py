"""The predictive controller as a law of the product's closed loop, and joints under it."""

import time
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from benchmarks.predictive_control.controller import Horizon, Predictive, Price
from benchmarks.predictive_control.model import SOFTENED, STATE, numbers_of, stage_function
from benchmarks.predictive_control.observer import Belief, Observer
from muscle_bayes.control.closed_loop import Clock, Trace, simulate, start_of
from muscle_bayes.control.judging.metrics import Metrics, metrics
from muscle_bayes.control.laws.law import FULL_DUTY, Measured
from muscle_bayes.control.plant.joint import Joint
from muscle_bayes.control.scenarios.scenario import Course, Scenario

EVERY = 17
"""Control periods of 30 ms from plan to plan: 0.51 s."""
STEPS = (*[1] * 8, *[2] * 8, *[4] * 7)
"""Lengths of the horizon's steps in plans, 26.5 s together."""
CEILING = 98.5
"""Temperature that the plan keeps [C]; the median joint's law may hold the same."""
CAUTION = 3.0
"""The plan keeps the ceiling so long in advance [s]: tubes and thermocouples differ from the median's."""


class Settings(NamedTuple):
    """What is chosen of the controller."""

    every: int = EVERY
    steps: tuple[int, ...] = STEPS
    ceiling: float = CEILING
    caution: float = CAUTION
    price: Price = Price()
    rounds: int = 2


class Controller:
    """Observer and plan of the median joint, without a memory of its own: that is a vector."""

    def __init__(self, median: Joint, settings: Settings, period: float = 0.03) -> None:
        self.settings, self.period = settings, period
        self.step = settings.every * period
        numbers = numbers_of(median)
        self.room = numbers.room
        self.sensor = median.potentiometer
        self.horizon = Horizon(tuple(self.step * n for n in settings.steps))
        stage, sloped = stage_function(numbers), stage_function(numbers, SOFTENED)
        bounded = np.zeros((2, STATE))  # T + caution T'
        for side in (0, 1):
            bounded[side, side] = settings.caution * numbers.gain[side]
            bounded[side, 2 + side] = 1.0 - settings.caution * numbers.cooling[side]
        self.plans = Predictive(
            stage,
            self.horizon,
            STATE - 1,
            bounded,
            price=settings.price,
            rounds=settings.rounds,
            sloped=sloped,
        )
        lag = float(median.thermocouples.lag)
        self.observer = Observer(numbers, lag, float(self.sensor.radians_per_count), self.step)
        nothing = jnp.zeros(())
        self.rest = np.asarray(start_of(median, nothing, nothing).hyst)
        self.seconds: list[float] = []
        """Of every plan."""

    @property
    def size(self) -> int:
        """Of the memory: belief, plan, and whether it has begun."""
        return 12 + 2 * len(self.horizon.steps) + 1

    def __call__(
        self, memory: np.ndarray, reading: float, probes: np.ndarray, wanted: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """The next memory, and duties from 0 to 255; reading and what is wanted in counts, probes in C."""
        begun = time.perf_counter()
        memory = np.asarray(memory)
        angle = (float(reading) - self.sensor.zero_reading) * self.sensor.radians_per_count
        aim = (float(wanted) - self.sensor.zero_reading) * self.sensor.radians_per_count
        heat, rest, plan = memory[:8].reshape(2, 4), memory[8:12], memory[12:-1].reshape(-1, 2)
        if memory[-1] == 0.0:
            belief = self.observer.at_rest(angle, self.rest)
        else:
            belief = Belief(heat, rest[:2], float(rest[2]), float(rest[3]))
        # Duties are rounded before they act, and the belief has to know.
        acted = np.rint(FULL_DUTY * plan[0]) / FULL_DUTY
        belief = self.observer.updated(belief, angle, np.asarray(probes), acted)
        guess = self.horizon.shifted(plan, self.step)
        state, disturbance = self.observer.state(belief)
        ceiling = self.settings.ceiling - self.room
        # What the setpoint will be is not known, no more than to the laws.
        level = np.full(len(guess), aim)
        plan = self.plans.plan(state, disturbance, level, ceiling, guess, acted)
        kept = [*belief.heat.reshape(-1), *belief.hyst, belief.angle, belief.torque]
        self.seconds.append(time.perf_counter() - begun)
        return np.r_[kept, plan.reshape(-1), 1.0], np.rint(FULL_DUTY * plan[0])


class _State(NamedTuple):
    memory: Array
    duty: Array
    period: Array


class PredictiveLaw(eqx.Module):
    """What `simulate` takes for a law: every so many periods it asks the controller, outside JAX."""

    controller: Controller = eqx.field(static=True)

    def initial(self, reading: Any) -> _State:
        """Cold, at rest, with no plan."""
        return _State(jnp.zeros(self.controller.size), jnp.zeros(2), jnp.zeros((), int))

    def update(self, state: _State, measured: Measured) -> tuple[_State, Array]:
        """The next state, and the duties (0 to 255) of heaters A and B until the next call."""
        shapes = (
            jax.ShapeDtypeStruct(state.memory.shape, state.memory.dtype),
            jax.ShapeDtypeStruct((2,), state.duty.dtype),
        )

        def planned() -> tuple[Array, Array]:
            rows = measured.reading, measured.temperature, measured.setpoint
            return jax.pure_callback(self.controller, shapes, state.memory, *rows)

        due = state.period % self.controller.settings.every == 0
        memory, duty = jax.lax.cond(due, planned, lambda: (state.memory, state.duty))
        return _State(memory, duty, state.period + 1), duty


@eqx.filter_jit
def _response(
    joint: Joint, law: PredictiveLaw, course: Course, seed: Array, clock: Clock
) -> tuple[Metrics, Trace]:
    start = start_of(joint, course.load[0], course.trained)
    trace = simulate(joint, law, course, start, jax.random.key(seed), clock)
    return metrics(course, trace, clock.period), trace


def respond(
    joint: Joint, controller: Controller, scenario: Scenario, seed: int = 0
) -> tuple[Metrics, Trace]:
    """Metrics and response of one joint, as NumPy arrays."""
    course = jax.tree.map(jnp.asarray, scenario.course)
    law, clock = PredictiveLaw(controller), Clock(controller.period)
    found = _response(joint, law, course, jnp.asarray(seed), clock)
    return jax.tree.map(np.asarray, found)
