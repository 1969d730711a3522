"""Stages are begun such that a study ends soon."""

from dataclasses import replace
from pathlib import Path

import pytest

from muscle_bayes.study.config import StudyConfig
from muscle_bayes.study.pipeline import longest_path_first
from muscle_bayes.study.plan import PRESETS, Plan
from muscle_bayes.study.stages import Stage, all_stages

DATA = Path(__file__).parents[2] / "data"


def stage(name: str, seconds: tuple[float, float], *needs: str) -> Stage:
    return Stage(name, "data", "", Path(name), seconds, needs=tuple(map(Path, needs)))


def test_what_much_waits_for_comes_first():
    stages = [
        stage("alone", (15, 2)),
        stage("short", (1, 1)),
        stage("after", (16, 3), "short"),
        stage("last", (1, 1), "alone", "after"),
    ]
    order = [[one.name for one in longest_path_first(stages, preset)] for preset in PRESETS]
    # quick: short 18, after 17, alone 16, last 1; full: short 5, after 4, alone 3, last 1
    assert order == [["short", "after", "alone", "last"]] * 2
    stages[0] = replace(stages[0], seconds=(30, 2))
    assert longest_path_first(stages, "quick")[0].name == "alone"


@pytest.mark.parametrize("preset", PRESETS)
def test_every_stage_comes_after_those_it_needs(tmp_path, preset):
    plan = Plan.of(DATA, tmp_path, preset, StudyConfig(), "here")
    stages, _ = all_stages(plan)
    order = longest_path_first(stages, preset)
    assert sorted(one.name for one in order) == sorted(one.name for one in stages)
    made: set[Path] = set()
    coming = {path for one in stages for path in (one.result, *one.also)}
    for one in order:
        assert {*one.needs} & coming <= made
        made |= {one.result, *one.also}
    names = [one.name for one in order]
    assert names.index("discovery") < names.index("fixture-linear")
    assert names.index("muscle") < names.index("fixture-linear")
