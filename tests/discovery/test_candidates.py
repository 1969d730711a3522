"""Candidates whose signatures are given: where descents begin, and what could be seen at all."""

from typing import Any

import numpy as np
import pytest

from muscle_bayes.discovery.candidates import (
    Candidate,
    could_show,
    log_bayes_factors,
    promising,
)
from muscle_bayes.physics.effects import effect_type

NOTHING: Any = None


def _candidate(effect: str, strength: float, gain: float, signature: list[float]) -> Candidate:
    return Candidate(effect, strength, gain, NOTHING, np.array(signature))


def test_every_strength_is_a_start() -> None:
    found = [_candidate("a", s, g, [0.0]) for s, g in ((1.0, 9.0), (1.0, 8.0), (1.0, 7.0))]
    found += [_candidate("a", 0.1, 2.0, [0.0]), _candidate("a", 0.01, 1.0, [0.0])]
    wanted = [(1.0, 9.0), (1.0, 8.0), (0.1, 2.0), (0.01, 1.0)]
    assert [(one.strength, one.gain) for one in promising(found)] == wanted
    assert promising([]) == []


def test_a_weaker_effect_acts_where_it_acted() -> None:
    """A Stribeck speed or a time constant is a shape: only what is 0 without the effect gets weaker."""
    strengths = (1.0, 0.1, 0.01)
    for name in ("stribeck-friction", "second-relaxation", "force-scale"):
        for key, parameter in effect_type(name).parameters.items():
            weaker = parameter.weakened(np.array([[0.4], [3.0]]), np.array(strengths))
            wanted = np.outer([0.4, 3.0], (1.0, 1.0, 1.0) if parameter.off else strengths)
            np.testing.assert_allclose(np.broadcast_to(weaker, (2, 3)), wanted, err_msg=key)


def test_evidence_of_the_linearised_model_is_the_mean_over_the_prior() -> None:
    gains = np.array([0.5, -2.0, -900.0])
    found = {"a": [_candidate("a", 1.0, float(g), [0.0]) for g in gains]}
    found["a"].append(_candidate("a", 0.1, 50.0, [0.0]))  # no draw of the prior
    assert log_bayes_factors(found)["a"] == pytest.approx(np.log(np.exp(gains).mean()))
    assert log_bayes_factors({"b": []})["b"] < -100.0


def test_what_could_not_be_seen_and_what_is_alike_is_told() -> None:
    strong, weak = [5.0, 0.0, 0.0], [0.1, 0.0, 0.0]
    found = {
        "seen": [_candidate("seen", 1.0, 0.0, strong), _candidate("seen", 1.0, 0.0, strong)],
        "alike": [_candidate("alike", 1.0, 0.0, [-4.9, 0.1, 0.0])],
        "other": [_candidate("other", 1.0, 0.0, [0.0, 4.0, 4.0])],
        "unseen": [_candidate("unseen", 1.0, 0.0, weak)],
    }
    visible = could_show(found)
    assert visible.share == {"seen": 1.0, "alike": 1.0, "other": 1.0, "unseen": 0.0}
    assert visible.unseen == ("unseen",)
    assert visible.alike == (("seen", "alike"),)
    for words in ("could show: seen, alike, other", "not show: unseen", "seen and alike"):
        assert words in visible.text()
