"""Stages that others wait for are begun first."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from muscle_bayes.study.config import StudyConfig
from muscle_bayes.study.order import urgent_first
from muscle_bayes.study.plan import Plan
from muscle_bayes.study.stages import all_stages

DATA = Path(__file__).parents[2] / "data"


def stage(name, seconds, *needs, also=()):
    paths = tuple(Path(one) for one in needs)
    return SimpleNamespace(
        result=Path(name), seconds=seconds, needs=paths, also=tuple(Path(one) for one in also)
    )


def names(stages):
    return [one.result.name for one in stages]


def test_the_longest_chain_goes_first_whatever_its_first_stage_takes():
    stages = [
        stage("alone", (50, 1)),
        stage("first", (1, 1), also=("beside",)),
        stage("second", (60, 60), "beside"),
        stage("last", (5, 5), "second", "alone"),
    ]
    assert names(urgent_first(stages, "quick")) == ["first", "second", "alone", "last"]
    assert names(urgent_first(stages, "full")) == ["first", "second", "alone", "last"]


def test_the_preset_counts():
    stages = [stage("a", (1, 9)), stage("b", (2, 3))]
    assert names(urgent_first(stages, "quick")) == ["b", "a"]
    assert names(urgent_first(stages, "full")) == ["a", "b"]


@pytest.mark.parametrize("preset", ["quick", "full"])
def test_no_stage_of_a_study_comes_before_what_it_needs(tmp_path, preset):
    stages, _ = all_stages(Plan.of(DATA, tmp_path, preset, StudyConfig(), "here"))
    made = set()
    produced = {path for one in stages for path in (one.result, *one.also)}
    for one in urgent_first(stages, preset):
        assert {*one.needs} & produced <= made, one.name
        made |= {one.result, *one.also}
    assert made == produced
