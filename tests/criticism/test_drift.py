"""Creep while cold, of runs that creep at a known rate."""

import json

import numpy as np
import pytest
from known_cases import gaussian, sawtooth

from muscle_bayes.criticism.drift import cold_phases, drift, inflation


def test_known_slopes_are_recovered():
    found = drift(sawtooth(slope=2.0, predicted=1.5))
    assert len(found.phases) == 4
    for phase in found.phases:
        assert phase.slope.measured == pytest.approx(0.5, abs=4.0 * phase.slope.standard_error)
        assert phase.slope.predicted.mean == pytest.approx(0.375, abs=0.01)
        # The mean of a ramp's last 15 % lies 85 % of its 158 s after that of its first.
        assert phase.shift.measured == pytest.approx(0.5 * 0.85 * 158.0 / 60.0, abs=0.12)
    assert found.slope_difference.q05 < 0.125 < found.slope_difference.q95
    assert found.slope_difference.q05 > 0.0


def test_no_difference_lies_within_the_interval_nine_times_of_ten():
    covered = []
    for seed in range(60):
        one = sawtooth(slope=1.5, predicted=1.5, seed=seed)
        estimate = drift(one, seed).slope_difference
        covered.append(estimate.q05 < 0.0 < estimate.q95)
    assert np.mean(covered) > 0.8


def test_slopes_follow_the_coordinate_not_the_reading():
    one = sawtooth()
    turned = drift(one._replace(scale=-one.scale))
    assert turned.phases[0].slope.measured == pytest.approx(-drift(one).phases[0].slope.measured)


def test_a_load_step_ends_a_phase():
    one = sawtooth()
    stepped = one._replace(load=np.where(one.time < 120.0, 0.1, 0.2))
    assert len(cold_phases(stepped)) == 5


def test_cold_before_the_first_heating_does_not_count():
    one = sawtooth()
    late = one._replace(temperature=np.where(one.time < 300.0, 25.0, one.temperature))
    assert one.time[cold_phases(late)[0].start] == 440.0


def test_a_stray_reading_does_not_end_a_phase():
    one = sawtooth()
    temperature = one.temperature.copy()
    temperature[50] = 60.0
    assert len(cold_phases(one._replace(temperature=temperature))) == 4


@pytest.mark.parametrize(
    ("temperature", "words"),
    [(np.full(100, 25.0), "never rises"), (np.linspace(25, 90, 100), "no 30")],
)
def test_without_a_cold_phase_the_reason_is_told(temperature, words):
    found = drift(gaussian(readings=100, temperature=temperature))
    assert found.phases == ()
    assert found.slope_difference is None
    assert words in found.reason
    assert words in found._repr_html_()


def test_errors_widen_with_autocorrelation_as_for_an_ar1_process():
    rng = np.random.default_rng(1)
    values = np.zeros(20_000)
    for i, kick in enumerate(rng.standard_normal(values.size - 1)):
        values[i + 1] = 0.6 * values[i] + kick
    assert inflation(values) == pytest.approx(2.0, rel=0.05)
    assert inflation(rng.standard_normal(20_000)) == pytest.approx(1.0, rel=0.03)


def test_report_is_plain():
    told = json.loads(json.dumps(drift(sawtooth()).as_dict()))
    assert told["unit"] == "deg"
    assert told["phases"][0]["slope"]["difference"].keys() == {"mean", "q05", "q95"}
