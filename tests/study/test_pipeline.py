"""Only what changed runs again, whatever ended the last study."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from fake_stages import Watched, plan_in, process_of, stages_of

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.physics.effects.own import FILES
from muscle_bayes.study.pipeline import run_stages

DOCUMENT = Path(__file__).parents[2] / "docs" / "architecture.md"
"""Holds an effect of one's own, as an example."""
ALL = {"left", "right", "sum"}


def run(plan) -> Watched:
    watched = Watched()
    run_stages(plan, stages_of(plan), watched, process_of=process_of)
    return watched


def content(folder: Path) -> dict[str, bytes]:
    return {str(one): one.read_bytes() for one in sorted(folder.rglob("*")) if one.is_file()}


def test_every_stage_runs_once_and_a_second_study_changes_no_byte(tmp_path):
    plan = plan_in(tmp_path, x="1", y="2")
    assert set(run(plan).made_) == ALL
    assert plan.result("sum").read_text() == "3"
    before = content(tmp_path)
    again = run(plan)
    assert again.made_ == []
    assert set(again.unchanged_) == ALL
    assert content(tmp_path) == before


def test_a_changed_run_runs_again_just_what_depends_on_it(tmp_path):
    plan = plan_in(tmp_path, x="1", y="2")
    run(plan)
    plan.logs["y"].write_text("5")
    assert run(plan).made_ == ["right", "sum"]
    assert plan.result("sum").read_text() == "6"


def test_what_depends_on_an_equal_result_stands(tmp_path):
    plan = plan_in(tmp_path, x="1", y="2")
    run(plan)
    plan.logs["y"].write_text("102")  # the stage's result is the same
    assert run(plan).made_ == ["right"]


def test_an_effect_of_ones_own_that_changed_makes_everything_anew(tmp_path, monkeypatch):
    plan = plan_in(tmp_path, x="1", y="2")
    run(plan)
    code = DOCUMENT.read_text().split("```python\n")[1].split("```")[0]
    file = tmp_path / "cable.py"
    file.write_text(code)
    monkeypatch.setenv(FILES, str(file))
    assert set(run(plan).made_) == ALL
    assert run(plan).made_ == []
    file.write_text(code.replace("0.1 * scales.range", "0.2 * scales.range"))
    assert set(run(plan).made_) == ALL


def test_touching_a_run_changes_nothing(tmp_path):
    plan = plan_in(tmp_path, x="1", y="2")
    run(plan)
    os.utime(plan.logs["x"], (1, 1))
    assert run(plan).made_ == []


def test_metadata_and_settings_count_as_readings_do(tmp_path):
    plan = plan_in(tmp_path, x="1", y="2")
    run(plan)
    plan.logs["x"].with_suffix(".toml").write_text("1")
    assert run(plan).made_ == ["left"]
    other = plan_in(tmp_path, x="1", y="2")
    other = other.__class__(other.out, other.logs, other.roles, "full", other.config)
    assert set(run(other).made_) == ALL


def test_a_result_that_is_gone_is_made_again(tmp_path):
    plan = plan_in(tmp_path, x="1", y="2")
    run(plan)
    plan.result("left").unlink()
    assert run(plan).made_ == ["left"]


def test_a_failed_stage_says_why_and_the_others_stand(tmp_path):
    plan = plan_in(tmp_path, x="1", y="bad")
    with pytest.raises(MuscleBayesError, match=r"stage right: a reading is bad\. Fix: mend it"):
        run(plan)
    plan.logs["y"].write_text("2")
    assert run(plan).made_ == ["right", "sum"]


def test_a_killed_study_goes_on_where_it_stopped(tmp_path):
    plan = plan_in(tmp_path, x="1", y="slow")
    script = (
        "import sys; from pathlib import Path; sys.path.insert(0, sys.argv[2])\n"
        "import fake_stages as f; from muscle_bayes.study.pipeline import run_stages\n"
        "plan = f.plan_in(Path(sys.argv[1]), x='1', y='slow')\n"
        "run_stages(plan, f.stages_of(plan), f.Watched(), process_of=f.process_of)\n"
    )
    study = subprocess.Popen(
        [sys.executable, "-c", script, str(tmp_path), str(Path(__file__).parent)],
        start_new_session=True,
    )
    records = plan.out / "results" / "records.json"
    end = time.monotonic() + 120.0
    while not (records.exists() and "left" in records.read_text()):
        assert study.poll() is None
        assert time.monotonic() < end, "the first stage was never recorded"
        time.sleep(0.02)
    os.killpg(study.pid, signal.SIGKILL)
    study.wait()
    plan.logs["y"].write_text("2")
    assert run(plan).made_ == ["right", "sum"]
    assert plan.result("sum").read_text() == "3"


def test_stages_run_side_by_side(tmp_path):
    """`left` ends while `right`, begun before or with it, still waits."""
    plan = plan_in(tmp_path, x="1", y="slow")

    class Mends(Watched):
        def made(self, stage: str) -> None:
            super().made(stage)
            if stage == "left":
                plan.logs["y"].write_text("2")

    stages = stages_of(plan)
    stages = [stages[1], stages[0], stages[2]]
    watched = Mends()
    run_stages(plan, stages, watched, process_of=process_of)
    assert watched.made_ == ["left", "right", "sum"]
