"""Rigs from names and files."""

import pytest

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.twin import Rig
from muscle_bayes.twin.overrides import override, parse_setting, read_rig
from muscle_bayes.twin.plans import plan_runs, read_stages


def test_a_name_may_be_short_where_it_is_unambiguous():
    rig = override(Rig(), {"J": 0.002, "muscle_a.K_hyst": 400, "element_b.kind": "spring"})
    assert rig.truth.J == 0.002
    assert rig.truth.muscle_a.K_hyst == 400.0
    assert rig.element_b.kind == "spring"


@pytest.mark.parametrize(
    ("text", "setting"),
    [
        ("J=0.002", ("J", 0.002)),
        ("stops=[-1, 1]", ("stops", [-1, 1])),
        ("element_a.kind=spring", ("element_a.kind", "spring")),
    ],
)
def test_settings_are_name_and_value(text, setting):
    assert parse_setting(text) == setting


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"K_hyst": 1.0}, "ambiguous"),
        ({"colour": 1.0}, "unknown rig parameter"),
        ({"J": "heavy"}, "a valid number"),
        ({"J": 0.0}, "greater than 0"),
        ({"J": float("nan")}, "finite"),
        ({"D": -1.0}, "equal to 0"),
        ({"stops": 1.0}, "stops: 1.0: input"),
        ({"stops": [1.0, -1.0]}, "must be"),
        ({"element_a.kind": "rope"}, "'muscle', 'spring' or 'none'"),
        ({"element_a.heater_length": 0.2}, "between 0 and base_length"),
    ],
)
def test_impossible_values_are_errors(values, told):
    with pytest.raises(MuscleBayesError, match=told):
        override(Rig(), values)


def test_a_file_replaces_what_differs(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(
        "[fixture]\ndisc_radius = 0.08\n[truth]\nJ = 0.002\n[truth.muscle_a]\nH = -500\n"
        "[effects.bias-torque]\ntorque = 0.002\n"
    )
    rig = read_rig(path)
    assert (rig.fixture.disc_radius, rig.truth.J, rig.truth.muscle_a.H) == (0.08, 0.002, -500.0)
    assert [effect.name for effect in rig.truth.effects] == ["bias-torque"]


@pytest.mark.parametrize("text", ["[fixture", "[fixture]\nx = 1", "[effects.nope]", "effects = 3"])
def test_a_wrong_file_is_an_error_that_names_it(tmp_path, text):
    path = tmp_path / "rig.toml"
    path.write_text(text)
    with pytest.raises(MuscleBayesError, match=r"rig\.toml"):
        read_rig(path)


def test_stages_from_a_file(tmp_path):
    path = tmp_path / "stages.toml"
    path.write_text(
        "load = 0.15\n[[stage]]\nsetpoint_a = 60\n[[stage]]\nduration = 5\nload = 0.2\n"
    )
    protocol = read_stages(path)
    assert protocol.load == 0.15
    assert [stage.load for stage in protocol.stages] == [None, 0.2]
    for text in (
        "load = 1",
        "[[stage]]",
        "[[stage]]\nsetpoint = 1",
        "hue = 1\n[[stage]]\nwait = 1",
        "load = 139\n[[stage]]\nduration = 1",
        "[[stage]]\nduration = 1\nload = 139",
    ):
        path.write_text(text)
        with pytest.raises(MuscleBayesError, match=r"stages\.toml"):
            read_stages(path)


def test_plans_name_their_runs():
    assert list(plan_runs("staircase", Rig())) == [
        "staircase-139g",
        "staircase-166g",
        "staircase-212g",
    ]
    assert list(plan_runs("staircase", Rig(), [0.139], name="mine")) == ["mine"]
    assert list(plan_runs("staircase", Rig(), [0.1, 0.2], name="mine")) == ["mine-1", "mine-2"]
    for wrong in ({"name": "../x"}, {"masses": [-0.1]}, {"masses": [139.0]}, {"log_period": 0.0}):
        with pytest.raises(MuscleBayesError):
            plan_runs("staircase", Rig(), **wrong)
    with pytest.raises(MuscleBayesError, match="belong together"):
        plan_runs("free", Rig())
