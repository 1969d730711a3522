"""`python -m benchmarks.bench_test` prints its figures and fails where a trial does."""

import json

import pytest
from typer.testing import CliRunner

from benchmarks.bench_test import failures, fuzz, overheating, streaming, stuck_meter
from benchmarks.bench_test.__main__ import app

pytestmark = pytest.mark.usefixtures("firmware")


NOTHING = ("--failures", 0, "--stuck", 0, "--overheating", 0, "--fuzz", 0, "--minutes", 0)


def without(option):
    """Options for nothing but one trial."""
    at = NOTHING.index(option)
    return NOTHING[:at] + NOTHING[at + 2 :]


def run(*arguments):
    return CliRunner().invoke(app, [*map(str, arguments)], env={"COLUMNS": "120"})


def test_all_figures_are_told(tmp_path, monkeypatch):
    few = tuple(f for f in failures.FAILURES if f.name in ("host killed", "brown-out reset"))
    monkeypatch.setattr(failures.inject_all, "__defaults__", (0, lambda share: None, few))
    path = tmp_path / "report.json"
    few_of_each = ("--failures", 3, "--stuck", 3, "--overheating", 1, "--fuzz", 3000)
    told = run(*few_of_each, "--minutes", 0.05, "--json", path)
    assert told.exit_code == 0, told.output
    assert "4 of 4 failures: heaters off within 0.5 s" in told.output
    assert "3 stuck meters: a tube at most" in told.output
    assert "1 trials: no tube above" in told.output
    assert "0 ms of heat that was not asked for" in told.output
    assert "0 lost" in told.output
    report = json.loads(path.read_text())
    assert report["passed"] is True
    assert [f["failure"] for f in report["failures"]] == [f.name for f in few] * 2
    assert len(report["stuck"]) == 3
    assert report["overheating"][0]["peak"] < 45.0
    assert report["fuzz"]["sent"] >= 3000
    assert report["stream"]["lost"] == 0


def test_nothing_asked_is_nothing_done():
    told = run(*NOTHING)
    assert told.exit_code == 0
    assert told.output.strip() == ""


def late(*_):
    return [failures.Outcome("host killed", "", 0, True, 0.6)]


def overheated(*_):
    return [stuck_meter.StuckOutcome(0, True, 10.0, 9.0)]


def too_hot(*_):
    return [overheating.Outcome("board: stuck", 0, 120.1, 20.0, 4, "")]


def lossy(*_):
    return streaming.StreamReport(60.0, 1999, 1, 33.3, 0.0, 0.0, 0.004, 0.005, 0.006)


def hot(*_):
    return fuzz.FuzzReport(1000, 10, 10, 5, 100, 0.4, 1, 0, 0)


@pytest.mark.parametrize(
    ("module", "name", "trial", "asked"),
    [
        (failures, "inject_all", late, without("--failures")),
        (stuck_meter, "stick_all", overheated, without("--stuck")),
        (overheating, "run_all", too_hot, without("--overheating")),
        (fuzz, "fuzz", hot, without("--fuzz")),
        (streaming, "stream", lossy, without("--minutes")),
    ],
)
def test_a_trial_that_fails_fails_the_command(monkeypatch, module, name, trial, asked):
    monkeypatch.setattr(module, name, trial)
    told = run(*asked)
    assert told.exit_code == 1
    assert "FAILED" in told.output
