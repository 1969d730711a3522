"""Posteriors of measured rigs against published values."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app
from muscle_bayes.data import read_run
from muscle_bayes.inference.posterior import Posterior
from muscle_bayes.inference.predictive import predict_runs

pytestmark = pytest.mark.real
PUBLISHED_EMPS = {
    "J": (95.1089, 0.03),
    "viscous-friction.coefficient": (203.5034, 0.03),
    "D": (20.3935, 0.10),
    "bias-torque.torque": (3.1648, 0.20),
}
"""Value and relative tolerance; the published offset is on the friction's side, ours applied."""


def fitted(tmp_path: Path, runs: Path, *options: str, preset: str = "quick") -> dict:
    out, numbers = tmp_path / "p.nc", tmp_path / "s.json"
    arguments = ["fit", str(runs), "--out", str(out), "--json", str(numbers), "--preset", preset]
    result = CliRunner().invoke(app, [*arguments, *options])
    assert result.exit_code in (0, 1), result.output
    return json.loads(numbers.read_text())


VISCOUS_BIAS = ("--effect", "viscous-friction", "--effect", "bias-torque")


def test_xl330_drop(real_data: Path, tmp_path: Path) -> None:
    found = fitted(tmp_path, real_data / "xl330-drop", *VISCOUS_BIAS)["parameters"]
    assert 0.0070 <= found["D"]["mean"] <= 0.0161
    assert 0.7 * 1.5e-3 <= found["J"]["mean"] <= 1.3 * 1.8e-3
    assert 0.0037 <= found["viscous-friction.coefficient"]["mean"] <= 0.0182


@pytest.mark.slow
def test_emps(real_data: Path, tmp_path: Path) -> None:
    found = fitted(tmp_path, real_data / "emps", *VISCOUS_BIAS)["parameters"]
    for name, (value, tolerance) in PUBLISHED_EMPS.items():
        assert abs(found[name]["mean"] / value - 1.0) < tolerance, name


@pytest.mark.slow
def test_heating_wire_one_cycle_ahead(real_data: Path, tmp_path: Path) -> None:
    path = real_data / "heating-wire" / "two-cycles-200g.csv"
    cycle = 158.6
    summary = fitted(
        tmp_path, path, "--until", str(cycle), "--effect", "thermal-lag", preset="full"
    )
    assert summary["converged"], summary["complaints"]
    run = read_run(path)
    (one,) = predict_runs(Posterior.load(tmp_path / "p.nc"), [run], seed=1)
    ahead = one.time > cycle
    ours = np.sqrt(np.mean((one.model.mean(axis=0) - one.observed)[ahead] ** 2))
    first, second = run.table[run.table.time < cycle], run.table[run.table.time >= cycle]
    cubic = np.polyfit(first.temperature_a, first.reading, 3)
    theirs = np.sqrt(np.mean((np.polyval(cubic, second.temperature_a) - second.reading) ** 2))
    assert ours < theirs
