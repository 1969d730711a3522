"""Results of the control study as notebooks show them."""

import numpy as np
import pytest

from muscle_bayes.control.laws.gains import Gains
from muscle_bayes.control.plant.heater_fit import HeaterPosterior
from muscle_bayes.control.tune import Tuning

GAINS = Gains(proportional=1234.5, integral=20.0, bias=6.0)


def test_gains_have_units():
    shown = GAINS._repr_html_()
    for words in ("1234.5", "duty/rad", "bias 6 duty"):
        assert words in shown


def test_a_tuning_tells_its_probability_and_edges():
    shown = Tuning(GAINS, 0.4321, 0.1, ("bias",))._repr_html_()
    assert "probability 0.43" in shown
    assert "edge of the search: bias" in shown


def test_names_of_runs_are_not_taken_for_markup():
    draws = dict.fromkeys(("gain", "cooling", "lag"), np.ones(3))
    shown = HeaterPosterior(draws, dict.fromkeys(draws, True), "from <b>")._repr_html_()
    assert "from &lt;b&gt;" in shown


@pytest.mark.parametrize("how", [repr, lambda draws: draws._repr_html_()])
def test_joints_are_told_without_their_arrays(joints, how):
    shown = how(joints)
    assert "4 joints, coulomb friction" in shown
    assert "array" not in shown
