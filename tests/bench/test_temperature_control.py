"""The thesis' law against hand-worked values and the twin's own controller."""

import numpy as np
import pytest

from muscle_bayes.bench.heat.temperature_control import PERIOD, HeaterLaw, TemperatureControl
from muscle_bayes.twin.controller import HeaterController


def test_worked_values():
    law = HeaterLaw()
    assert law.output(60.0, 0.0, 0.0) == pytest.approx(0.55 * (-55.4 + 90.0))
    assert law.output(60.0, 2.0, 10.0) == pytest.approx(0.55 * (-55.4 + 90.0 + 60.0 + 7.5))
    assert law.output(90.0, 50.0, 0.0) == 255.0
    assert law.output(25.0, -10.0, 0.0) == 0.0


def test_agrees_with_the_twin_s_controller():
    rng = np.random.default_rng(4)
    ours, twins = TemperatureControl(), HeaterController()
    temperature = 25.0
    for tick in range(20_000):
        if tick % 4000 == 0:
            setpoint = [40.0, None, 80.0, 25.0, 60.0][tick // 4000]
            ours.aim(setpoint)
            twins.aim(setpoint)
            ours.integral = twins.integral  # ours forgets it while it is off
        goal = 25.0 if setpoint is None else setpoint
        temperature += 0.003 * (goal - temperature) + rng.normal(0.0, 0.05)
        expected = twins.update(temperature, tick * PERIOD)
        assert ours.update(temperature, tick * PERIOD) == round(expected)
        assert ours.stable == (twins.stable if setpoint is not None else False)


def test_integral_is_clamped():
    control = TemperatureControl()
    control.aim(90.0)
    for tick in range(10_000):
        control.update(20.0, tick * PERIOD)
    assert control.integral == 500.0


def test_stable_takes_more_than_ten_seconds_within_one_degree():
    control = TemperatureControl()
    control.aim(50.0)
    found = []
    for tick in range(500):
        control.update(51.0 if tick else 51.1, tick * PERIOD)
        found.append(control.stable)
    first = found.index(True)
    assert (first - 1) * PERIOD == pytest.approx(10.0, abs=2 * PERIOD)
    control.update(48.9, 501 * PERIOD)
    assert not control.stable


def test_off_forgets():
    control = TemperatureControl()
    control.aim(90.0)
    control.update(20.0, 0.0)
    control.off()
    assert (control.duty, control.integral, control.stable) == (0, 0.0, False)
