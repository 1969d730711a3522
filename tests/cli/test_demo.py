"""`demo` computes what it prints, `show` reads what it wrote, `effects` lists the catalogue."""

import json

import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app
from muscle_bayes.inference.sampling import fit as fitting
from muscle_bayes.inference.sampling.sampler import Effort
from muscle_bayes.physics.effects import CATALOGUE
from muscle_bayes.study.published import TABLE_1


@pytest.mark.timeout(1200)
def test_demo_finds_the_fixture_and_show_draws_what_it_wrote(tmp_path, monkeypatch):
    little = Effort(chains=2, warmup=60, draws=100, rounds=1, min_ess=1)
    monkeypatch.setitem(fitting.EFFORTS, "quick", little)
    out, numbers = tmp_path / "demo", tmp_path / "demo.json"
    told = CliRunner().invoke(app, ["demo", "--out", str(out), "--json", str(numbers)])
    assert told.exit_code in (0, 1), told.output
    found = json.loads(numbers.read_text())
    assert told.exit_code == (0 if found["converged"] else 1)
    for name, truth in TABLE_1["coulomb"].items():
        assert found["parameters"][name]["mean"] == pytest.approx(truth, rel=0.03)
    assert "sampling (draws of each chain): " in told.stderr
    assert " divergences, R-hat " in told.stderr
    assert f"posterior and figures: {out}" in told.stdout
    assert {one.name for one in out.iterdir()} == {"fixture.nc", "posterior.png", "prediction.png"}
    shown = CliRunner().invoke(app, ["show", str(out / "fixture.nc"), "--out", str(tmp_path / "s")])
    assert shown.exit_code == told.exit_code, shown.output
    assert {one.name for one in (tmp_path / "s").iterdir()} == {"fixture.png", "fixture-pairs.png"}
    assert "J" in shown.stdout


def test_effects_lists_the_catalogue_and_explains_one():
    listed = CliRunner().invoke(app, ["effects"]).stdout
    assert [line.split()[0] for line in listed.splitlines()] == sorted(CATALOGUE)
    one = CliRunner().invoke(app, ["effects", "thermal-lag"]).stdout
    assert "thermal-lag.time_constant [s]" in one
    assert "Source:" in one
