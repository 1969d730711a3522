"""The thesis' nine scenarios (Fig. 31-39), and three that it could not try."""

import numpy as np

from muscle_bayes.control.scenarios.scenario import Course, Scenario, course_of

STEP = 0.08
"""Amplitude of setpoints [rad]: what the bench's muscles reach within their trained temperatures."""
LOAD = 0.010
"""Mass [kg] of load steps, and peak of load sines."""
START = 5.0
"""When steps come [s]."""
SHORT, LONG = 120.0, 300.0
"""Lengths of scenarios [s]."""
HALF_PERIOD = 30.0
"""Of the square wave [s]."""
FREQUENCIES = (0.0318, 0.1592, 0.4775)
"""Of sines, as in the thesis [Hz]."""
BEYOND_REACH = 3.0 * STEP
"""Setpoint that saturates the heaters [rad]."""


def _grid(length: float, period: float) -> np.ndarray:
    return np.arange(round(length / period)) * period


def step(period: float, size: float = STEP, **options) -> Course:
    """The setpoint jumps; nothing hangs."""
    time = _grid(SHORT, period)
    return course_of(np.where(time >= START, size, 0.0), 0.0 * time, **options)


def square(period: float) -> Course:
    """Symmetric square wave."""
    time = _grid(LONG, period)
    half = round(HALF_PERIOD / period)
    sign = np.where((np.arange(time.size) // half) % 2 == 0, 1.0, -1.0)
    return course_of(STEP * sign, 0.0 * time)


def load_step(period: float) -> Course:
    """A load is hung on while a step's response is over."""
    time = _grid(SHORT, period)
    load = np.where(time >= 0.5 * SHORT, LOAD, 0.0)
    return course_of(np.where(time >= START, STEP, 0.0), load)


def load_sine(period: float, frequency: float) -> Course:
    """Load m (1 - cos) / 2 during a step response; tracking is judged in the second half."""
    time = _grid(SHORT, period)
    load = 0.5 * LOAD * (1.0 - np.cos(2 * np.pi * frequency * time))
    setpoint = np.where(time >= START, STEP, 0.0)
    return course_of(setpoint, load, judged_from=round(0.5 * SHORT / period))


def setpoint_sine(period: float, frequency: float, length: float = SHORT) -> Course:
    """The setpoint swings; nothing hangs. Judged from the first whole period on."""
    time = _grid(length, period)
    setpoint = STEP * np.sin(2 * np.pi * frequency * time)
    return course_of(setpoint, 0.0 * time, judged_from=round(1.0 / frequency / period))


def thesis_scenarios(period: float = 0.03) -> tuple[Scenario, ...]:
    """The nine, at a control period [s], without sensor noise as there; readings are rounded."""
    sines = [
        Scenario(f"{what}-sine-{f:g}", about.format(f), build(period, f))
        for what, about, build in (
            ("load", "load sine of {:g} Hz during a step", load_sine),
            ("setpoint", "setpoint sine of {:g} Hz", setpoint_sine),
        )
        for f in FREQUENCIES
    ]
    return (
        Scenario("step", "step of the setpoint", step(period)),
        Scenario("square", "symmetric square wave", square(period)),
        Scenario("load-step", "load step after a step", load_step(period)),
        *sines,
    )


def harder_scenarios(period: float = 0.03) -> tuple[Scenario, ...]:
    """Sensor noise, saturation, and muscles fresh from training."""
    return (
        Scenario("noisy-step", "step with sensor noise", step(period, noise=True)),
        Scenario("saturation", "step beyond reach", step(period, size=BEYOND_REACH)),
        Scenario("cold-start", "step, fresh from training", step(period, trained=True)),
    )
