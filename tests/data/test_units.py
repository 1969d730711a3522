"""Units by name: factors, kinds, and what is no unit."""

from math import pi

import pytest
from swing_log import SWING, TIME, csv, toml

from muscle_bayes.conventions import GRAVITY
from muscle_bayes.data import RunError
from muscle_bayes.data.checking.column_units import contradicts, meant_unit
from muscle_bayes.data.reading.header import unit_in_name, without_unit
from muscle_bayes.data.units import any_unit, unit_of

FACTORS = [
    ("time", "s", 1.0),
    ("time", "ms", 1e-3),
    ("time", "µs", 1e-6),
    ("time", "min", 60.0),
    ("angle", "rad", 1.0),
    ("angle", "mrad", 1e-3),
    ("angle", "deg", pi / 180),
    ("angle", "°", pi / 180),
    ("angle", "rev", 2 * pi),
    ("angle", "radians", 1.0),
    ("length", "m", 1.0),
    ("length", "cm", 1e-2),
    ("length", "um", 1e-6),
    ("length", "inch", 0.0254),
    ("angular velocity", "rad/s", 1.0),
    ("angular velocity", "deg/s", pi / 180),
    ("angular velocity", "rpm", 2 * pi / 60),
    ("velocity", "mm/s", 1e-3),
    ("mass", "g", 1e-3),
    ("mass", "lb", 0.45359237),
    ("mass", "N", 1 / GRAVITY),
    ("mass", "gf", 1e-3),
    ("force", "kgf", GRAVITY),
    ("torque", "Nm", 1.0),
    ("torque", "N·m", 1.0),
    ("torque", "N*cm", 1e-2),
    ("torque", "mNm", 1e-3),
    ("torque", "kgf*cm", GRAVITY / 100),
]


@pytest.mark.parametrize(("kind", "text", "factor"), FACTORS)
def test_factors(kind, text, factor):
    unit = unit_of(text, (kind,))
    assert unit is not None
    assert (unit.kind, unit.offset) == (kind, 0.0)
    assert unit.factor == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "logged"), [("degC", 25.0), ("C", 25.0), ("K", 298.15), ("kelvin", 298.15),
                         ("F", 77.0), ("degF", 77.0), ("°F", 77.0)]
)  # fmt: skip
def test_temperatures(text, logged):
    unit = unit_of(text, ("temperature",))
    assert unit is not None
    assert unit.factor * logged + unit.offset == pytest.approx(25.0)


@pytest.mark.parametrize(
    ("text", "kind"),
    [("rad/s", "angle"), ("m", "time"), ("percent", "angle"), ("", "angle"), ("1", "angle"),
     ("grad", "angle"), ("Hz", "angular velocity"), ("delta_degC", "temperature"), ("c", "velocity"),
     ("m**9", "length"), ("m/0", "length"), ("(((", "length"), ("import os", "length"),
     ("9" * 50, "length"), ("m^99", "length")],
)  # fmt: skip
def test_no_such_unit(text, kind):
    assert unit_of(text, (kind,)) is None


def test_the_kind_decides_what_a_letter_means():
    assert unit_of("Nm", ("torque",)) != any_unit("nm")
    assert unit_of("C", ("temperature",)).kind == "temperature"
    assert unit_of("K", ("temperature",)).offset == pytest.approx(-273.15)


@pytest.mark.parametrize(
    ("name", "kinds", "text"),
    [
        ("Time (s)", ("time",), "s"),
        ("Time [ms]", ("time",), "ms"),
        ("Time, s", ("time",), "s"),
        ("t/ms", ("time",), "ms"),
        ("time_ms", ("time",), "ms"),
        ("ms", ("time",), "ms"),
        ("angle_deg", ("angle",), "deg"),
        ("speed_rad_s", ("angular velocity",), "rad/s"),
        ("muscle_c", ("temperature",), "c"),
        ("x_m", ("length",), "m"),
        ("pos_c", ("length", "velocity"), None),
        ("time_a", ("time",), None),
        ("Position (filtered)", ("length",), None),
        ("Temperature A", ("temperature",), None),
        ("T", ("temperature",), None),
    ],
)
def test_what_names_say(name, kinds, text):
    meant = [unit for one in unit_in_name(name) if (unit := meant_unit(one, kinds)) is not None]
    assert ([unit.text for unit in meant] or [None])[0] == text


@pytest.mark.parametrize(
    "name", ["Temperature (A)", "Angle (raw)", "pos_a", "theta_b", "x (c)", "Weg (1)"]
)
def test_names_that_say_nothing_contradict_nothing(name):
    unit = unit_of("rad", ("angle",))
    assert not any(
        contradicts(one, unit, ("angle", "angular velocity")) for one in unit_in_name(name)
    )


def test_names_without_their_units():
    assert [without_unit(name) for name in ("Time (s)", "Time, s", "x", "a [b]")] == [
        "Time", "Time", "x", "a"]  # fmt: skip


POSITIONS = [("deg", 180 / pi), ("mrad", 1e3), ("rev", 0.5 / pi)]


@pytest.mark.parametrize(("unit", "per_radian"), POSITIONS)
def test_positions_in_other_units(read, unit, per_radian):
    metadata = toml().replace('"rad"', f'"{unit}"')
    run = read(content=csv(positions=SWING * per_radian).encode(), toml=metadata)
    assert run.coordinate == pytest.approx(SWING, abs=1e-4)
    assert run.unit == unit


def test_loads_forces_and_temperatures_in_other_units(read):
    columns = 'temperature_a = "T"\ntemperature_unit = "degF"\nload = "w"\nload_unit = "g"\n'
    columns += 'applied = "f"\napplied_unit = "N*cm"'
    metadata = toml(columns).replace("[element_a]", "[fixture]\ndisc_radius = 0.1\n[element_a]")
    run = read(
        content=csv("t,x,T,w,f", TIME, SWING, TIME * 0 + 77, TIME * 0 + 139, TIME).encode(),
        toml=metadata,
    )
    assert run.table["temperature_a"].to_numpy() == pytest.approx(25.0)
    assert run.table["load"].to_numpy() == pytest.approx(0.139)
    assert run.table["applied"].to_numpy() == pytest.approx(TIME / 100, abs=1e-4)


def test_loads_of_the_table_in_grams(read):
    metadata = toml().replace("[element_a]", "[fixture]\ndisc_radius = 0.1\n[element_a]")
    metadata += '[load]\nunit = "g"\ntime = [0.0, 1.0]\nmass = [139, 166.0]\n'
    run = read(content=csv().encode(), toml=metadata)
    assert run.metadata.load.mass == pytest.approx((0.139, 0.166))
    assert sorted(set(run.table["load"])) == pytest.approx([0.139, 0.166])


@pytest.mark.parametrize("unit", ["rad/s", "deg/s", "rpm"])
def test_a_velocity_is_measured_as_one(read, unit):
    run = read(content=csv("t,w").encode(), toml=toml(position='"w"').replace('"rad"', f'"{unit}"'))
    assert run.measured == "velocity"
    assert run.output == pytest.approx(SWING * unit_of(unit, ("angular velocity",)).factor)
    with pytest.raises(RunError, match="measures a velocity"):
        _ = run.coordinate
    with pytest.raises(RunError, match=r"measures a velocity.*Fix"):
        _ = run.sensor


def test_no_spelling_hint_between_units(read):
    with pytest.raises(RunError) as caught:
        read(content=csv().encode(), toml=toml().replace('"rad"', '"cmm"'))
    assert "did you mean" not in str(caught.value)
