"""Results of slow checks are found where they lie, and the study's own are none."""

from pathlib import Path

from muscle_bayes.study.plan import available


def test_results_of_checks_are_found_but_not_the_studys_own(tmp_path: Path) -> None:
    for name in (
        "calibration/fixture/calibration.json",
        "trial/trial.json",
        "results/calibration.json",
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("{}")
    found = available([tmp_path / "calibration", tmp_path], tmp_path / "results")
    told = [path.relative_to(tmp_path).as_posix() for path in found]
    assert told == ["calibration/fixture/calibration.json", "trial/trial.json"]
