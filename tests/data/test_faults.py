"""Kinds of broken log and metadata: each has its repair, or the message that names its true cause."""

import numpy as np
import pytest
from swing_log import HEAT, ROWS, SWING, TIME, csv, toml

from muscle_bayes.data import RunError

HOT = toml('temperature_a = "T"')
GRAMS = toml('load = "kg"').replace("[element_a]", "[fixture]\ndisc_radius = 0.05\n[element_a]")


def with_heat(*changes, rows=None, values=HEAT, name="T"):
    """The log with a temperature column; `changes` are rows and the value there."""
    heat = np.array(values)
    for row, value in changes:
        heat[row] = value
    return csv(f"t,x,{name}", TIME, SWING, heat)


def with_cells(rows, cell, column=1, text=None):
    """The log with one cell of some rows changed."""
    lines = (csv() if text is None else text).splitlines()
    for row in rows:
        cells = lines[row].split(",")
        cells[column] = cell
        lines[row] = ",".join(cells)
    return "\n".join(lines) + "\n"


def moved(start, shift):
    times = TIME.copy()
    times[start:] += shift
    return csv(times=times)


def jump(row, value):
    swing = SWING.copy()
    swing[row] = value
    return csv(positions=swing)


LINEAR = (
    toml()
    .replace("[element_a]", '[fixture]\nmotion = "linear"\n[element_a]')
    .replace('"arm"\nmass = 0.3\ncentre_distance = 0.2', '"none"')
    .replace('"rad"', '"m"')
)
PINS = 'kind = "spring"\n[fixture]\nrotor_radius_a = 0.03\nanchor_x_a = 0.03\nanchor_y_a = 0.1\n'
FROZEN = np.where((TIME > 1.0) & (TIME < 3.0), HEAT[50], HEAT)

REPAIRED = {
    "a short row": (with_cells([40], "1").replace("0.780,1", "0.780"), toml(), "short row", 1),
    "a long row": (with_cells([40], "0.5,7"), toml(), "long row", 1),
    "a blank position": (with_cells([40], ""), toml(), "bad cell", 1),
    "a word for a position": (with_cells([40], "n/a"), toml(), "bad cell", 1),
    "an infinite position": (with_cells([40], "-inf"), toml(), "bad cell", 1),
    "a position beyond measure": (with_cells([40], "9e99"), toml(), "bad cell", 1),
    "digits grouped by underscores": (with_cells([40], "1_0"), toml(), "bad cell", 1),
    "a blank time": (with_cells([40], "", 0), toml(), "bad cell", 1),
    "a time stamp twice": (with_cells([40], "0.760", 0), toml(), "duplicate time", 1),
    "a clock set back": (moved(100, -0.5), toml(), "clock set back", 1),
    "a gap": (moved(100, 5.0), toml(), "gap", 1),
    "a last row cut short": (csv() + "4.000", toml(), "cut row", 1),
    "zero bytes at the end": (csv() + "\0" * 99, toml(), "cut row", 1),
    "bytes that are no UTF-8": (csv("t,x,°").replace(",0.8000", ",0.8000", 1)
                                .replace("\n", ",0\n").replace(",°,0", ",°", 1)
                                .encode("latin-1"), toml(), "encoding", 1),
    "an open quote": (with_cells([40], '"0.5'), toml(), "broken quote", 1),
    "lines of comment": ("# a\n" + csv(), toml(), "comment", 1),
    "rows of blanks": (csv() + ",\n,\n", toml(), "blank row", 2),
    "the header again": (csv().replace("\n1.000", "\nt,x\n1.000"), toml(), "repeated header", 1),
    "a counter that wraps": (csv(times=(TIME * 1e3 + 64000) % 65536), toml('time_unit = "ms"'),
                             "wrapped counter", 1),
    "midnight": (csv(times=[f"{'23:59' if t < 2 else '00:00'}:{(t + 58) % 60:06.3f}" for t in TIME]),
                 toml(), "wrapped counter", 1),
    "a thermocouple at -1": (with_heat((90, -1.0), (150, -1.0)), HOT, "impossible jump", 2),
    "a thermocouple at 0": (with_heat((90, 0.0)), HOT, "impossible jump", 1),
    "a thermometer at 85": (with_heat((90, 85.0)), HOT, "impossible jump", 1),
    "a thermometer at -127": (with_heat((90, -127.0)), HOT, "wild temperature", 1),
    "an open thermocouple": (with_heat((90, 6553.5)), HOT, "wild temperature", 1),
    "two failed readings in a row": (with_heat((90, 0.0), (91, 0.0)), HOT, "impossible jump", 2),
    "a frozen thermometer": (with_heat(values=FROZEN), HOT, "frozen", 99),
    "a blank temperature": (with_cells([40], "", 2, with_heat()), HOT, "bad cell", 1),
    "a slower thermometer": (csv("t,x,T", TIME, SWING, [f"{h:.2f}" if i % 10 == 0 else ""
                             for i, h in enumerate(HEAT)]), HOT, "slower sensor", 1),
    "a position lost for some time": (csv(positions=np.where((TIME > 1) & (TIME < 1.19), -9.0, SWING)),
                                      toml(), "impossible jump", 9),
    "a position that jumps": (jump(60, 2.5), toml(), "impossible jump", 1),
}  # fmt: skip


@pytest.mark.parametrize("kind", REPAIRED)
def test_is_repaired_and_said(read, kind):
    content, metadata, rule, count = REPAIRED[kind]
    content = content if isinstance(content, bytes) else content.encode()
    run = read(content=content, toml=metadata)
    (repair,) = run.repairs
    assert (repair.rule, repair.count) == (rule, count)
    assert len(run.table) >= ROWS - 9
    assert np.diff(run.table["time"]).min() > 0
    assert np.abs(run.coordinate).max() <= 0.8
    assert run.table["temperature_a"].between(20, 60).all()


REFUSED = {
    "an Excel workbook": (b"PK\x03\x04" + b"\0" * 99, toml(), ["Excel workbook", "save the log as CSV"]),
    "a gzip archive": (b"\x1f\x8b" + b"\0" * 99, toml(), ["gzip archive"]),
    "the newest row first": (csv(times=TIME[::-1]), toml(), ["newest row is first", "sort"]),
    "rows in quotes": ("\n".join(f'"{line}"' for line in csv().splitlines()), toml(),
                       ["stands in quotes as one cell"]),
    "a twelve-hour clock": (csv(times=[f"1:00:{t:06.3f} PM" for t in TIME]), toml(),
                            ["twelve-hour clock", "%I:%M:%S %p"]),
    "a colon before the fraction": (csv(times=[f"01:00:{int(t):02d}:{t % 1:.3f}".replace(":0.", ":")
                                    for t in TIME]), toml(), ["colon before the fraction"]),
    "nothing": ("", toml(), ["the log is empty"]),
    "comments only": ("# a\n# b\n", toml(), ["holds comments only", "log.comment"]),
    "one row": (csv()[:14], toml(), ["whole rows", "two rows or more"]),
    "UTF-16 that nobody stated": (csv().encode("utf-16"), toml(), ["UTF-16", 'encoding = "utf-16"']),
    "UTF-16 without a mark": (csv().encode("utf-16-le"), toml(), ["UTF-16"]),
    "another encoding than stated": (
        csv("t,x,\xff").encode("latin-1"), toml(log='encoding = "utf-8"'),
        ["not utf-8 text", "log.encoding"],
    ),
    "semicolons": (csv("t;x", separator=";"), toml(), ["separated by ';'", 'separator = ";"']),
    "tabs": (csv("t\tx", separator="\t"), toml(), ["separated by 'tab'", 'separator = "tab"']),
    "blanks": (csv("t x", separator=" "), toml(), ['separator = "space"']),
    "decimal commas": (
        csv("t;x", separator=";", decimal=","), toml(log='separator = ";"'),
        ["row 2", "'0,000'", "decimal comma", 'decimal = ","'],
    ),
    "decimal points where commas are stated": (
        csv("t;x", separator=";"), toml(log='separator = ";"\ndecimal = ","'),
        ["'0.000'", "decimal point", 'remove decimal = ","'],
    ),
    "commas for both": (csv(decimal=","), toml(), ["separates columns and is the decimal sign"]),
    "commas between thousands": (
        csv(times=[f'"1,{t:07.3f}"' for t in TIME + 200]), toml(), ['thousands = ","'],
    ),
    "blanks between thousands": (
        csv(times=[f"1 {t:07.3f}" for t in TIME + 200]), toml(), ["sign between thousands"],
    ),
    "units behind numbers": (
        csv(positions=[f"{x} rad" for x in SWING]), toml(), ["carry a unit behind the number"],
    ),
    "hexadecimal counts": (
        csv(positions=[hex(i) for i in range(ROWS)]), toml(), ["hexadecimal"],
    ),
    "dates of a pattern that is not stated": (
        csv(times=[f"14/04/2021 13:10:{t:06.3f}" for t in TIME]), toml(), ["dates", "time_format"],
    ),
    "times of day in the position": (
        csv(positions=[f"00:00:{t:06.3f}" for t in TIME]), toml(), ["are times of day"],
    ),
    "a title line": ("Rig 3\n" + csv(), toml(), ["header stands in row 2", "skip_lines = 1"]),
    "no header": (csv(""), toml(), ["has no header", "header = false", "by number"]),
    "names without a header": (
        csv(""), toml(log="header = false"), ["columns.time", "is a name", "column's number"],
    ),
    "a number beyond the columns": (
        csv(), toml(position="9"), ["column 9", "no such column", "the log has 2"],
    ),
    "a name that is not there": (csv("t,y"), toml(), ["'x'", "not found", "[columns]"]),
    "a name twice": (csv("t,x,x", TIME, SWING, SWING), toml(), ["found 2 times", "column's number"]),
    "a header longer than the rows": (csv("t,x,y"), toml(), ["header has 3 cells", "rows have 2"]),
    "a header shorter than the rows": (
        csv("t,x", TIME, SWING, SWING), toml(), ["header has 2 cells", "rows have 3"],
    ),
    "a column added midway": (
        csv().replace("\n1.000,", "\n9,1.000,").split("\n1.020")[0]
        + "".join(f"\n9,{t:.3f},{x}" for t, x in zip(TIME[51:], SWING[51:], strict=True)),
        toml(), ["columns change here", "added", "run of each part"],
    ),
    "many rows cut": (with_cells(range(20, 40), "1").replace(",1\n", "\n"), toml(),
                      ["rows are faulty", "short row"]),
    "bursts": (csv(times=np.tile([0.0, 1e-5], ROWS // 2), digits=6), toml(),
               ["does not rise", "sample_rate"]),
    "time stamps of whole seconds": (csv(times=np.floor(TIME)), toml(),
                                     ["time stamp of the row before", "sample_rate"]),
    "a log that was restarted": (csv(times=np.r_[TIME[:100] + 50, TIME[:100]]), toml(),
                                 ["restarted there", "run of each part"]),
    "neither time nor rate": (csv(), toml().replace('time = "t"\n', ""),
                              ["columns.time", "log.sample_rate"]),
    "milliseconds by name": (csv("time_ms,x", TIME * 1e3), toml(time='"time_ms"'),
                             ["says ms", 'time_unit = "ms"']),
    "milliseconds in brackets": (csv("t [ms],x", TIME * 1e3), toml(), ["says ms"]),
    "milliseconds in a units row": (csv(times=TIME * 1e3).replace("\n", "\n(ms),(rad)\n", 1), toml(),
                                    ["units row (ms)"]),
    "milliseconds without a word": (csv(times=TIME * 1e3), toml(), ["as milliseconds do",
                                                                    "time_unit"]),
    "epoch in milliseconds": (csv(times=TIME * 1e3 + 1.6e12), toml(), ["ms since 1970"]),
    "days": (csv(times=TIME / 864000, digits=12), toml(), ["as hours or days do"]),
    "degrees by name": (csv("t,x_deg"), toml(position='"x_deg"'), ["says deg", "position_unit"]),
    "degrees in brackets": (csv("t,x (deg)"), toml(), ["says deg", "position_unit says rad"]),
    "degrees without a word": (csv(positions=SWING * 57.3), toml(), ["swings to and fro"]),
    "speeds as angles": (csv("t,x (rad/s)"), toml(), ["says rad/s", "position_unit says rad"]),
    "volts in a units row": (csv().replace("\n", "\n(s),(V)\n", 1), toml(), ["says V"]),
    "millimetres as metres": (csv(positions=SWING * 1e3), LINEAR, ["moves by", "position_unit"]),
    "pins that turn over and over": (
        csv(positions=SWING * 57.3),
        toml().replace('kind = "arm"\nmass = 0.3\ncentre_distance = 0.2\n', PINS),
        ["linked by pins", "position_unit"],
    ),
    "degrees Fahrenheit": (with_heat(values=HEAT * 1.8 + 32), HOT, ["degrees F",
                                                                    "temperature_unit"]),
    "kelvin": (with_heat(values=HEAT + 273.15), HOT, ["kelvin fit", "temperature_unit"]),
    "Fahrenheit by name": (with_heat(name="T (F)"), HOT, ["says F", 'temperature_unit = "F"']),
    "grams": (csv("t,x,kg", TIME, SWING, [139.0] * ROWS), GRAMS, ["grams fit", "load_unit"]),
    "grams in the table": (csv(), GRAMS.replace('load = "kg"', "")
                           + "[load]\ntime = [0.0]\nmass = [139.0]\n", ["load.mass", 'unit = "g"']),
    "a torque beyond measure": (csv("t,x,f", TIME, SWING, [2e4] * ROWS), toml('applied = "f"'),
                                ["more than such rigs", "applied_unit"]),
    "a negative load": (csv("t,x,kg", TIME, SWING, [-0.1] * ROWS), GRAMS, ["is negative"]),
    "readings beyond the stops": (
        csv(), toml().replace("[element_a]", "[fixture]\nstops = [-0.3, 0.3]\n[element_a]"),
        ["row 2", "beyond the endstops", "fixture.stops", "remove it"],
    ),
    "counts beyond the converter": (
        csv(positions=[str(i * 20) for i in range(ROWS)]),
        toml().replace('"rad"', '"counts"')
        + "[potentiometer]\nzero_reading = 512.0\nradians_per_count = 0.005\n",
        ["no 10-bit count", "potentiometer.bits"],
    ),
    "a unit that is none": (csv(), toml().replace('"rad"', '"furlong"'), ["position_unit"]),
    "a unit that two countries read differently": (
        csv(), toml().replace('"rad"', '"grad"'), ["'grad' is no unit", "rad, mrad, deg"],
    ),
    "a unit of another kind": (csv(), toml('time_unit = "mm"'), ["time_unit", "no unit of time"]),
    "a torque in newtons": (csv("t,x,f", TIME, SWING, SWING),
                            toml('applied = "f"\napplied_unit = "N"'), ["applied_unit", "N*m"]),
    "a separator of two signs": (csv(), toml(log='separator = "ab"'), ["not one character"]),
    "thousands like decimals": (csv(), toml(log='decimal = ","\nthousands = ","'),
                                ["decimal sign too"]),
    "an encoding that is none": (csv(), toml(log='encoding = "rot13"'), ["not known", "utf-16"]),
    "a time format that is none": (csv(), toml(log='time_format = "clock"'), ["hms, iso"]),
    "a rate of zero": (csv(), toml(log="sample_rate = 0.0"), ["sample_rate", "greater than 0"]),
    "a column without a name": (csv(), toml(position='""'), ["columns.position",
                                                             "names no column"]),
    "a spring with two zeros": (
        csv(), toml().replace('"arm"\nmass = 0.3\ncentre_distance = 0.2', '"spring"\n'
        'linkage = "drum"\ndrum_radius = 0.01\nlength_at_zero = 0.1\nfree_length = 0.05\n'
        "tension_at_zero = 1.0"), ["free_length", "together with tension_at_zero"],
    ),
    "a torsion spring with a length": (
        csv(), toml().replace('"arm"\nmass = 0.3\ncentre_distance = 0.2', '"spring"\n'
        'linkage = "torsion"\nfree_length = 0.05'), ["no length", "tension_at_zero"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", REFUSED)
def test_is_refused_with_its_true_cause(read, kind):
    content, metadata, told = REFUSED[kind]
    content = content if isinstance(content, bytes) else content.encode()
    with pytest.raises(RunError) as caught:
        read(content=content, toml=metadata)
    for words in ["stairs.", "Fix: ", *told]:
        assert words in str(caught.value)


def test_sixty_kinds_and_more():
    assert len(REPAIRED) + len(REFUSED) >= 60


ACCEPTED = {
    "milliseconds by name, that are seconds": (
        csv("time_ms,x"), toml('time_unit = "s"\naccept_units = ["time"]', time='"time_ms"'),
    ),
    "a slow log in whole seconds": (csv(times=TIME * 500), toml('time_unit = "s"')),
    "a rig that stays hot": (with_heat(values=HEAT + 40), HOT.replace(
        '"T"', '"T"\ntemperature_unit = "degC"')),
    "a wide swing": (csv(positions=SWING * 57.3), toml('accept_units = ["position"]')),
    "heavy loads": (csv("t,x,kg", TIME, SWING, [139.0] * ROWS), GRAMS.replace(
        '"kg"', '"kg"\nload_unit = "kg"')),
}  # fmt: skip


@pytest.mark.parametrize("kind", ACCEPTED)
def test_what_is_odd_and_stated_is_read(read, kind):
    content, metadata = ACCEPTED[kind]
    assert len(read(content=content.encode(), toml=metadata).table) == ROWS
