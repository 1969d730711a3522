"""`muscle-bayes inspect` from outside."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import typer
from typer.testing import CliRunner

from muscle_bayes.cli import app
from muscle_bayes.cli.common import user_errors, write_json
from muscle_bayes.data import (
    HEADER,
    Fixture,
    Load,
    Metadata,
    MuscleElement,
    Potentiometer,
    write_run,
)
from muscle_bayes.errors import MuscleBayesError


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """A folder of one synthetic run with a gap and a change of load."""
    rows = 300
    time = np.arange(rows) * 0.03
    time[200:] += 2.0
    log = pd.DataFrame({name: np.zeros(rows) for name in HEADER})
    log[HEADER[0]] = time
    log[HEADER[1]] = np.round(25 + 20 * np.sin(time), 1)
    log[HEADER[2]] = np.where(time < 4, 40.0, 60.0)
    log[HEADER[8]] = np.rint(500 + 10 * np.sin(time))
    metadata = Metadata(
        protocol="staircase",
        origin="synthetic",
        fixture=Fixture(rotor_radius_a=0.03, anchor_x_a=0.03, anchor_y_a=0.115, disc_radius=0.09),
        potentiometer=Potentiometer(zero_reading=512.0, radians_per_count=0.0058),
        element_a=MuscleElement(base_length=0.1),
        load=Load(time=(0.0, 5.0), mass=(0.139, 0.166)),
    )
    return write_run(tmp_path / "runs", "stairs", log, metadata).parent


def inspect(*arguments):
    return CliRunner().invoke(app, ["inspect", *map(str, arguments)], env={"COLUMNS": "200"})


def test_shows_draws_and_writes_json(runs, tmp_path):
    result = inspect(runs, "--json", tmp_path / "new" / "facts.json", "--out", tmp_path / "figures")
    assert result.exit_code == 0, result.output
    for words in ["SYNTHETIC", "staircase", "300 in 10.97 s", "139", "gap", "muscle", "sha256"]:
        assert words in result.output
    assert (tmp_path / "figures" / "stairs.png").read_bytes().startswith(b"\x89PNG")
    facts = json.loads((tmp_path / "new" / "facts.json").read_text())
    (run,) = facts["runs"]
    assert facts["failed"] == []
    assert run["load_steps_s"] == [5.0]
    assert run["repairs"][0]["rule"] == "gap"
    assert run["position"]["unit"] == "counts"


def test_lists_what_the_run_assumes(runs, tmp_path):
    facts = tmp_path / "facts.json"
    result = inspect(runs, "--out", tmp_path, "--json", facts)
    for words in ["assumed", "fixture.stops: none", "zero_uncertainty: 2 counts"]:
        assert words in result.output
    (run,) = json.loads(facts.read_text())["runs"]
    assert {"key": "fixture.stops", "taken": "none"} in run["assumed"]


def test_shows_a_measured_velocity(tmp_path):
    rows = [f"{0.01 * n:.2f},{np.cos(0.1 * n):.4f}" for n in range(100)]
    (tmp_path / "wheel.csv").write_text("\n".join(["t,rate", *rows]))
    (tmp_path / "wheel.toml").write_text(
        'format = 1\nprotocol = "free"\norigin = "measured"\n[columns]\ntime = "t"\n'
        'position = "rate"\nposition_unit = "rad/s"\n[element_a]\nkind = "none"\n'
    )
    result = inspect(tmp_path / "wheel.csv", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert "velocity" in result.output
    assert "deg/s" in result.output


def test_figure_is_named_and_the_same_bytes(runs, tmp_path):
    one, two = tmp_path / "one.png", tmp_path / "two.png"
    assert inspect(runs / "stairs.csv", "--figure", one).exit_code == 0
    assert inspect(runs / "stairs.toml", "--figure", two).exit_code == 0
    assert one.read_bytes() == two.read_bytes()


def test_default_folder(runs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert inspect(runs).exit_code == 0
    assert (tmp_path / "reports" / "inspect" / "stairs.png").exists()


def test_goes_on_after_a_bad_run(runs, tmp_path):
    (runs / "bad.csv").write_text("a,b\n1,2\n")
    facts = tmp_path / "facts.json"
    result = inspect(runs, "--out", tmp_path / "figures", "--json", facts)
    assert result.exit_code == 2
    assert "bad.toml" in result.stderr
    assert "Fix" in result.stderr
    assert "Traceback" not in result.output
    assert (tmp_path / "figures" / "stairs.png").exists()
    assert json.loads(facts.read_text())["failed"][0]["path"].endswith("bad.csv")


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--figure", "a.pdf"], "end the name in .png"),
        (["--figure", "a.png", "--out", "b"], "give --out DIR alone"),
    ],
)
def test_options_that_contradict(runs, options, told):
    result = inspect(runs, *options)
    assert result.exit_code == 2
    assert told in result.stderr


def test_figure_that_cannot_be_written(runs, tmp_path):
    (tmp_path / "file").write_text("")
    result = inspect(runs, "--out", tmp_path / "file")
    assert result.exit_code == 2
    assert "cannot be written" in result.stderr


def test_no_runs(tmp_path):
    result = inspect(tmp_path)
    assert result.exit_code == 2
    assert "no runs" in result.stderr


def test_interrupted():
    def command() -> None:
        raise KeyboardInterrupt

    with pytest.raises(typer.Exit) as caught, user_errors():
        command()
    assert caught.value.exit_code == 130


def test_json_is_standard_and_whole(tmp_path):
    path = tmp_path / "a.json"
    data = {"b": np.array([1.0, np.nan]), "a": [np.int64(2), float("inf")], "c": {"x", "w"}}
    write_json(path, data)
    assert json.loads(path.read_text()) == {"b": [1.0, None], "a": [2, None], "c": ["w", "x"]}
    with pytest.raises(TypeError):
        write_json(path, {"b": object()})
    assert json.loads(path.read_text())["a"] == [2, None]
    with pytest.raises(MuscleBayesError, match="cannot be written"):
        write_json(path / "below" / "a.json", {})
    assert [file.name for file in tmp_path.iterdir()] == ["a.json"]


def test_version():
    result = CliRunner().invoke(app, ["--version"])
    assert result.exit_code == 0
    assert result.output.startswith("muscle-bayes ")


def test_help_imports_nothing_heavy():
    code = (
        "import sys; import muscle_bayes.cli; "
        "print({'jax', 'arviz', 'matplotlib', 'pandas', 'numpy'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


@pytest.mark.real
@pytest.mark.parametrize("folder", ["xl330-drop", "emps", "heating-wire"])
def test_real_runs(real_data, tmp_path, folder):
    result = inspect(real_data / folder, "--out", tmp_path)
    assert result.exit_code == 0
    assert "measured" in result.output
    assert "SYNTHETIC" not in result.output
    assert len(list(tmp_path.glob("*.png"))) == len(list((real_data / folder).glob("*.csv")))
