"""Which run serves for what, with and without a config."""

from pathlib import Path

import pytest

from muscle_bayes.data import read_run, read_runs
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.study.config import StudyConfig
from muscle_bayes.study.plan import Plan
from muscle_bayes.study.roles import roles_of
from muscle_bayes.study.stages import LeftOut, Stage, all_stages

DATA = Path(__file__).parents[2] / "data"


@pytest.fixture(scope="module")
def shipped():
    return read_runs([DATA])


def named(runs, *words):
    return [run for run in runs if any(word in run.name for word in words)]


def test_springs_tell_the_fixture_staircases_the_muscle_and_the_sawtooth_is_held_out(shipped):
    roles = roles_of(shipped, StudyConfig(), "data")
    assert roles.fixture == tuple(f"spring-{n}" for n in range(1, 6))
    assert roles.muscle == ("staircase-139g", "staircase-166g", "staircase-212g")
    assert roles.held_out == ("sawtooth",)
    assert roles.until == {}


def test_a_lone_run_of_a_muscle_is_fitted_to_its_middle(shipped):
    runs = named(shipped, "sawtooth")
    roles = roles_of(runs, StudyConfig(), "data")
    assert roles.muscle == ("sawtooth",)
    assert roles.until["sawtooth"] == pytest.approx(0.5 * runs[0].duration, abs=0.1)


def test_names_of_the_config_come_first(shipped):
    config = StudyConfig(muscle=("sawtooth",), held_out=("staircase-139g", "spring-5"))
    roles = roles_of(shipped, config, "study.toml")
    assert roles.fixture == tuple(f"spring-{n}" for n in range(1, 5))
    assert roles.muscle == ("sawtooth",)
    assert roles.held_out == ("staircase-139g", "spring-5")


@pytest.mark.parametrize(
    ("config", "told"),
    [
        (
            StudyConfig(fixture=("sprig-1",)),
            r"run 'sprig-1' is named.*Did you mean 'spring-1'",
        ),
        (StudyConfig(until={"x": 1.0}), r"run 'x' is named, but there is none"),
        (StudyConfig(fixture=("spring-1",), held_out=("spring-1",)), r"named more than once"),
        (StudyConfig(fixture=("sawtooth",)), r"key fixture: run 'sawtooth' has a muscle\. Fix"),
        (StudyConfig(muscle=("spring-1",)), r"key muscle: run 'spring-1' has no muscle\. Fix"),
        (StudyConfig(fixture=(), muscle=()), r"none is left to fit\. Fix"),
    ],
)
def test_roles_that_cannot_be_are_refused(shipped, config, told):
    with pytest.raises(MuscleBayesError, match=told):
        roles_of(shipped, config, "study.toml")


def plan_of(folder, out, **told):
    return Plan.of(folder, out, "quick", StudyConfig(**told), "here")


def stages_of(plan):
    stages, left = all_stages(plan)
    return {one.name: one for one in stages}, {one.name: one.why for one in left}


def test_every_stage_applies_to_the_shipped_runs(tmp_path):
    stages, left = stages_of(plan_of(DATA, tmp_path))
    assert left == {}
    assert set(stages) == {
        "data", "fixture-coulomb", "fixture-linear", "fixture-checks", "muscle", "muscle-checks",
        "discovery", "revised", "control", "calibration", "report",
    }  # fmt: skip
    assert all(isinstance(one, Stage) for one in stages.values())


def test_the_held_out_run_matters_to_no_fit_before_the_search(tmp_path):
    stages, _ = stages_of(plan_of(DATA, tmp_path))
    readers = {name for name, one in stages.items() if "sawtooth" in one.runs}
    assert readers == {"data", "muscle-checks", "discovery", "revised", "control"}
    springs = {name for name, one in stages.items() if "spring-1" in one.runs}
    assert springs == {
        "data", "fixture-coulomb", "fixture-linear", "fixture-checks", "discovery", "revised"
    }  # fmt: skip


def test_without_a_muscle_there_is_none_to_fit_or_control(tmp_path, shipped):
    for run in named(shipped, "spring-1", "spring-2"):
        for file in (run.path, run.path.with_suffix(".toml")):
            (tmp_path / file.name).write_bytes(file.read_bytes())
    stages, left = stages_of(plan_of(tmp_path, tmp_path / "out"))
    assert set(left) == {"muscle", "control"}
    assert "no run with a muscle" in left["control"]
    assert "muscle-checks" not in stages


def test_settings_may_leave_the_controller_out(tmp_path):
    _, left = stages_of(plan_of(DATA, tmp_path, control=False))
    assert left == {"control": "the study's settings leave it out"}


def test_a_plan_is_the_same_after_it_was_written(tmp_path):
    plan = plan_of(DATA, tmp_path, thesis=True, until={"sawtooth": 3.0})
    plan.save()
    assert Plan.load(plan.path) == plan


@pytest.mark.real
def test_measured_rigs_leave_out_what_does_not_apply(tmp_path, real_data):
    _, left = stages_of(plan_of(real_data / "xl330-drop", tmp_path))
    assert set(left) == {"muscle", "control"}
    wire = plan_of(real_data / "heating-wire", tmp_path)
    _, left = stages_of(wire)
    assert set(left) == {"fixture", "control"}
    assert "by pins" in left["control"]
    (run,) = wire.roles.muscle
    whole = read_run(wire.logs[run])
    assert 0.0 < wire.roles.until[run] < whole.duration
    assert isinstance(all_stages(wire)[1][0], LeftOut)
