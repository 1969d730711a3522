"""A stage is made once, and again when what it depends on changes."""

from pathlib import Path

import pytest

from muscle_bayes.provenance import fingerprint
from muscle_bayes.study.stage import Stage


def stage(folder: Path, made: list[int], **inputs: object) -> Stage:
    def make() -> None:
        made.append(1)
        (folder / "result.txt").write_text("x")

    return Stage("one", folder / "result.txt", inputs, make)


def test_runs_once_for_the_same_inputs(tmp_path: Path) -> None:
    made: list[int] = []
    assert stage(tmp_path, made, seed=1).run()
    assert not stage(tmp_path, made, seed=1).run()
    assert made == [1]


def test_runs_again_for_other_inputs(tmp_path: Path) -> None:
    made: list[int] = []
    stage(tmp_path, made, seed=1).run()
    assert stage(tmp_path, made, seed=2).run()


def test_an_interrupted_stage_is_not_taken_for_done(tmp_path: Path) -> None:
    def interrupted() -> None:
        (tmp_path / "result.txt").write_text("half")
        raise KeyboardInterrupt

    made: list[int] = []
    stage(tmp_path, made, seed=1).run()
    broken = Stage("one", tmp_path / "result.txt", {"seed": 2}, interrupted)
    with pytest.raises(KeyboardInterrupt):
        broken.run()
    assert not broken.done()
    assert stage(tmp_path, made, seed=1).run()


def test_fingerprint_does_not_depend_on_order() -> None:
    assert fingerprint({"a": 1, "b": 2}) == fingerprint({"b": 2, "a": 1})
    assert fingerprint({"a": 1}) != fingerprint({"a": 2})
