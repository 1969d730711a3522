"""Heater tube and controller against their closed forms and the thesis' constants."""

from math import exp

import pytest

from muscle_bayes.twin.controller import PERIOD, HeaterController
from muscle_bayes.twin.plant.heater import HeaterTube


def test_tube_heats_at_full_rate_and_cools_as_newton_says():
    tube = HeaterTube(4.5, 48.0, 25.0)
    assert tube.advance(255.0, 1e-4) == pytest.approx(25.0 + 4.5e-4)
    tube.temperature = 90.0
    assert tube.advance(0.0, 100.0) == pytest.approx(25.0 + 65.0 * exp(-100.0 / 48.0))
    assert tube.advance(51.0, 1e5) == pytest.approx(25.0 + 4.5 * 48.0 / 5)


def test_tube_does_not_depend_on_how_time_is_cut():
    one, many = HeaterTube(4.5, 48.0, 25.0), HeaterTube(4.5, 48.0, 25.0)
    one.advance(120.0, 30.0)
    for _ in range(1000):
        many.advance(120.0, PERIOD)
    assert many.temperature == pytest.approx(one.temperature)


def test_output_has_the_constants_of_the_bench():
    controller = HeaterController()
    controller.aim(60.0)
    error = 60.0 - 59.5
    expected = 0.55 * (-55.4 + 1.5 * 60.0 + 30.0 * error + 25.0 * 0.03 * error)
    assert controller.update(59.5, 0.0) == pytest.approx(expected)
    expected += 0.55 * 25.0 * 0.03 * error
    assert controller.update(59.5, PERIOD) == pytest.approx(expected)


def test_output_and_integral_are_clamped():
    controller = HeaterController()
    controller.aim(90.0)
    assert controller.update(25.0, 0.0) == 255.0
    for tick in range(100):
        controller.update(25.0, tick * PERIOD)
    assert controller.integral == 500.0
    controller.aim(25.0)
    assert controller.update(90.0, 4.0) == 0.0
    for tick in range(100):
        controller.update(90.0, 4.0 + tick * PERIOD)
    assert controller.integral == -500.0


def test_a_channel_without_setpoint_is_off():
    controller = HeaterController()
    assert controller.update(10.0, 0.0) == 0.0
    assert not controller.stable


def test_stable_means_within_1_c_for_more_than_10_s():
    controller = HeaterController()
    controller.aim(60.0)
    controller.update(61.0, 0.0)
    controller.update(59.0, 10.0)
    assert not controller.stable
    controller.update(60.0, 10.03)
    assert controller.stable
    controller.update(61.1, 10.06)
    assert not controller.stable
    controller.update(60.0, 10.09)
    controller.update(60.0, 20.0)
    assert not controller.stable
