"""Heater parameters from logged temperatures, against the truth of simulated tubes."""

import numpy as np
import pandas as pd
import pytest

from muscle_bayes.bench.heat.temperature_control import HeaterLaw
from muscle_bayes.control.plant.certain_duty import STEP, certain_duty
from muscle_bayes.control.plant.heater_fit import PRIOR, assumed_heater, fit_heater, response
from muscle_bayes.data import Fixture, Metadata, Run
from muscle_bayes.data.describing.elements import MuscleElement
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin.controller import PERIOD, HeaterController
from muscle_bayes.twin.plant.heater import HeaterTube


def recorded(
    setpoints, *, gain=5.0, cooling_time=40.0, seed=0, hold=180.0, logs_duty=False, row=0.1
):
    """A log of the twin's tube under the bench's controller: 0.1 C, 0.4 s, a row every `row` s."""
    generator = np.random.default_rng(seed)
    tube, controller = HeaterTube(gain, cooling_time, 24.0), HeaterController()
    rows, reading, due, next_row, time, duty = [], 24.0, 0.0, 0.0, 0.0, 0
    for setpoint in setpoints:
        controller.aim(setpoint)
        for _ in range(round(hold / PERIOD)):
            if time >= due:
                reading = round(float(tube.temperature + 0.05 * generator.standard_normal()), 1)
                due = time + 0.4
            if time >= next_row:
                told = duty if logs_duty else np.nan
                rows.append((time, 500.0, reading, 24.0, setpoint, np.nan, 0.1, 0.0, told, np.nan))
                next_row = time + row - 1e-6
            duty = controller.update(reading, time)
            tube.advance(duty, PERIOD)
            time += PERIOD
    names = (
        "time reading temperature_a temperature_b setpoint_a setpoint_b load applied duty_a duty_b"
    )
    side = {"rotor_radius_a": 0.03, "anchor_x_a": 0.03, "anchor_y_a": 0.1}
    metadata = Metadata.model_validate(
        {
            "protocol": "free",
            "origin": "synthetic",
            "fixture": Fixture(**side, disc_radius=0.1, room_temperature=24.5),
            "potentiometer": {"zero_reading": 500.0, "radians_per_count": 0.006},
            "element_a": MuscleElement(base_length=0.1),
        }
    )
    return Run("heated", None, metadata, pd.DataFrame(rows, columns=names.split()))


def test_truth_is_where_the_posterior_says():
    scores = []
    for seed in range(4):
        found = fit_heater([recorded((25.0, 90.0, 25.0, 90.0, 25.0), seed=seed)])
        assert found.told == {"gain": True, "cooling": True, "lag": True}
        for name, truth in (("gain", 5.0), ("cooling", 1 / 40)):
            draws = found.draws[name]
            assert draws.std() < 0.01 * truth
            assert draws.mean() == pytest.approx(truth, rel=0.01)
            scores.append((draws.mean() - truth) / draws.std())
        # No lag: it cannot be told from one of less than the time between updates.
        assert np.quantile(found.draws["lag"], 0.95) < 0.5
    assert np.abs(scores).max() < 3.5
    assert 0.3 < np.std(scores) < 2.0


def test_without_full_power_the_gain_is_not_told_and_says_so():
    found = fit_heater([recorded((60.0, 25.0))])
    assert found.told == {"gain": False, "cooling": True, "lag": True}
    assert np.log(found.draws["gain"]).std() == pytest.approx(PRIOR["gain"][1], rel=0.1)
    assert found.draws["cooling"].mean() == pytest.approx(1 / 40, rel=0.02)


def test_where_nothing_is_certain_it_says_what_to_record():
    with pytest.raises(MuscleBayesError, match="cool from 90 C"):
        fit_heater([recorded((25.0, 27.0, 25.0))])


def test_certainty_is_what_no_integral_can_change():
    law = HeaterLaw()
    setpoint = np.array([90.0, 90.0, 25.0, 25.0, np.nan, 90.0])
    temperature = np.array([25.0, 64.0, 90.0, 36.9, 80.0, 80.0])
    found = certain_duty(setpoint, temperature, law)
    assert found == pytest.approx([1.0, 1.0, 0.0, np.nan, 0.0, np.nan], nan_ok=True)
    for integral in (-500.0, 500.0):
        for s, t, certain in zip(setpoint[:4], temperature[:4], found[:4], strict=True):
            if np.isfinite(certain):
                assert law.output(s, s - t, integral) == 255.0 * certain


def test_logged_duty_tells_whatever_law_was_at_work():
    setpoints, unlike = (25.0, 90.0, 25.0), HeaterLaw(gain=0.01)
    assert not fit_heater([recorded(setpoints)], unlike).told["gain"]
    found = fit_heater([recorded(setpoints, logs_duty=True)], unlike)
    assert found.told["gain"]
    assert found.draws["gain"].mean() == pytest.approx(5.0, rel=0.02)
    assert found.draws["cooling"].mean() == pytest.approx(1 / 40, rel=0.02)


def test_a_logged_duty_tells_gain_and_cooling_of_any_run():
    """Small steps about 60 C, whose duty is never nothing nor full for long."""
    setpoints = (60.0, 50.0, 65.0, 55.0, 70.0)
    run = recorded(setpoints, hold=60.0, logs_duty=True, row=PERIOD)
    found = fit_heater([run])
    for name, truth in (("gain", 5.0), ("cooling", 1 / 40)):
        draws = found.draws[name]
        assert draws.mean() == pytest.approx(truth, rel=0.03)
        assert abs(draws.mean() - truth) < 4.0 * draws.std()
    assert found.told == {"gain": True, "cooling": True, "lag": True}


def test_the_response_is_that_of_the_equations():
    """Against ten thousand small explicit steps."""
    generator = np.random.default_rng(3)
    duty = generator.uniform(0.0, 1.0, 200)
    cooling, lag, fine = 1 / 40, 0.7, 2000
    power = excess = 0.0
    expected = [0.0]
    for share in duty[:-1]:
        for _ in range(fine):
            power, excess = (
                power + STEP / fine * (share - power) / lag,
                excess + STEP / fine * (power - cooling * excess),
            )
        expected.append(excess)
    assert response(duty, cooling, lag) == pytest.approx(np.array(expected), abs=1e-4)


def test_assumed_heaters_say_so():
    found = assumed_heater()
    assert not any(found.told.values())
    assert "assumed" in found.source
    assert "assumed" in found._repr_html_()
