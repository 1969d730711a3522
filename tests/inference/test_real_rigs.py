"""Posteriors of measured rigs against published values."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app
from muscle_bayes.data import read_run
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.posteriors.predictive import predict_runs

pytestmark = pytest.mark.real
PUBLISHED_EMPS = {
    "J": (95.1089, 0.03),
    "viscous-friction.coefficient": (203.5034, 0.03),
    "D": (20.3935, 0.10),
    "bias-torque.torque": (3.1648, 0.20),
}
"""Value and relative tolerance; the published offset is on the friction's side, ours applied."""

WIRE = Path("heating-wire") / "two-cycles-200g.csv"
CYCLE = 158.6
"""End of the wire's first cycle, s."""


def fitted(tmp_path: Path, runs: Path, *options: str, preset: str = "quick") -> dict:
    out, numbers = tmp_path / "p.nc", tmp_path / "s.json"
    arguments = ["fit", str(runs), "--out", str(out), "--json", str(numbers), "--preset", preset]
    result = CliRunner().invoke(app, [*arguments, *options])
    assert result.exit_code in (0, 1), result.output
    return json.loads(numbers.read_text())


VISCOUS_BIAS = ("--effect", "viscous-friction", "--effect", "bias-torque")


@pytest.mark.slow
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


@pytest.fixture(scope="module")
def wire(real_data: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[dict, Posterior]:
    """Summary and posterior of the heated wire's first cycle."""
    folder = tmp_path_factory.mktemp("wire")
    summary = fitted(folder, real_data / WIRE, "--until", str(CYCLE))
    return summary, Posterior.load(folder / "p.nc")


@pytest.mark.slow
def test_heating_wire_one_cycle_ahead(real_data: Path, wire: tuple[dict, Posterior]) -> None:
    run = read_run(real_data / WIRE)
    (one,) = predict_runs(wire[1], [run], seed=1)
    ahead = one.time > CYCLE
    ours = np.sqrt(np.mean((one.model.mean(axis=0) - one.observed)[ahead] ** 2))
    second = run.table[run.table.time >= CYCLE]
    for known in (run.table[run.table.time < CYCLE], second):
        cubic = np.polyfit(known.temperature_a, known.reading, 3)
        theirs = np.polyval(cubic, second.temperature_a) - second.reading
        assert ours < np.sqrt(np.mean(theirs**2))


@pytest.mark.xfail(reason="friction or HYST may make the loop: chains seldom change between these")
@pytest.mark.slow
def test_heating_wire_converges(wire: tuple[dict, Posterior]) -> None:
    assert wire[0]["converged"], wire[0]["complaints"]
