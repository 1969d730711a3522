"""The first page's numbers follow their formulas, and its sentences what the stages found."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "criticism"))
from known_cases import posterior_of

from muscle_bayes.report import words
from muscle_bayes.study.answers import answers
from muscle_bayes.study.config import StudyConfig
from muscle_bayes.study.published import THESIS

VALUES = {
    "J": 1.2e-3, "D": 5e-3, "A": -1e-5, "B": 0.0, "K_modulus": 186.0, "K_hyst": 400.0,
    "H": -500.0, "T_hyst_offset": -225.0,
}  # fmt: skip
DRIFT = {"slope_difference": {"mean": 0.2, "q05": 0.1, "q95": 0.3}, "unit": "deg"}


def results(names, **stages):
    """Results as the report reads them, of a posterior that is nearly a point."""
    rng = np.random.default_rng(0)
    draws = {name: VALUES[name] * (1.0 + 1e-6 * rng.standard_normal(400)) for name in names}
    posterior = posterior_of(draws, draws)
    for name, unit in {"J": "kg m^2", "D": "N m"}.items():
        posterior.tree["posterior"][name].attrs["units"] = unit
    muscle = "K_hyst" in names
    fit = "muscle" if muscle else "fixture-coulomb"
    roles = SimpleNamespace(fixture=("spring",), muscle=("stairs",) if muscle else ())
    discovery = {"told": "Nothing is missing.", "steps": [], **stages.pop("discovery", {})}
    found = {"discovery": discovery, **stages}
    return SimpleNamespace(
        plan=SimpleNamespace(config=StudyConfig(), roles=roles, published=THESIS),
        posteriors={fit: posterior},
        summaries={fit: {"converged": True, "complaints": []}},
        replaced=[],
        stages=found,
        get=found.get,
        drifts={"saw": DRIFT} if muscle else {},
    )


def test_quantities_follow_their_formulas():
    rows = {row[0]: row for row in answers(results(VALUES))["table"]["rows"]}
    assert float(rows["time constant of HYST at 25 °C"][1]) == pytest.approx(250.0, rel=1e-3)
    assert float(rows["contraction from 25 to 90 °C"][1]) == pytest.approx(7.475, rel=1e-3)
    assert rows["rotor inertia J"][3:] == ["kg m²", "0.001241", "no"]
    assert rows["stiffness of the muscle (MODULUS)"][4:] == ["186.0", "yes"]


def test_the_report_says_what_the_revised_model_was_fitted_to():
    revised = {
        "fit": "revised", "effects": ["slack"], "runs": ["stairs"], "first_parts": ["saw"],
        "summary": {"converged": True},
    }  # fmt: skip
    told = words.revision(revised)
    assert told.startswith(
        "The revised model has slack. It is fitted to stairs, the first part of saw."
    )


def test_a_rig_without_a_muscle_has_no_rows_of_one():
    found = answers(results(("J", "D")))
    assert [row[0] for row in found["table"]["rows"]] == ["rotor inertia J", "friction D"]
    assert found["drift"] == found["control"] == []


def test_a_fit_that_a_revised_one_replaces_is_told_apart():
    found = results(VALUES)
    found.summaries["muscle"] = {"converged": False, "complaints": ["R-hat is over 1.01: D 1.5"]}
    told = "have NOT converged: R-hat is over 1.01: D 1.5."
    assert answers(found)["trust"] == [f"The chains of the fit muscle {told}"]
    found.replaced = ["muscle"]
    assert answers(found)["trust"] == [f"The chains of the fit muscle, replaced by revised, {told}"]


def test_what_was_missing_tells_probability_gap_and_creep_before_and_after():
    step = {"added": "coil-contact", "probability": 0.97, "closed": {"a": 0.8, "b": 0.9, "c": None}}
    after = {"saw": {"after": {"mean": 0.01, "q05": -0.02, "q95": 0.04}}}
    found = answers(results(VALUES, discovery={"steps": [step], "drift": after}))
    told = " ".join(found["missing"])
    assert "The probability of coil-contact is 97 %" in told
    assert "closes 85 % of the gap" in told
    assert "creeps 0.20 deg/min more" in found["drift"][0]
    assert "With what was found it is 0.010 deg/min" in found["drift"][0]


def test_what_stays_open_leaves_out_what_other_runs_gave():
    known = {
        "parameters": {"J": {"contraction": 0.0}, "C": {"contraction": 0.2}},
        "trade_offs": [["H", "T_hyst_offset", -0.98]],
        "directions": [],
    }
    told = " ".join(
        answers(results(VALUES, **{"muscle-checks": {"identifiability": known}}))["unknown"]
    )
    assert "C (0.20)" in told
    assert "J (" not in told
    assert "H with T_hyst_offset" in told


def test_the_control_stage_answers_itself():
    own = answers(results(VALUES, control={"answers": ["Use cascade."]}))["control"]
    assert own == ["Use cascade."]
