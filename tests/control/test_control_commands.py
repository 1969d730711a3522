"""`robustness` and `tune` from a posterior file to gains and figures; a hidden joint inside the band."""

import json

import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app
from muscle_bayes.control.laws.gains import read_gains

SHORT = """
name = "nudge"
length = 12.0
noise = false
[setpoint]
time = [0.0, 1.0]
angle = [0.0, 0.03]
"""


@pytest.fixture(scope="module")
def files(posterior, tmp_path_factory):
    folder = tmp_path_factory.mktemp("control")
    posterior.save(folder / "muscle.nc")
    (folder / "nudge.toml").write_text(SHORT)
    (folder / "g.toml").write_text("proportional = 3000.0\nintegral = 100.0\n")
    return folder


def invoke(*arguments):
    return CliRunner().invoke(app, [str(one) for one in arguments])


def test_tune_writes_gains_that_the_bench_can_run(files):
    header, gains = files / "gains.h", files / "tuned.toml"
    done = invoke(
        "tune", files / "muscle.nc", "--out", gains, "--header", header, "--law", "pi",
        "--scenario", files / "nudge.toml", "--draws", 8, "--judged", 8, "--starts", 4,
        "--report", files / "report", "--json", files / "t.json",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    assert read_gains(gains).law in ("pi", "thesis")
    assert "#define GAINS_KP -" in header.read_text()
    told = json.loads((files / "t.json").read_text())
    assert set(told["laws"]) == {"pi", "thesis"}
    assert told["draws"] == 8
    assert 0.0 < told["specifications"]["nudge"]["attainable"] <= 1.0
    assert "assumed" in done.output
    page = (files / "report" / "report.md").read_text()
    assert told["sentence"] in page.replace("**", "")
    assert {one.name for one in (files / "report").glob("*.png")} >= {"responses.png", "pareto.png"}


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (
            ("--spec", "settling=3"),
            "unknown metric 'settling'. Did you mean 'settling_time'? Fix: use",
        ),
        (("--spec", "overshoot=-1"), "the limit is no positive number. Fix: write METRIC=LIMIT"),
        (("--scenario", "jump"), "--scenario jump is not known. Fix: use a file, or one of"),
    ],
)
def test_what_cannot_be_tuned_is_told(files, arguments, told):
    done = invoke("tune", files / "muscle.nc", "--out", files / "no.toml", *arguments)
    assert done.exit_code == 2
    assert told in " ".join(done.output.split())
    assert not (files / "no.toml").exists()


def test_nonsense_gains_end_the_command_with_a_message(files):
    (files / "bad.toml").write_text("proportional = -1.0\nintegral = 2.0\n")
    done = invoke(
        "robustness", files / "muscle.nc", "--gains", files / "bad.toml", "--out", files / "r"
    )
    assert done.exit_code == 2
    assert "key proportional" in " ".join(done.output.split())


def test_a_posterior_without_muscle_is_refused(files, posterior):
    tree = posterior.tree.copy()
    tree["posterior"] = tree["posterior"].to_dataset().drop_vars("K_modulus")
    type(posterior)(tree).save(files / "fixture.nc")
    done = invoke("robustness", files / "fixture.nc", "--out", files / "r")
    assert done.exit_code == 2
    assert "K_modulus" in done.output
