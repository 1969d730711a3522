"""What metadata leave out is listed, key by key."""

import pytest
from pydantic import BaseModel
from sample_log import TOML
from swing_log import csv, toml

from muscle_bayes.data import Metadata, assumptions
from muscle_bayes.data.describing.assumptions import ABSENT, ESTIMATED
from muscle_bayes.data.validation import _models


def tables(model=Metadata, found=None):
    """Every table of the metadata."""
    found = {} if found is None else found
    found[model.__name__] = model
    for field in model.model_fields.values():
        for inner in _models(field.annotation):
            if inner.__name__ not in found:
                tables(inner, found)
    return found


OPTIONAL = [
    f"{name}.{key}"
    for name, model in tables().items()
    for key, field in model.model_fields.items()
    if not field.is_required()
]


def test_tables_are_found():
    assert {"Fixture", "SpringElement", "LogFormat", "Load"} <= set(tables())
    assert all(issubclass(model, BaseModel) for model in tables().values())


SILENT = """
Metadata: format notes fixture potentiometer thermometer_log log
Fixture: rotor_radius_a anchor_x_a anchor_y_a rotor_radius_b anchor_x_b anchor_y_b disc_radius
ThermometerLog: time
LogFormat: sample_rate
Columns: time load position power_a power_b force accept_units
MuscleElement: kind drum_radius specimen length_at_zero
SpringElement: kind drum_radius length_at_zero free_length
ArmElement: kind mass centre_distance
NoElement: kind
"""
"""Keys whose absence assumes nothing."""
SILENT_KEYS = {
    f"{line.partition(':')[0]}.{key}"
    for line in SILENT.strip().splitlines()
    for key in line.partition(":")[2].split()
}


@pytest.mark.parametrize("key", OPTIONAL)
def test_every_default_has_a_word_or_assumes_nothing(key):
    assert (key in ABSENT) != (key in SILENT_KEYS)


def test_no_word_for_what_is_no_key():
    assert set(ABSENT) | SILENT_KEYS <= set(OPTIONAL)


def told(run):
    return {one.key: one.taken for one in assumptions(run)}


def test_a_pendulum(read):
    found = told(read(content=csv().encode(), toml=toml()))
    assert found["fixture.stops"] == "none"
    assert found["fixture.motion"] == "rotary"
    assert found["columns.time_unit"] == "s"
    assert found["element_a.hanging_angle"] == "0 rad"
    assert found["load"] == "nothing hangs on the rig"
    assert "fixture.room_temperature" not in found


def test_the_fixture_with_a_muscle(read):
    found = told(read())
    assert found["potentiometer.zero_uncertainty"] == "2 counts"
    assert found["element_a.heater_length"] == "heated over its whole length"
    assert "fixture.stops" not in found
    assert "delay" in found["thermometer"]


def test_what_is_stated_is_not_listed(read):
    found = told(read(toml=TOML + "[thermometer]\ndelay = 0.1\n"))
    assert "thermometer" not in found
    assert found["thermometer.delay_uncertainty"] == "0 s, the delay is exact"


def test_a_spring_and_a_release(read):
    arm = '"arm"\nmass = 0.3\ncentre_distance = 0.2'
    metadata = toml().replace(arm, '"spring"\nlinkage = "torsion"')
    found = told(read(content=csv().encode(), toml=metadata.replace('"free"', '"spring"')))
    assert found["element_a.rate"] == ESTIMATED
    assert found["element_a.tension_at_zero"] == ESTIMATED
    assert "element_a.free_length" not in found
    assert "released" in found["first speed"]
