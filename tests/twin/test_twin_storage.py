"""Files: what is replaced, what never is, and where the truth goes."""

import tomllib

import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin import Rig, save_runs, simulate, spring, spring_rig
from muscle_bayes.twin.overrides import override

SPRING = spring_rig(Rig())


@pytest.fixture
def run():
    return simulate(SPRING, spring(0.118), 1)


def test_truth_stands_apart_and_is_no_run(tmp_path, run):
    save_runs(tmp_path, {"one": run, "two": run})
    assert [read.name for read in read_runs([tmp_path])] == ["one", "two"]
    truth = tomllib.loads((tmp_path / "truth.toml").read_text())
    assert truth["rotor"] == {"friction_law": "coulomb", "J": 0.00124103, "D": 0.00545940}
    assert truth["runs"]["two"] == run.truth["run"]
    assert "0.00124103" not in (tmp_path / "one.toml").read_text()


def test_measured_runs_are_never_replaced(tmp_path, run):
    save_runs(tmp_path, {"one": run})
    metadata = tmp_path / "one.toml"
    metadata.write_text(metadata.read_text().replace('"synthetic"', '"measured"', 1))
    before = (tmp_path / "one.csv").read_bytes()
    with pytest.raises(MuscleBayesError, match="was measured"):
        save_runs(tmp_path, {"one": run})
    metadata.unlink()
    with pytest.raises(MuscleBayesError, match="does not say that it is synthetic"):
        save_runs(tmp_path, {"one": run})
    assert (tmp_path / "one.csv").read_bytes() == before


def test_synthetic_runs_are_replaced(tmp_path, run):
    save_runs(tmp_path, {"one": run})
    save_runs(tmp_path, {"one": simulate(SPRING, spring(0.12), 2)})
    assert "mass = [0.12]" in (tmp_path / "one.toml").read_text()


def test_other_runs_keep_their_truth(tmp_path, run):
    save_runs(tmp_path, {"one": run})
    save_runs(tmp_path, {"two": run})
    truth = tomllib.loads((tmp_path / "truth.toml").read_text())
    assert list(truth["runs"]) == ["one", "two"]
    other = simulate(override(SPRING, {"J": 0.002}), spring(0.118), 1)
    with pytest.raises(MuscleBayesError, match="rotor differs"):
        save_runs(tmp_path, {"two": other})
    save_runs(tmp_path, {"one": other, "two": other})


def test_a_foreign_truth_file_is_not_replaced(tmp_path, run):
    (tmp_path / "truth.toml").write_text("mine = 1\n")
    with pytest.raises(MuscleBayesError, match="not from here"):
        save_runs(tmp_path, {"one": run})
