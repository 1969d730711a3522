"""The whole workflow on spring runs, in which effects are hidden or none is."""

from dataclasses import replace
from pathlib import Path

import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.data.writer import write_run
from muscle_bayes.discovery.discover import applicable, discover
from muscle_bayes.discovery.result import Discovery
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.report.discovery_summary import summary, verdict_text
from muscle_bayes.twin import Rig, make_effect, simulate, spring_rig
from muscle_bayes.twin.protocols import spring

CANDIDATES = ("viscous-friction", "bias-torque", "quadratic-drag")
HELD = "spring-4"


def _search(folder: Path, *effects, candidates=CANDIDATES) -> Discovery:
    rig = spring_rig(Rig())
    rig = replace(rig, truth=replace(rig.truth, effects=effects))
    for number, mass in enumerate((0.100, 0.110, 0.118, 0.126), 1):
        run = simulate(rig, spring(mass), (11, number))
        write_run(folder, f"spring-{number}", run.log, run.metadata)
    return discover(read_runs([folder]), hold_out=[HELD], candidates=candidates)


def test_a_hidden_effect_is_named_and_added(tmp_path: Path) -> None:
    found = _search(tmp_path, make_effect("viscous-friction", coefficient=1e-3))
    assert found.verdict == "viscous-friction"
    assert found.probabilities["viscous-friction"] > 0.5
    assert sum(found.probabilities.values()) == pytest.approx(1.0)
    assert found.located.significant
    (step,) = found.steps
    told = step.parameters["coefficient"]
    assert abs(told.median - 1e-3) < 1.2 * (told.high - told.low)
    assert step.gate.passed
    assert step.after.checks[HELD].rmse < step.before.checks[HELD].rmse
    report = found.as_dict()
    assert report["verdict"] == "viscous-friction"
    assert set(report["steps"][0]["held_out"]["after"]) == {HELD}
    assert HELD not in report["steps"][0]["after"]
    text = summary(found, {HELD: "synthetic"})
    assert "SYNTHETIC" in text
    assert "viscous-friction" in text


@pytest.mark.slow
@pytest.mark.parametrize("waves", [4.0, 50.0])
def test_the_period_of_a_hidden_torque_is_found(tmp_path: Path, waves: float) -> None:
    """Between starts at other periods and the true one there is no way down."""
    hidden = make_effect("cogging", sine=0.006, waves=waves)
    found = _search(tmp_path, hidden, candidates=("cogging", "viscous-friction"))
    assert found.verdict == "cogging"
    told = found.steps[0].parameters["waves"]
    assert told.high - told.low < 0.12 * waves
    assert abs(told.median - waves) < told.high - told.low


@pytest.mark.parametrize(
    ("name", "size"), [pytest.param("backlash", 0.05, marks=pytest.mark.slow), ("zero-drift", 0.01)]
)
def test_a_sensor_that_does_not_show_the_rotor_is_named(
    tmp_path: Path, name: str, size: float
) -> None:
    """A gap between rotor and sensor, or a zero that drifts, [rad] or [rad/s]."""
    key = {"backlash": "gap", "zero-drift": "rate"}[name]
    candidates = ("backlash", "zero-drift", "viscous-friction")
    found = _search(tmp_path, make_effect(name, **{key: size}), candidates=candidates)
    assert found.verdict == name
    told = found.steps[0].parameters[key]
    assert told.high - told.low < 0.2 * size
    assert abs(told.median - size) < told.high - told.low


def test_nothing_is_claimed_where_nothing_is_hidden(tmp_path: Path) -> None:
    found = _search(tmp_path)
    assert found.verdict == "none"
    assert found.steps == ()
    assert found.probabilities["none"] > 0.5
    assert verdict_text(found) == "Nothing is missing that these runs could show."
    alone = discover(read_runs([tmp_path]), hold_out=[HELD], candidates=CANDIDATES, workers=1)
    assert alone.as_dict() == found.as_dict()


def test_names_that_no_run_has(tmp_path: Path) -> None:
    run = simulate(spring_rig(Rig()), spring(0.11), 1)
    write_run(tmp_path, "spring-1", run.log, run.metadata)
    runs = read_runs([tmp_path])
    with pytest.raises(MuscleBayesError, match=r"no such run\. Fix: name one of spring-1"):
        discover(runs, hold_out=["other"])
    with pytest.raises(MuscleBayesError, match=r"every run is held out\. Fix: leave out one"):
        discover(runs, hold_out=["spring-1"])
    assert "coil-contact" not in applicable(runs, ())
    assert "viscous-friction" not in applicable(runs, ["viscous-friction"])
