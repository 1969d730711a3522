"""`muscle-bayes init` from outside: guessed from the log, asked only what the log cannot tell."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app
from muscle_bayes.data import read_run

TIME = np.arange(300) * 20
SWING = np.round(45.0 * np.exp(-TIME / 5000) * np.cos(TIME / 150), 3)


def newcomer(header: str = "Zeit (ms);Winkel (°)", rows: int = 300) -> str:
    """Semicolons, decimal commas, degrees and milliseconds."""
    lines = [f"{t},0;{x}".replace(".", ",") for t, x in zip(TIME[:rows], SWING, strict=False)]
    return "\n".join([header, *lines]) + "\n"


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "swing.csv"
    path.write_text(newcomer(), encoding="utf-8")
    return path


def init(*arguments, answers: str = ""):
    return CliRunner().invoke(app, ["init", *map(str, arguments)], input=answers)


def test_a_newcomer_answers_at_most_twice(log):
    result = init(log, "--ask", answers="arm 0.49 0.10\n")
    assert result.exit_code == 0, result.output
    assert result.output.count("[none]") == 1
    run = read_run(log)
    assert run.repairs == ()
    assert run.duration == pytest.approx(5.98)
    assert run.coordinate == pytest.approx(np.deg2rad(SWING), abs=1e-6)
    assert (run.metadata.element_a.mass, run.metadata.element_a.centre_distance) == (0.49, 0.10)


def test_the_unit_is_asked_where_the_log_says_none(log):
    log.write_text(newcomer("Zeit (ms);Winkel"))
    result = init(log, "--ask", answers="deg\nnone\n")
    assert result.exit_code == 0, result.output
    assert "Unit of 'Winkel'" in result.output
    assert read_run(log).unit == "deg"


def test_a_wrong_answer_is_asked_again(log):
    log.write_text(newcomer("Zeit (ms);Winkel"))
    result = init(log, "--ask", answers="bananas\ndeg\narm\nnone\n")
    assert result.exit_code == 0, result.output
    assert "is no unit of" in result.stderr
    assert "cannot be used on this rig" in result.stderr
    assert read_run(log).metadata.element_a.kind == "none"


def test_wrong_answers_come_to_an_end(log):
    log.write_text(newcomer("Zeit (ms);Winkel"))
    result = init(log, "--ask", answers="a\nb\nc\nd\n")
    assert result.exit_code == 2
    assert not log.with_suffix(".toml").exists()


def test_without_questions_options_are_named(log):
    log.write_text(newcomer("Zeit (ms);Winkel"))
    result = init(log)
    assert result.exit_code == 2
    assert "the log does not tell: Unit of 'Winkel'" in result.stderr
    assert "--position-unit" in result.stderr
    assert init(log, "--position-unit", "deg").exit_code == 0


def test_what_it_took_is_written_with_the_reason(log):
    assert init(log).exit_code == 0
    text = log.with_suffix(".toml").read_text()
    for line in ['separator = ";"', 'decimal = ","', 'time_unit = "ms"', 'position_unit = "°"']:
        assert line in text
    assert "# the log says so" in text
    assert "# stops =" in text


def test_milliseconds_with_decimals_are_asked_for(log):
    rows = [f"{33.3 * n:.1f},{x}" for n, x in enumerate(SWING)]
    log.write_text("\n".join(["time,angle_deg", *rows]))
    result = init(log, "--no-ask")
    assert result.exit_code == 2
    assert (
        "Unit of 'time', whose rows lie 33.3 apart (s, ms, us). Fix: give --time-unit"
        in result.stderr
    )
    assert init(log, "--no-ask", "--time-unit", "ms").exit_code == 0
    assert read_run(log).duration == pytest.approx(9.96, abs=0.01)


def test_a_slow_log_in_seconds_is_taken_as_such(log):
    rows = [f"{30.02 * n:.2f},{10 + 8 * np.sin(n / 60):.3f}" for n in range(300)]
    log.write_text("\n".join(["time,angle_deg", *rows]))
    assert init(log, "--no-ask").exit_code == 0
    assert (
        'time_unit = "s"  # ASSUMED: the log names no unit' in log.with_suffix(".toml").read_text()
    )


def test_json_of_what_it_found(log, tmp_path):
    assert init(log, "--json", tmp_path / "facts.json").exit_code == 0
    facts = json.loads((tmp_path / "facts.json").read_text())
    assert facts["log"] == {"separator": ";", "decimal": ","}
    assert [column["likely"] for column in facts["columns"]] == ["time", "position"]
    assert facts["rows"] == 300
    assert 'time = "Zeit (ms)"' in facts["toml"]


def test_metadata_are_not_replaced_unasked(log):
    log.with_suffix(".toml").write_text("mine")
    result = init(log)
    assert result.exit_code == 2
    assert "exists" in result.stderr
    assert log.with_suffix(".toml").read_text() == "mine"
    assert init(log, "--overwrite").exit_code == 0
    assert init(log, "--out", log.with_name("other.toml")).exit_code == 0


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "the log is empty"),
        (b"no numbers here\nnone at all\n", "no row"),
        (b"\x00\x01\x02" * 40, "UTF-16"),
    ],
)
def test_no_log(log, content, told):
    log.write_bytes(content)
    result = init(log)
    assert result.exit_code == 2
    assert told in result.stderr
    assert "Fix: " in result.stderr


def test_no_file(tmp_path):
    assert "no such file" in init(tmp_path / "absent.csv").stderr
    assert "is metadata, not a log" in init(tmp_path / "a.toml").stderr


def test_a_log_that_is_guessed_but_not_read_says_why(log):
    lines = newcomer().splitlines()
    lines[100:] = [lines[50]] * 200
    log.write_text("\n".join(lines))
    result = init(log)
    assert result.exit_code == 2
    assert "Traceback" not in result.output
    assert "time stamp of the row before" in result.stderr
    assert "Fix: edit" in result.stdout
    assert log.with_suffix(".toml").exists()


@pytest.mark.parametrize("unit", [["--position-unit", "kg"], ["--time-unit", "parsec"]])
def test_a_wrong_unit_leaves_nothing_behind(log, unit):
    log.write_text(newcomer("Zeit;Winkel"))
    right = {"--position-unit": "deg", "--time-unit": "ms"}
    wrong = init(
        log, "--no-ask", *(word for pair in (right | {unit[0]: unit[1]}).items() for word in pair)
    )
    assert wrong.exit_code == 2
    assert not log.with_suffix(".toml").exists()
    assert init(log, "--no-ask", *(word for pair in right.items() for word in pair)).exit_code == 0


OPTIONS = {
    "time": (["--time", "9"], "--time 9: there is no such column"),
    "unit": (["--position-unit", "kg"], "--position-unit kg: is no unit of counts"),
    "element": (["--element", "muscle"], "--element 'muscle': cannot be used"),
    "load": (["--load", "0.2"], "needs the radius at which it pulls"),
}


@pytest.mark.parametrize("kind", OPTIONS)
def test_options_that_cannot_be(log, kind):
    options, told = OPTIONS[kind]
    result = init(log, *options)
    assert result.exit_code == 2
    assert told in result.stderr
    assert "Fix: " in result.stderr


RIGS = {
    "spring": ("s;x (mm)", ["--element", "spring", "--load", "0.791"], "straight"),
    "muscle": ("s;x (mm)", ["--element", "muscle 0.12", "--load", "0.2"], "straight"),
    "torsion": ("s;phi (rad)", ["--element", "spring"], "torsion"),
    "drum": ("s;phi (rad)", ["--element", "muscle 0.12 0.003"], "drum"),
}


@pytest.mark.parametrize("kind", RIGS)
def test_elements(log, kind):
    header, options, linkage = RIGS[kind]
    text = newcomer(header).replace(",0;", ";")
    log.write_text(text if "mm" in header else text.replace(",", "."))
    result = init(log, "--time-unit", "ms", *options)
    metadata = log.with_suffix(".toml").read_text()
    assert f'linkage = "{linkage}"' in metadata, result.output
    assert 'accept_units = ["time"]' in metadata


COLUMNS = "t,x (deg),muscle_c,room_c,torque (N*cm),spare"


def test_other_columns_are_taken_by_name_and_unit(log):
    rows = [f"{t / 1000},{x},{30 + t / 1e3:.2f},22,1,7" for t, x in zip(TIME, SWING, strict=True)]
    log.write_text("\n".join([COLUMNS, *rows]))
    assert init(log).exit_code == 0
    columns = read_run(log).metadata.columns
    assert (columns.temperature_a, columns.temperature_b) == ("muscle_c", "room_c")
    assert (columns.applied, columns.applied_unit) == ("torque (N*cm)", "N*cm")
    assert columns.load is None


def test_rate_from_the_text_above(log):
    log.write_text("Rig 3\nSample rate: 50 Hz\n" + "\n".join(f"{x}" for x in SWING))
    assert init(log, "--position-unit", "deg").exit_code == 0
    assert read_run(log).duration == pytest.approx(5.98)


def test_raw_counts_are_asked_for_their_scale(log):
    counts = np.rint(2048 + SWING * 10).astype(int)
    log.write_text("ms,adc\n" + "".join(f"{t},{n}\n" for t, n in zip(TIME, counts, strict=True)))
    result = init(log, "--position", "adc", "--ask", answers="counts\n0.0017\n2048\nnone\n")
    assert result.exit_code == 0, result.output
    run = read_run(log)
    assert run.metadata.potentiometer.bits == 12
    assert run.duration == pytest.approx(5.98)
    assert run.coordinate[0] == pytest.approx(450 * 0.0017)
    assert "--radians-per-count" in init(log, "--position-unit", "counts", "--overwrite").stderr


def test_a_unit_at_the_end_of_any_name(log):
    rows = [f"{t / 1000},{x}" for t, x in zip(TIME, SWING, strict=True)]
    log.write_text("\n".join(["time,laser_um", *rows]))
    assert init(log, "--no-ask").exit_code == 0
    assert read_run(log).unit == "um"


DRIVEN = {
    "motor's voltage": ("u_volt", [], ("applied", "u_volt", "applied_unit", "volt")),
    "motor's current": ("current", [], ("applied", "current", "applied_unit", "A")),
    "heated wire": (
        "I (mA)",
        ["--element", "muscle 0.12 0.01"],
        ("power_a", "I (mA)", "power_unit", "mA"),
    ),
}


@pytest.mark.parametrize("kind", DRIVEN)
def test_what_drives_is_taken(log, kind):
    name, options, (key, value, unit_key, unit) = DRIVEN[kind]
    rows = [f"{t / 1000},{x},{0.01 * x},5" for t, x in zip(TIME, SWING, strict=True)]
    log.write_text("\n".join([f"t,phi_deg,{name},battery_volt", *rows]))
    result = init(log, "--no-ask", *options)
    assert result.exit_code == 0, result.output
    columns = read_run(log).metadata.columns
    assert (getattr(columns, key), getattr(columns, unit_key)) == (value, unit)
    assert "# not used: 'battery_volt', 5 to 5" in log.with_suffix(".toml").read_text()


@pytest.mark.parametrize("lowest", [0, -(2**15)])
def test_an_encoder_that_wraps(log, lowest):
    ticks = np.arange(900) * 100
    wrapped = (ticks - lowest) % 2**16 + lowest
    rows = [f"{n / 100},{count}" for n, count in enumerate(wrapped)]
    log.write_text("\n".join(["time,count", *rows]))
    scale = ["--position-unit", "counts", "--radians-per-count", "0.001", "--zero-reading", "0"]
    result = init(log, "--no-ask", *scale)
    assert result.exit_code == 0, result.output
    run = read_run(log)
    assert run.coordinate == pytest.approx(0.001 * ticks)
    assert [repair.rule for repair in run.repairs] == ["wrapped counter"]


WRITTEN = {
    "date and time of day": (
        "Date;Time;Angle (deg)",
        lambda t, x: f"2024-05-01;10:00:{t:06.3f};{x:.2f}",
    ),
    "German date": ("Datum;Zeit;Winkel [°]", lambda t, x: f"01.05.2024;10:00:{t:06.3f};{x:.2f}"),
    "separator at the end": ("t_s,angle_deg,", lambda t, x: f"{t:.3f},{x:.2f},"),
    "columns of text": ("time,note,angle_deg", lambda t, x: f"{t:.3f},,{x:.2f}"),
}


@pytest.mark.parametrize("kind", WRITTEN)
def test_other_ways_to_write_rows(log, kind):
    header, row = WRITTEN[kind]
    rows = [row(t / 1000, x) for t, x in zip(TIME, SWING, strict=True)]
    log.write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    result = init(log, "--no-ask")
    assert result.exit_code == 0, result.output
    run = read_run(log)
    assert run.repairs == ()
    assert run.coordinate == pytest.approx(np.deg2rad(SWING), abs=1e-4)
    assert run.duration == pytest.approx(5.98)


def test_a_line_that_is_no_row_is_shown(log):
    log.write_text("".join(f"{t}, {x}°\n" for t, x in zip(TIME, SWING, strict=True)))
    result = init(log, "--no-ask")
    assert result.exit_code == 2
    assert "the last line is '5980, " in result.stderr
    assert "Fix: " in result.stderr


def test_of_two_voltages_neither_is_taken(log):
    rows = [f"{t},{x},{x / 2}" for t, x in zip(TIME, SWING, strict=True)]
    log.write_text("\n".join(["Time,Channel A,Channel B", "(ms),(mV),(V)", *rows]))
    result = init(log, "--no-ask")
    assert "'Channel A', 'Channel B'" in result.stderr


CELLS = {
    "tensile test": ("t_s,crosshead_mm,cell_g", [], ("imposed", "cell_g", "gf")),
    "load cell under a changing load": ("t_s,x_mm,load_kg", [], ("imposed", "load_kg", "kgf")),
    "held": ("t_s,Volume,Force [N]", ["--position", "none"], ("imposed", "Force [N]", "N")),
}


@pytest.mark.parametrize("kind", CELLS)
def test_a_load_cell_shows_the_elements_tension(log, kind):
    header, options, told = CELLS[kind]
    rows = [f"{t / 1000},{x},{2 + 0.01 * x:.4f}" for t, x in zip(TIME, SWING, strict=True)]
    log.write_text("\n".join([header, *rows]))
    result = init(log, "--no-ask", "--element", "spring", *options)
    assert result.exit_code == 0, result.output
    about = read_run(log).metadata
    assert (about.protocol, about.columns.force, about.columns.force_unit) == told


def test_a_number_of_the_row_is_no_time(log):
    rows = [f"{n},{u},{x}" for n, (u, x) in enumerate(zip(TIME % 3, SWING, strict=True))]
    log.write_text("\n".join(["Sample,U_cmd [V],LVDT [um]", *rows]))
    assert "--sample-rate" in init(log, "--no-ask").stderr
    assert init(log, "--no-ask", "--sample-rate", "50").exit_code == 0
    run = read_run(log)
    assert run.duration == pytest.approx(5.98)
    assert (run.metadata.columns.applied, run.metadata.columns.applied_unit) == ("U_cmd [V]", "V")


def test_a_heater_and_a_thermometer_beside_it(log):
    rows = [
        f"{t / 1000},{x},{n % 2},30.5" for n, (t, x) in enumerate(zip(TIME, SWING, strict=True))
    ]
    log.write_text("\n".join(["t_s,Force_N,heater_W,TC_C", *rows]))
    assert "none: held" in init(log, "--no-ask").stderr
    options = ["--position", "none", "--element", "muscle 0.1"]
    assert init(log, "--no-ask", *options).exit_code == 0
    columns = read_run(log).metadata.columns
    assert (columns.power_a, columns.power_unit) == ("heater_W", "W")
    assert (columns.temperature_a, columns.force) == ("TC_C", "Force_N")
