"""`python -m benchmarks.trial` refuses what it cannot do."""

from pathlib import Path

import typer
from typer.testing import CliRunner

from benchmarks.trial.__main__ import trial
from muscle_bayes.cli.common import user_errors


def test_a_trial_of_nothing_is_refused(tmp_path: Path) -> None:
    app = typer.Typer()
    app.command()(user_errors()(trial))
    none = ["--single", "0", "--none", "0", "--outside", "0", "--pair", "0"]
    found = CliRunner().invoke(app, [*none, "--out", str(tmp_path)])
    assert found.exit_code == 2
    assert "ask for at least one" in found.stderr
