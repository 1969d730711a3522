"""The shipped data regenerate to the byte."""

import tomllib
from pathlib import Path

import pytest

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin import save_runs
from muscle_bayes.twin.shipped import shipped_runs, simulate_shipped, write_shipped

DATA = Path(__file__).parents[2] / "data"


def test_the_springs_regenerate_to_the_byte(tmp_path):
    names = [name for name in shipped_runs() if name.startswith("spring")]
    assert len(names) == 5
    save_runs(tmp_path, simulate_shipped(names))
    for name in names:
        for suffix in (".csv", ".toml"):
            path = tmp_path / f"{name}{suffix}"
            assert path.read_bytes() == (DATA / path.name).read_bytes(), path.name


def test_springs_keep_above_their_least_length_and_off_the_stops():
    for name, run in simulate_shipped([n for n in shipped_runs() if n.startswith("s")][:5]).items():
        counts = run.log["Potentiometer Reading"]
        assert counts.min() > 507, name
        assert (counts.max() - 512) * 0.0058 < 1.1, name


@pytest.mark.slow
def test_the_whole_set_regenerates_to_the_byte(tmp_path):
    write_shipped(tmp_path)
    made = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.*")}
    kept = {
        str(path.relative_to(DATA))
        for path in DATA.rglob("*.*")
        if path.parent.parent.name != "lot"
    }
    assert made == {name for name in kept if not name.endswith("study.toml")}  # written by hand
    for name in made:
        assert (tmp_path / name).read_bytes() == (DATA / name).read_bytes(), name


def test_nothing_is_hidden_in_the_plain_set_and_two_effects_in_the_other():
    hidden, plain = (
        tomllib.loads((folder / "truth.toml").read_text()) for folder in (DATA, DATA / "plain")
    )
    assert set(hidden["effects"]) == {"coil-contact", "damper-law"}
    assert "effects" not in plain
    assert hidden["muscle_a"] == plain["muscle_a"]


def test_everything_shipped_says_it_is_synthetic():
    for name in shipped_runs():
        assert 'origin = "synthetic"' in (DATA / f"{name}.toml").read_text()
    assert (DATA / "README.md").read_text().startswith("# These data are SYNTHETIC")


def test_a_foreign_readme_is_not_replaced(tmp_path):
    (tmp_path / "README.md").write_text("# Mine\n")
    with pytest.raises(MuscleBayesError, match=r"README\.md"):
        write_shipped(tmp_path)
