"""NAME.toml: what it holds, and what is refused with which words."""

import pytest
from pydantic import ValidationError
from sample_log import TOML

from muscle_bayes.data import (
    ArmElement,
    Columns,
    Fixture,
    Metadata,
    MuscleElement,
    NoElement,
    RunError,
    read_metadata,
)
from muscle_bayes.data.describing.metadata import parse_metadata


def test_defaults():
    columns = Columns(time="t", position="q", position_unit="rad")
    metadata = Metadata(protocol="free", origin="measured", columns=columns, element_a=NoElement())
    assert metadata.fixture.room_temperature == 25
    assert metadata.fixture.motion == "rotary"
    assert metadata.element_b == NoElement()
    assert not metadata.has_load
    assert metadata.position_unit == "rad"


def test_is_immutable():
    with pytest.raises(ValidationError, match="frozen"):
        Fixture().motion = "linear"  # type: ignore[misc]


def test_elements_by_kind(tmp_path):
    metadata = parse_metadata(TOML.encode(), tmp_path / "a.toml")
    assert metadata.element_a == MuscleElement(base_length=0.1)
    arm = 'kind = "arm"\nmass = 0.49\ncentre_distance = 0.1\n'
    toml = TOML.replace('kind = "none"', arm)
    element = parse_metadata(toml.encode(), tmp_path / "a.toml").element_b
    assert element == ArmElement(mass=0.49, centre_distance=0.1)


def test_constructed_in_python_is_checked_too():
    with pytest.raises(ValidationError, match="potentiometer: missing"):
        Metadata(protocol="free", origin="measured", element_a=NoElement())


@pytest.mark.parametrize("inertia", ["5e-324", "1e-40", "1e31", "-1.0"])
def test_a_size_that_nothing_has_is_refused(tmp_path, inertia):
    toml = TOML.replace("[fixture]", f"[fixture]\ninertia = {inertia}")
    with pytest.raises(RunError, match=r"a\.toml, key fixture\.inertia: .* Fix: "):
        parse_metadata(toml.encode(), tmp_path / "a.toml")


@pytest.mark.parametrize(
    ("table", "key", "value", "meant"),
    [
        ("fixture", "room_temperature", "77.0", "write 25 if 77 F"),
        ("fixture", "room_temperature", "298.15", "write 25 if 298.15 K"),
        ("fixture", "disc_radius", "88.9", "write 0.0889 if 88.9 mm"),
        ("element_a", "heater_length", "80", "write 0.08 if 80 mm"),
    ],
)
def test_the_unit_that_is_likely_meant_is_named(tmp_path, table, key, value, meant):
    kept = [line for line in TOML.splitlines() if not line.startswith(f"{key} ")]
    kept.insert(kept.index(f"[{table}]") + 1, f"{key} = {value}")
    with pytest.raises(RunError, match=rf"a\.toml, key {table}\.{key}: .*{meant}"):
        parse_metadata("\n".join(kept).encode(), tmp_path / "a.toml")


@pytest.mark.parametrize("uncertainty", ["-0.1", "11", "nan", '"some"'])
def test_uncertainty_of_the_delay_is_a_size_in_seconds(tmp_path, uncertainty):
    toml = TOML + f"\n[thermometer]\ndelay = 0.04\ndelay_uncertainty = {uncertainty}\n"
    with pytest.raises(RunError, match=r"a\.toml.*thermometer\.delay_uncertainty"):
        parse_metadata(toml.encode(), tmp_path / "a.toml")


@pytest.mark.parametrize("delay", ["11", "nan", '"a while"'])
def test_delay_of_the_thermometer_is_a_number_of_seconds(tmp_path, delay):
    toml = TOML + f"\n[thermometer]\ndelay = {delay}\n"
    with pytest.raises(RunError, match=r"a\.toml.*thermometer\.delay"):
        parse_metadata(toml.encode(), tmp_path / "a.toml")


LINEAR = TOML.replace("[fixture]", '[fixture]\nmotion = "linear"')
COLUMNS = '\n[columns]\ntime = "t"\nposition = "q"\nposition_unit = "rad"\n'
MUSCLE_B = TOML.replace('kind = "none"', 'kind = "muscle"\nbase_length = 0.1')


def without(*lines):
    return "\n".join(line for line in TOML.splitlines() if not line.startswith(lines))


def swap(old, new):
    assert old in TOML
    return TOML.replace(old, new)


REFUSED = {
    "syntax": (swap('"synthetic"', "synthetic"), ["line 3", "not valid TOML", "quotes"]),
    "syntax of the last line": (
        TOML + "x = [1,\n\n",
        [f"stairs.toml, line {len(TOML.splitlines()) + 1}: not", "quotes"],
    ),
    "key twice": (swap("[fixture]", "[fixture]\nstops = [0.0, 1.0]"), ["TOML", "line"]),
    "no format's number": (
        swap("format = 1", "format = 2"),
        ["key format", "2 is not known", "Fix: write format = 1."],
    ),
    "no protocol": (without("protocol"), ["key protocol", "missing", "add protocol"]),
    "no element a": (
        TOML.replace("[element_a]", "[element_b]", 1).rsplit("[element_b]", 1)[0],
        [
            "key element_a",
            "missing",
            'add the table [element_a] with kind = "muscle", "spring", "arm" or "none".',
        ],
    ),
    "no origin": (
        without("origin"),
        ['key origin: missing. Fix: add origin = "measured" (or "synth'],
    ),
    "two at once": (
        without("origin", "protocol"),
        ["stairs.toml, key protocol: missing", '"imposed").\n', "stairs.toml, key origin: missing"],
    ),
    "unknown protocol": (swap("staircase", "stairs"), ["key protocol", "did you mean 'staircase'"]),
    "unknown origin": (swap('"synthetic"', '"guess"'), ["key origin", "measured, synthetic"]),
    "misspelt key": (
        swap("disc_radius", "disk_radius"),
        ["key fixture.disk_radius", "unknown key", "did you mean 'disc_radius'"],
    ),
    "misspelt table": (swap("[fixture]", "[fixtures]"), ["fixtures", "did you mean 'fixture'"]),
    "key of another element": (
        swap("base_length = 0.100", "base_length = 0.1\nmass = 1.0"),
        ["key element_a.mass", "unknown key", "known are"],
    ),
    "misspelt key of an element": (
        swap("base_length", "base_lenght"),
        ["key element_a.base_lenght", "did you mean 'base_length'"],
    ),
    "no kind": (swap('kind = "muscle"', ""), ["key element_a.kind", "missing", "add kind"]),
    "unknown kind": (swap('"muscle"', '"mussel"'), ["element_a.kind", "did you mean 'muscle'"]),
    "muscle without length": (
        without("base_length"),
        ["key element_a.base_length", "missing", "add base_length"],
    ),
    "length zero": (swap("0.100", "0.0"), ["element_a.base_length", "greater than 0"]),
    "length in words": (swap("0.100", '"0.1"'), ["element_a.base_length", "valid number"]),
    "length nan": (swap("0.100", "nan"), ["element_a.base_length", "nan"]),
    "heater longer than muscle": (
        swap("base_length = 0.100", "base_length = 0.1\nheater_length = 0.2"),
        ["key element_a.heater_length", "longer than base_length", "check both"],
    ),
    "drum without radius": (
        swap('"muscle"', '"muscle"\nlinkage = "drum"\nlength_at_zero = 0.1'),
        ["key element_a.drum_radius", "linkage 'drum' needs it", "add drum_radius"],
    ),
    "drum without length": (
        swap('"muscle"', '"muscle"\nlinkage = "drum"\ndrum_radius = 0.01'),
        ["key element_a.length_at_zero", "add length_at_zero"],
    ),
    "pins with a drum's radius": (
        swap('"muscle"', '"muscle"\ndrum_radius = 0.01'),
        ["key element_a.drum_radius", "not used by linkage 'pins'", "remove it"],
    ),
    "pins without geometry": (
        without("anchor_y_a"),
        ["key fixture.anchor_y_a", "element_a is linked by pins", "add anchor_y_a"],
    ),
    "pins on side b without geometry": (
        MUSCLE_B,
        ["key fixture.rotor_radius_b", "element_b is linked by pins", "add rotor_radius_b"],
    ),
    "stops the wrong way": (
        swap("[-1.2, 1.2]", "[1.2, -1.2]"),
        ["key fixture.stops", "[lower, upper]", "swap"],
    ),
    "three stops": (swap("[-1.2, 1.2]", "[-1.2, 0.0, 1.2]"), ["key fixture.stops", "2"]),
    "room on fire": (swap("25.0", "250.0"), ["fixture.room_temperature", "no room has 250 C"]),
    "counts without potentiometer": (
        without("[potentiometer]", "zero_reading", "radians_per_count"),
        ["key potentiometer", "position is in counts", "columns.position_unit"],
    ),
    "scale zero": (swap("0.0058", "0.0"), ["potentiometer.radians_per_count", "is zero", "rad"]),
    "two loads": (
        TOML + COLUMNS + 'load = "kg"\n',
        ["key columns.load", "together with [load]", "keep the one"],
    ),
    "load without disc": (
        without("disc_radius"),
        ["key fixture.disc_radius", "carries a load", "add disc_radius"],
    ),
    "load times fall": (swap("[0.0, 1.0]", "[1.0, 0.5]"), ["key load.time", "rising order"]),
    "load time negative": (swap("[0.0, 1.0]", "[-1.0, 1.0]"), ["key load.time[1]", "-1.0"]),
    "load lengths differ": (
        swap("[0.139, 0.166]", "[0.139]"),
        ["key load.mass", "1 masses for 2 times", "one mass a time"],
    ),
    "load empty": (
        swap("[0.0, 1.0]", "[]").replace("[0.139, 0.166]", "[]"),
        ["key load.time", "is empty", "remove [load]"],
    ),
    "load mass negative": (swap("0.139", "-0.139"), ["key load.mass[1]", "-0.139"]),
    "counts on linear motion": (LINEAR, ["key columns.position_unit", "'counts'", "m, mm"]),
    "radians on linear motion": (
        LINEAR + COLUMNS,
        ["key columns.position_unit", "'rad' does not fit", "m, mm"],
    ),
    "metres on rotary motion": (
        TOML + COLUMNS.replace('"rad"', '"m"'),
        ["key columns.position_unit", "'m' does not fit", "counts, rad, mrad, deg"],
    ),
    "pins on linear motion": (
        LINEAR + COLUMNS.replace('"rad"', '"m"'),
        ["key element_a.linkage", "'pins' does not fit", "'straight'"],
    ),
    "straight on rotary motion": (
        swap('"muscle"', '"muscle"\nlinkage = "straight"\nlength_at_zero = 0.1'),
        ["key element_a.linkage", "'straight' does not fit", "'pins' or 'drum'"],
    ),
    "arm on linear motion": (
        LINEAR.replace('"muscle"\nbase_length = 0.100', '"arm"\nmass = 1.0\ncentre_distance = 0.1')
        + COLUMNS.replace('"rad"', '"m"'),
        ["key element_a.kind", "an arm swings", "rotary motion"],
    ),
    "unknown unit": (
        TOML + COLUMNS.replace('"rad"', '"radius"'),
        ["key columns.position_unit", "no unit of", "one such as counts, rad"],
    ),
    "sign two": (TOML + COLUMNS + "position_sign = 2", ["columns.position_sign", "one of 1, -1"]),
    "zero told twice": (
        TOML + COLUMNS.replace('"rad"', '"counts"\nposition_zero = 3.0'),
        ["key columns.position_zero", "not in counts", "potentiometer.zero_reading"],
    ),
    "uncertainty told twice": (
        TOML + COLUMNS.replace('"rad"', '"counts"\nposition_zero_uncertainty = 3.0'),
        ["key columns.position_zero_uncertainty", "potentiometer.zero_uncertainty"],
    ),
    "uncertainty below zero": (
        TOML + COLUMNS + "position_zero_uncertainty = -0.1",
        ["key columns.position_zero_uncertainty", "-0.1"],
    ),
    "time is position": (
        TOML + COLUMNS.replace('"q"', '"t"'),
        ["key columns.position", "same column as time", "position's own"],
    ),
    "table is a number": ("fixture = 3\n" + without("[fixture]"), ["fixture", "correct"]),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_refused(tmp_path, kind):
    toml, told = REFUSED[kind]
    path = tmp_path / "stairs.toml"
    path.write_text(toml)
    with pytest.raises(RunError) as caught:
        read_metadata(path)
    for words in ["stairs.toml", "Fix: ", *told]:
        assert words in str(caught.value)
    assert "?." not in str(caught.value)


def test_not_utf8(tmp_path):
    with pytest.raises(RunError, match=r"a\.toml: line 2 is not UTF-8.*save the file as UTF-8"):
        parse_metadata(b"format = 1\nnotes = '\xb0'\n", tmp_path / "a.toml")


def test_missing_file(tmp_path):
    with pytest.raises(RunError, match=r"absent\.toml: no such file\. Fix: correct the path"):
        read_metadata(tmp_path / "absent.toml")
