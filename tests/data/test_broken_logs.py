"""Broken logs: what is repaired by which rule, and what is refused with which words."""

import numpy as np
import pytest
from sample_log import ROWS, TOML, edit_cell, fixture_rows

from muscle_bayes.data import HEADER, RunError

TIME, TEMPERATURE, SETPOINT, READING = 0, 1, 2, 8


def edit_cells(rows, column, cell):
    lines = fixture_rows()
    for row in rows:
        lines = edit_cell(lines, row, column, cell)
    return lines


def with_times(times):
    lines = fixture_rows(len(times))
    for row, time in enumerate(times, 2):
        lines = edit_cell(lines, row, TIME, f"{time:.3f}")
    return lines


def header_with(old, new):
    lines = fixture_rows()
    return [lines[0].replace(old, new), *lines[1:]]


GOOD = fixture_rows()
STAMPS = 100 + 0.03 * np.arange(ROWS)


def only(run):
    (repair,) = run.repairs
    return repair.rule, repair.count, repair.first_row


@pytest.mark.parametrize("cell", ["", "  ", "n/a", "nan", "inf", "-inf", "1e999", "--", "3O.1"])
def test_bad_temperature_holds_the_last(read, cell):
    run = read(edit_cells([20, 21], TEMPERATURE, cell))
    assert only(run) == ("bad cell", 2, 20)
    assert HEADER[TEMPERATURE] in run.repairs[0].note
    assert "held" in run.repairs[0].note
    assert len(run.table) == ROWS
    assert run.table["temperature_a"][18] == run.table["temperature_a"][17]


def test_bad_first_temperature_takes_the_next(read):
    run = read(edit_cells([2], TEMPERATURE, ""))
    assert only(run) == ("bad cell", 1, 2)
    assert run.table["temperature_a"][0] == 30.0


@pytest.mark.parametrize("cell", ["6553.5", "-300"])
def test_wild_temperature_holds_the_last(read, cell):
    run = read(edit_cells([50], TEMPERATURE, cell))
    assert only(run) == ("wild temperature", 1, 50)
    assert run.table["temperature_a"][48] == run.table["temperature_a"][47]


def test_bad_setpoint_holds_the_last(read):
    run = read(edit_cells([9], SETPOINT, "?"))
    assert only(run) == ("bad cell", 1, 9)
    assert (run.table["setpoint_a"] == 40).all()


def test_blank_setpoints_throughout_are_none(read):
    run = read(edit_cells(range(2, ROWS + 2), SETPOINT, ""))
    assert run.repairs == ()
    assert run.table["setpoint_a"].isna().all()


def test_temperature_b_may_be_blank_throughout_without_a_muscle(read):
    run = read(edit_cells(range(2, ROWS + 2), 4, ""))
    assert (run.table["temperature_b"] == 25).all()


@pytest.mark.parametrize("cell", ["", "x", "nan", "inf"])
@pytest.mark.parametrize("column", [TIME, READING])
def test_bad_time_or_position_drops_the_row(read, column, cell):
    run = read(edit_cells([30], column, cell))
    assert only(run) == ("bad cell", 1, 30)
    assert len(run.table) == ROWS - 1
    assert run.table["time"][27:30].tolist() == pytest.approx([0.81, 0.87, 0.90])


def test_dropped_first_row_leaves_the_load_in_place(read):
    run = read(edit_cells([2], READING, "x"))
    assert run.table["time"][0] == 0
    assert run.dropped_lead == pytest.approx(0.03)
    assert run.load_steps == pytest.approx((0.97,))
    assert run.table["load"][32] == 0.139
    assert run.table["load"][33] == 0.166


@pytest.mark.parametrize("end", ["\n", ""])
def test_last_row_cut_short_is_dropped(read, end):
    text = "\n".join(GOOD) + "\n103.030,37.7,40.0,0,2" + end
    run = read(content=text.encode())
    assert only(run) == ("cut row", 1, ROWS + 2)
    assert len(run.table) == ROWS


def test_last_number_cut_short_is_dropped(read):
    run = read(content=("\n".join([*GOOD, "103.030,37.7,40.0,0,25.0,25.0,1,1,50"])).encode())
    assert only(run) == ("cut row", 1, ROWS + 2)


def test_whole_last_row_without_line_end_is_kept(read):
    run = read(content="\n".join(GOOD).encode())
    assert run.repairs == ()
    assert len(run.table) == ROWS


def test_short_row_is_dropped(read):
    run = read([*GOOD[:10], "100.27,30.0,40.0", *GOOD[11:]])
    assert only(run) == ("short row", 1, 11)
    assert len(run.table) == ROWS - 1


def test_long_row_is_dropped(read):
    run = read([*GOOD[:10], GOOD[10] + ",7", *GOOD[11:]])
    assert only(run) == ("long row", 1, 11)
    assert len(run.table) == ROWS - 1


def test_blank_lines_are_no_rows_but_count_as_lines(read):
    lines = edit_cell([*GOOD[:5], "", "   ", *GOOD[5:]], 10, READING, "")
    run = read(lines)
    assert only(run) == ("bad cell", 1, 10)


@pytest.mark.parametrize("cell", ["1024", "-1", "65535", "511.5"])
def test_one_glitch_is_dropped(read, cell):
    run = read(edit_cells([40], READING, cell))
    assert only(run) == ("glitch", 1, 40)
    assert len(run.table) == ROWS - 1


def test_duplicate_time_keeps_the_first(read):
    run = read(edit_cells([12], TIME, "100.270"))
    assert only(run) == ("duplicate time", 1, 12)
    assert run.table["reading"][9:11].tolist() == [509, 501]


@pytest.mark.parametrize("shift", [0.5, -0.5])
def test_displaced_block_is_shifted_back(read, shift):
    times = STAMPS.copy()
    times[40:50] += shift
    run = read(with_times(times))
    assert only(run) == ("displaced block", 1, 52 if shift > 0 else 42)
    assert run.table["time"].to_numpy() == pytest.approx(STAMPS - 100, abs=1e-6)


def test_clock_set_back_goes_on_by_the_median(read):
    times = STAMPS.copy()
    times[60:] -= 0.4
    run = read(with_times(times))
    assert only(run) == ("clock set back", 1, 62)
    assert run.table["time"].to_numpy() == pytest.approx(STAMPS - 100, abs=1e-6)


def test_jitter_of_one_stamp_still_rises(read):
    times = STAMPS.copy()
    times[20] -= 0.035
    run = read(with_times(times))
    assert np.diff(run.table["time"]).min() > 0
    assert run.duration == pytest.approx(3.0)


def test_gap_is_reported_not_filled(read):
    times = STAMPS.copy()
    times[70:] += 5.0
    run = read(with_times(times))
    assert only(run) == ("gap", 1, 72)
    assert len(run.table) == ROWS
    assert run.gaps == [(pytest.approx(2.07), pytest.approx(7.1))]


def restarted():
    return with_times(np.concatenate([STAMPS[:50], STAMPS[:51] - 90]))


COLUMNS_TOML = """\
format = 1
protocol = "free"
origin = "measured"
[columns]
time = "t"
position = "angle"
position_unit = "rad"
load = "kg"
[fixture]
disc_radius = 0.05
[element_a]
kind = "none"
"""
REFUSED = {
    "empty file": ([], None, ["the log is empty"]),
    "header alone": (GOOD[:1], None, ["0 whole rows", "two rows or more"]),
    "one row": (GOOD[:2], None, ["1 whole rows"]),
    "no header": (GOOD[1:], None, ["row 1", "'Time (s)'", "not found", "[columns]"]),
    "missing column": (
        header_with("Setpoint B (C), ", ""),
        None,
        ["row 1", "'Setpoint B (C)'", "expected, not found", "Fix: name that column so, or write"],
    ),
    "shortened column": (
        header_with("Potentiometer Reading", "Pot"),
        None,
        ["Fix: rename 'Pot', or write [columns] with `muscle-bayes init stairs.csv --overwrite`."],
    ),
    "misspelt column": (header_with("(s)", "[s]"), None, ["'Time (s)'", "found 'Time [s]'"]),
    "duplicate column": (
        header_with("Setpoint B", "Setpoint A"),
        None,
        ["column 'Setpoint A (C)'", "found 2 times", "rename"],
    ),
    "semicolons": (
        [line.replace(",", ";") for line in GOOD],
        None,
        ["row 1", "separate the columns by commas"],
    ),
    "columns that the log lacks": (GOOD, COLUMNS_TOML, ["row 1", "column 't'", "[columns]"]),
    "log restarted": (restarted(), None, ["row 52", "'Time (s)'", "restarted", "of each part"]),
    "many glitches": (
        edit_cells([7, 30], READING, "2000"),
        None,
        ["row 7", "'Potentiometer Reading'", "2 rows", "position_unit"],
    ),
    "angles under a header of counts": (
        edit_cells(range(2, 103), READING, "0.5"),
        None,
        ["row 2", "no 10-bit count", "position_unit"],
    ),
    "many blank temperatures": (
        edit_cells(range(40, 50), TEMPERATURE, ""),
        None,
        ["row 40", "10 of 101 rows", "'Temperature A (C)'", "correct or cut the log"],
    ),
    "blank temperature of a muscle": (
        edit_cells(range(2, 103), TEMPERATURE, ""),
        None,
        ["row 2", "'Temperature A (C)'", "is a muscle", "give its temperatures"],
    ),
    "many bad positions": (
        edit_cells(range(5, 20), READING, "x"),
        None,
        ["row 5", "15 of 101 rows", "row dropped"],
    ),
    "no number in the time column": (
        edit_cells(range(2, 103), TIME, "now"),
        None,
        ["row 2", "101 of 101 rows", "'Time (s)'"],
    ),
    "many duplicate times": (
        edit_cells(range(10, 30), TIME, "100.240"),
        None,
        ["row 11", "duplicate time", "correct or cut"],
    ),
    "many long rows": (
        [GOOD[0], *(line + ",9" for line in GOOD[1:20]), *GOOD[20:]],
        None,
        ["row 2", "19 of 101 rows", "more than the header's 9 cells"],
    ),
    "faults of several kinds": (
        edit_cell(edit_cells([5, 6, 7], READING, "x"), 50, TEMPERATURE, "")[:90]
        + edit_cells([92, 93], TEMPERATURE, "")[90:],
        None,
        ["row 5", "6 of 101 rows", "'Potentiometer Reading'", "'Temperature A (C)'"],
    ),
    "negative load": (
        ["t,angle,kg", "0,0,0.1", "1,0,-0.1", "2,0,0.1"],
        COLUMNS_TOML,
        ["row 3", "column 'kg'", "-0.1 kg is negative", "0 kg or more"],
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_refused(read, kind):
    lines, toml, told = REFUSED[kind]
    with pytest.raises(RunError) as caught:
        read(lines, toml or TOML)
    for words in ["stairs.csv", "Fix: ", *told]:
        assert words in str(caught.value)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "the log is empty"),
        (b"\r\n\n\r", "the log is empty"),
        ("\n".join(GOOD).encode("utf-16"), "save it as UTF-8"),
        (b"\x00" * 500, "row 1"),
    ],
)
def test_refused_bytes(read, content, told):
    with pytest.raises(RunError, match=r"stairs\.csv") as caught:
        read(content=content)
    assert told in str(caught.value)
    assert "Fix: " in str(caught.value)


def test_power_loss_leaves_nul_bytes(read):
    run = read(content="\n".join(GOOD).encode() + b"\n" + b"\x00" * 100)
    assert only(run) == ("cut row", 1, ROWS + 2)
