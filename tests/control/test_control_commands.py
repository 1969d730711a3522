"""`robustness` and `tune` from a posterior file to gains and figures."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app
from muscle_bayes.control.gains import read_gains

SHORT = """
name = "nudge"
length = 6.0
noise = false
[setpoint]
time = [0.0, 1.0]
angle = [0.0, 0.03]
[load]
time = [0.0, 4.0]
mass = [0.0, 0.005]
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
        "tune", files / "muscle.nc", "--out", gains, "--header", header, "--criterion", "cvar",
        "--scenario", files / "nudge.toml", "--draws", 4, "--starts", 4, "--json", files / "t.json",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    found = read_gains(gains)
    assert found.law == "pi-antiwindup"
    counts = found.proportional * 0.0058 * 256
    assert counts == pytest.approx(round(counts), abs=1e-6)
    assert f"#define GAINS_KP {-round(counts)}L" in header.read_text()
    told = json.loads((files / "t.json").read_text())
    assert told["kept_apart"]["draws"] == 4
    assert told["evaluations"] > 4
    assert "assumed" in done.output


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--criterion", "probability"), "belong together"),
        (("--spec", "overshoot=0.1"), "belong together"),
        (("--criterion", "probability", "--spec", "speed=3"), "no METRIC=LIMIT"),
        (("--criterion", "probability", "--spec", "overshoot=-1"), "no METRIC=LIMIT"),
        (("--scenario", "jump"), "is not known"),
        (("--law", "cascade", "--header", "g.h"), "does not run on the firmware"),
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


@pytest.mark.slow
def test_robustness_draws_every_scenario(files):
    out = files / "figures"
    done = invoke(
        "robustness", files / "muscle.nc", "--gains", files / "g.toml", "--draws", 8,
        "--scenario", files / "nudge.toml", "--out", out, "--json", files / "r.json",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    assert len(list(out.glob("*.png"))) == 14
    told = json.loads((files / "r.json").read_text())
    assert set(told["scenarios"]) == {path.stem for path in out.glob("*.png")} - {"runaway"}
    error = told["scenarios"]["step"]["tracking_error"]
    assert 0 < error["q05"] <= error["median"] <= error["q95"]
    chance = np.array(told["runaway"]["unsafe"])
    assert ((chance >= 0) & (chance <= 1)).all()
