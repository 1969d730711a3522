"""Measured rigs studied by one command: the report says what applies to them, and what does not."""

import json
import re

import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app
from muscle_bayes.cli.common import EXIT_FAILED

pytestmark = [pytest.mark.slow, pytest.mark.real, pytest.mark.timeout(3600)]

LEFT_OUT = {
    "xl330-drop": {"muscle": "no run with a muscle", "control": "no joint to simulate"},
    "heating-wire": {"fixture": "no run without a muscle", "control": "by pins"},
}


@pytest.mark.parametrize("rig", LEFT_OUT)
def test_a_study_of_a_measured_rig(real_data, tmp_path, rig):
    asked = ["study", "--runs", str(real_data / rig), "--preset", "quick", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, asked, env={"COLUMNS": "200"})
    told = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    # The heated wire's one cycle does not separate friction from HYST: its chains need not agree.
    assert result.exit_code == (
        EXIT_FAILED if told["not_converged"].keys() - told["replaced"] else 0
    ), result.output
    page = re.sub(r"\s+", " ", (tmp_path / "report.html").read_text(encoding="utf-8"))
    page = re.sub(r"<[^>]*>", "", page)
    assert "These data were measured." in page
    assert "Synthetic data." not in page
    for stage, why in LEFT_OUT[rig].items():
        assert f"{stage}, because" in page
        assert why in page
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF")
    assert (tmp_path / "report.html").stat().st_size < 3_000_000
    assert ("have NOT converged" in page) is bool(told["not_converged"])
    assert told["origin"] == ["measured"]
    discovery = json.loads((tmp_path / "results" / "discovery.json").read_text(encoding="utf-8"))
    assert sum(discovery["probabilities"].values()) == pytest.approx(1.0, abs=1e-6)
