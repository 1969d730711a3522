"""Results of the control study as notebooks show them."""

import numpy as np
import pytest

from muscle_bayes.control.gains import FeedForward, Gains
from muscle_bayes.control.heater_fit import HeaterPosterior
from muscle_bayes.control.study import RunawayCurve
from muscle_bayes.control.tune import Tuning

GAINS = Gains(proportional=1234.5, integral=20.0, bias=6.0)


def test_gains_have_units():
    shown = GAINS._repr_html_()
    for words in ("pi-antiwindup", "1234.5", "duty / rad", "<td>30</td>"):
        assert words in shown
    assert "K / rad" in GAINS.model_copy(update={"law": "cascade"})._repr_html_()
    table = FeedForward(angle=(0.0, 0.1), output=(0.0, 30.0))
    fed = GAINS.model_copy(update={"law": "pi-feedforward", "feedforward": table})
    assert "2 entries" in fed._repr_html_()


def test_a_tuning_tells_its_criterion_and_gains():
    shown = Tuning(GAINS, 0.4321, "probability of missing energy <= 3", 40)._repr_html_()
    assert "energy &lt;= 3 0.4321, 40 evaluations" in shown
    assert "1234.5" in shown


def test_names_of_runs_are_not_taken_for_markup():
    draws = dict.fromkeys(("gain", "cooling", "lag"), np.ones(3))
    shown = HeaterPosterior(draws, dict.fromkeys(draws, True), "from <b>")._repr_html_()
    assert "from &lt;b&gt;" in shown


def test_a_runaway_curve_has_a_line_a_frequency():
    errors = np.array([[0.1, 0.2, 0.3], [0.9, 1.0, 1.1]])
    curve = RunawayCurve(np.array([0.01, 0.2]), np.array([0.0, 0.5]), np.array([0.0, 1.0]), errors)
    shown = curve._repr_html_()
    assert "0.20 (0.10 to 0.30)" in shown
    assert shown.count("<tr>") == 3
    assert "<td>50%</td><td>100%</td>" in shown


@pytest.mark.parametrize("how", [repr, lambda draws: draws._repr_html_()])
def test_joints_are_told_without_their_arrays(joints, how):
    shown = how(joints)
    assert "4 joints, linear friction" in shown
    assert "array" not in shown


def test_a_joint_in_a_notebook_has_its_quantities(joints):
    shown = joints._repr_html_()
    assert "<td>K_modulus</td>" in shown
    assert "<td>heater.gain</td>" in shown
