"""`muscle-bayes discover` on the shipped spring runs, and its errors."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app

DATA = Path(__file__).parents[2] / "data" / "plain"
SPRINGS = [str(DATA / f"spring-{number}.csv") for number in (1, 2, 3)]


def test_a_run_that_is_not_there_is_told(tmp_path: Path) -> None:
    command = ["discover", *SPRINGS, "--hold-out", "spring-9", "--out", str(tmp_path)]
    found = CliRunner().invoke(app, command)
    assert found.exit_code == 2
    assert "--hold-out spring-9: no such run." in found.stderr
    assert "Fix: name one of spring-1, spring-2, spring-3." in found.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_shipped_springs_lack_nothing(tmp_path: Path) -> None:
    report = tmp_path / "found.json"
    command = ["discover", *SPRINGS, "--hold-out", "spring-3", "--out", str(tmp_path)]
    found = CliRunner().invoke(app, [*command, "--json", str(report)])
    assert found.exit_code == 0, found.output
    assert json.loads(report.read_text())["verdict"] == "none"
    written = {path.name for path in tmp_path.iterdir()}
    assert {"summary.md", "misfit-map.png", "probabilities.png", "posterior.nc"} <= written
    assert {"spring-1.png", "spring-3.png"} <= written
    assert "SYNTHETIC" in (tmp_path / "summary.md").read_text()
