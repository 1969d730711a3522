"""With which code a study ends."""

import json

import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app
from muscle_bayes.examples import load_example
from muscle_bayes.study.plan import Plan


@pytest.mark.parametrize(
    ("not_converged", "replaced", "code"),
    [
        ({}, [], 0),
        ({"muscle": ["R-hat is over 1.01"]}, [], 1),
        ({"muscle": ["R-hat is over 1.01"]}, ["muscle"], 0),
        ({"muscle": ["R-hat is over 1.01"]}, ["fixture-coulomb", "muscle"], 0),
        ({"revised": ["R-hat is over 1.01"]}, ["muscle"], 1),
    ],
)
def test_a_fit_that_is_replaced_does_not_fail_a_study(
    tmp_path, monkeypatch, not_converged, replaced, code
):
    def written(plan: Plan, *others, **more) -> None:
        told = {"not_converged": not_converged, "replaced": replaced}
        (plan.out / "summary.json").write_text(json.dumps(told), encoding="utf-8")

    monkeypatch.setattr("muscle_bayes.study.pipeline.run_stages", written)
    (tmp_path / "out").mkdir()
    runs = load_example("springs")[0].path.parent
    asked = ["study", "--runs", str(runs), "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(app, asked)
    assert result.exit_code == code, result.output
    assert ("NOT CONVERGED" in result.output) is bool(not_converged)
