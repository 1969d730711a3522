"""An effect that a user wrote is a candidate as those of the catalogue are."""

from dataclasses import replace
from pathlib import Path

import pytest
from numpyro import distributions as dist

from muscle_bayes.data import read_runs
from muscle_bayes.data.writer import write_run
from muscle_bayes.discovery.discover import applicable, discover
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.physics.effect import Effect, Parameter
from muscle_bayes.physics.effects import CATALOGUE
from muscle_bayes.physics.effects.own import FILES, own_sources
from muscle_bayes.twin import Rig, make_effect, simulate, spring_rig
from muscle_bayes.twin.protocols import spring

OWN = '''
from numpyro import distributions as dist

from muscle_bayes.physics.effect import Effect, Parameter


class OilFilm(Effect):
    """A torque against the speed, -b q'."""

    name = "oil-film"
    port = "torque"
    dissipative = True
    parameters = {
        "drag": Parameter(
            unit="N m s",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(scales.force / scales.speed),
            meaning="torque per speed",
        )
    }

    drag: float

    def __call__(self, value, signals):
        return value - self.drag * signals.speed
'''


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    file = tmp_path / "oil.py"
    file.write_text(OWN)
    monkeypatch.setenv(FILES, str(file))
    return file


@pytest.fixture
def runs(tmp_path: Path):
    rig = spring_rig(Rig())
    hidden = make_effect("viscous-friction", coefficient=1e-3)
    rig = replace(rig, truth=replace(rig.truth, effects=(hidden,)))
    for number, mass in enumerate((0.100, 0.110, 0.118, 0.126), 1):
        run = simulate(rig, spring(mass), (11, number))
        write_run(tmp_path / "runs", f"spring-{number}", run.log, run.metadata)
    return read_runs([tmp_path / "runs"])


def test_what_a_file_holds_is_tried_and_part_of_what_results_were_made_from(own, runs) -> None:
    assert "oil-film" in applicable(runs, ())
    assert "oil-film" not in applicable(runs, ["oil-film"])
    assert "oil-film" not in applicable(runs, (), CATALOGUE)
    before = own_sources()
    assert set(before) == {"oil-film"}
    own.write_text(OWN + "\n# more\n")
    assert own_sources() != before


class Grease(Effect):
    """A torque against the speed, -b q'."""

    name = "grease"
    port = "torque"
    dissipative = True
    parameters = {  # noqa: RUF012
        "drag": Parameter(
            unit="N m s",
            off=0.0,
            prior=lambda scales: dist.HalfNormal(scales.force / scales.speed),
            meaning="torque per speed",
        )
    }

    drag: float

    def __call__(self, value, signals):
        return value - self.drag * signals.speed


@pytest.mark.slow
def test_a_class_is_a_candidate_without_any_file(runs) -> None:
    found = discover(runs, candidates=[Grease, "bias-torque"])
    assert found.verdict == "grease"


def test_what_is_no_effect_is_refused(runs) -> None:
    with pytest.raises(MuscleBayesError, match="is no effect"):
        discover(runs, candidates=[int])  # type: ignore[list-item]


@pytest.mark.slow
def test_it_is_named_and_added(own, runs) -> None:
    found = discover(runs, hold_out=["spring-4"], candidates=["oil-film", "bias-torque"])
    assert found.verdict == "oil-film"
    told = found.steps[0].parameters["drag"]
    assert abs(told.median - 1e-3) < 1.2 * (told.high - told.low)
