"""`muscle-bayes simulate`."""

import json

import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app
from muscle_bayes.data import read_runs


def invoke(*args: object):
    return CliRunner().invoke(app, ["simulate", *map(str, args)])


def test_spring_runs_with_an_effect(tmp_path):
    report = tmp_path / "report.json"
    result = invoke(
        *("spring", "--out", tmp_path / "runs", "--mass", 0.112, "--mass", 0.118),
        *("--effect", "viscous-friction:coefficient=0.001", "--set", "J=0.0013"),
        *("--seed", 3, "--json", report),
    )
    assert result.exit_code == 0, result.output
    assert "synthetic spring" in result.output
    runs = read_runs([tmp_path / "runs"])
    assert [run.name for run in runs] == ["spring-1", "spring-2"]
    told = json.loads(report.read_text())
    assert told["seed"] == 3
    assert told["runs"][0]["truth"]["effects"]["viscous-friction"]["coefficient"] == 0.001
    assert told["runs"][0]["truth"]["rotor"]["J"] == 0.0013


def test_linear_friction_brings_its_own_table_1(tmp_path):
    truth = tmp_path / "elsewhere.toml"
    result = invoke(
        *("spring", "--out", tmp_path / "runs", "--mass", 0.118, "--name", "one"),
        *("--friction", "linear", "--truth", truth),
    )
    assert result.exit_code == 0, result.output
    assert 'friction_law = "linear"\nJ = 0.0013139\nD = 0.00415667' in truth.read_text()
    assert not (tmp_path / "runs" / "truth.toml").exists()


def test_free_runs_take_their_stages_from_a_file(tmp_path):
    stages, rig = tmp_path / "stages.toml", tmp_path / "rig.toml"
    stages.write_text("load = 0.15\n[[stage]]\nduration = 3\n[[stage]]\nduration = 3\nload = 0.2\n")
    rig.write_text('[element_b]\nkind = "spring"\n')
    result = invoke("free", "--stages", stages, "--rig", rig, "--out", tmp_path / "runs")
    assert result.exit_code == 0, result.output
    (run,) = read_runs([tmp_path / "runs"])
    assert run.metadata.element_b.kind == "spring"
    assert run.metadata.load is not None
    assert run.metadata.load.mass == (0.15, 0.2)


@pytest.mark.parametrize(
    ("args", "told"),
    [
        (("spring", "--effect", "gremlin"), "unknown effect"),
        (("spring", "--set", "J"), "not PARAM=VALUE"),
        (("spring", "--set", "colour=3"), "unknown rig parameter"),
        (("spring", "--mass", "-5"), "cannot hang"),
        (("spring", "--mass", "139"), "write 0.139 if 139 g are meant"),
        (("spring", "--rig", "nowhere.toml"), "nowhere.toml"),
        (("shipped", "--mass", "5"), "the set is fixed"),
        (("free",), "belong together"),
    ],
)
def test_errors_are_messages(tmp_path, args, told):
    result = invoke(*args, "--out", tmp_path)
    assert result.exit_code == 2
    assert told in result.output
    assert not list(tmp_path.glob("*.csv"))


def test_a_folder_that_cannot_be_is_a_message(tmp_path):
    (tmp_path / "file").write_text("")
    result = invoke("spring", "--mass", 0.118, "--out", tmp_path / "file" / "runs")
    assert result.exit_code == 2
    assert "cannot be written" in result.output
