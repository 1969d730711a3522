"""Layouts of logs that keys of [log] describe, or that are read as they are."""

import numpy as np
import pytest
from swing_log import ROWS, SWING, TIME, csv, toml

from muscle_bayes.data import RunError

LAYOUTS = {
    "semicolons and decimal commas": (
        csv("t;x", separator=";", decimal=","),
        toml(log='separator = ";"\ndecimal = ","'),
    ),
    "tabs": (csv("t\tx", separator="\t"), toml(log='separator = "tab"')),
    "blanks": (csv("t x", separator="   "), toml(log='separator = "space"')),
    "bars": (csv("t|x", separator="|"), toml(log='separator = "|"')),
    "comma for both": (csv(decimal=","), toml(log='separator = ","\ndecimal = ","')),
    "thousands": (
        csv(times=[f'"1,{t:07.3f}"' for t in TIME + 200]),
        toml(log='thousands = ","'),
    ),
    "lines to skip": ("Rig 3\nby hand\n" + csv(), toml(log="skip_lines = 2")),
    "no header": (csv(""), toml(log="header = false", time="1", position="2")),
    "no header, by number, others between": (
        "".join(f"7,{line}\n" for line in csv("").splitlines()),
        toml(log="header = false", time="2", position="3"),
    ),
    "columns by number below a header": (csv("a,b"), toml(time="1", position="2")),
    "no time column": (
        "\n".join(["x", *(f"{x:.5f}" for x in SWING)]),
        toml(log="sample_rate = 50.0").replace('time = "t"\n', ""),
    ),
    "sep line": ("sep=;\n" + csv("t;x", separator=";"), toml()),
    "quoted sep line": ('"sep=;"\n' + csv("t;x", separator=";"), toml()),
    "comments before and between": (
        "# rig 3\n#\n" + csv().replace("\n0.100", "\n# poked\n0.100"),
        toml(),
    ),
    "other comments": ("% rig 3\n" + csv(), toml(log='comment = "%"')),
    "header in a comment": ("# t,x\n" + csv(""), toml()),
    "byte order mark": ("\ufeff" + csv(), toml()),
    "comma in a header's name": (
        csv('t,"torque, request",x', TIME, np.zeros(ROWS), [f"{x:.5f}" for x in SWING]),
        toml(),
    ),
    "unit behind a comma in the name": (csv('"t, s",x'), toml()),
    "quoted cells": (
        "\n".join(f'"{a}" , "{b}"' for a, b in (line.split(",") for line in csv().splitlines())),
        toml(),
    ),
    "comma behind each row": (csv().replace("\n", ",\n"), toml()),
    "comma behind each row, not the header": (
        csv().replace("\n", ",\n").replace(",\n", "\n", 1),
        toml(),
    ),
    "rows of blanks at the end": (csv() + ",\n" * 50, toml()),
    "units row": (csv().replace("\n", "\n(s),(rad)\n", 1), toml()),
    "bare units row": (csv().replace("\n", "\ns,rad\n", 1), toml()),
    "header repeated midway": (csv().replace("\n1.000", "\nt,x\n1.000"), toml()),
    "exponents": (csv(times=[f"{t:.6e}" for t in TIME]), toml()),
    "Fortran's exponents": (csv(times=[f"{t:.6e}".replace("e", "D") for t in TIME]), toml()),
    "hours, minutes, seconds": (csv(times=[f"00:00:{t:06.3f}" for t in TIME]), toml()),
    "minutes and seconds": (csv(times=[f"03:{t:06.3f}" for t in TIME]), toml()),
    "dates": (csv(times=[f"2021-04-14 13:10:{t:06.3f}" for t in TIME]), toml()),
    "dates with a zone": (csv(times=[f"2021-04-14T13:10:{t:06.3f}+02:00" for t in TIME]), toml()),
    "dates of a stated pattern": (
        csv(times=[f"14.04.2021 13:10:{t:09.6f}" for t in TIME]),
        toml(log='time_format = "%d.%m.%Y %H:%M:%S.%f"'),
    ),
    "a header broken inside quotes": ('"t",x,"a\nb"\n' + csv("", TIME, SWING, TIME), toml()),
    "typographic minus signs": (csv().replace("-", "\u2212"), toml()),
    "colon before the fraction": (
        csv(times=[f"01:00:{int(t):02d}:{t % 1:.3f}".replace(":0.", ":") for t in TIME]),
        toml(log='time_format = "%H:%M:%S:%f"'),
    ),
    "milliseconds": (csv(times=TIME * 1e3), toml('time_unit = "ms"')),
    "microseconds": (csv(times=TIME * 1e6), toml('time_unit = "us"')),
    "minutes": (csv(times=TIME / 60, digits=9), toml('time_unit = "min"')),
    "epoch in s": (csv(times=TIME + 1595900000), toml()),
    "epoch in ms": (csv(times=TIME * 1e3 + 1595900000000), toml('time_unit = "ms"')),
    "epoch in us": (csv(times=TIME * 1e6 + 1595900000000000, digits=0), toml('time_unit = "us"')),
    "16 bits of ms": (csv(times=(TIME * 1e3 + 64000) % 65536), toml('time_unit = "ms"')),
    "16 bits of ms in s": (csv(times=((TIME * 1e3 + 64000) % 65536) / 1e3), toml()),
    "32 bits of ms": (csv(times=(TIME * 1e3 + 2**32 - 999) % 2**32), toml('time_unit = "ms"')),
    "32 bits of us": (csv(times=(TIME * 1e6 + 2**32 - 999) % 2**32), toml('time_unit = "us"')),
    "midnight": (
        csv(times=[("23:59:" if t < 2 else "00:00:") + f"{(t + 58) % 60:06.3f}" for t in TIME]),
        toml(),
    ),
}
"""What a log may look like: all hold the same swing."""


@pytest.mark.parametrize("kind", LAYOUTS)
def test_is_read_to_the_same_swing(read, kind):
    text, metadata = LAYOUTS[kind]
    run = read(content=text.encode(), toml=metadata)
    assert run.table["time"].to_numpy() == pytest.approx(TIME, abs=2e-6)
    assert run.coordinate == pytest.approx(SWING)
    assert not {"bad cell", "short row", "long row", "cut row"} & {r.rule for r in run.repairs}


@pytest.mark.parametrize("encoding", ["utf-16", "cp1252", "utf-8", "utf-16-le"])
def test_stated_encodings(read, encoding):
    text = csv("t,µ").encode(encoding)
    metadata = toml(log=f'encoding = "{encoding}"', position='"µ"')
    assert read(content=text, toml=metadata).coordinate == pytest.approx(SWING)


@pytest.mark.parametrize(
    ("text", "rules"),
    [
        ("# one\n# two\n" + csv(), ["comment"]),
        (csv() + ",\n,\n", ["blank row"]),
        (csv().replace("\n1.000", "\nt,x\n1.000"), ["repeated header"]),
        (csv(times=((TIME * 1e3 + 64000) % 65536) / 1e3), ["wrapped counter"]),
        (csv().replace("\n1.000,", '\n1.000,"'), ["broken quote"]),
    ],
)
def test_what_was_left_out_is_said(read, text, rules):
    assert [repair.rule for repair in read(content=text.encode(), toml=toml()).repairs] == rules


def test_an_open_quote_spoils_its_own_row_only(read):
    text = csv().replace("\n1.000,", '\n1.000,"')
    assert len(read(content=text.encode(), toml=toml()).table) == ROWS - 1


def test_rows_that_are_left_out_keep_their_time_at_a_fixed_rate(read):
    lines = ["x,y", *(f"{x:.5f},1" for x in SWING)]
    lines[50] = "0.5"
    metadata = toml(log="sample_rate = 50.0").replace('time = "t"\n', "")
    run = read(content="\n".join(lines).encode(), toml=metadata)
    assert np.diff(run.table["time"]).max() == pytest.approx(0.04)
    assert run.duration == pytest.approx(TIME[-1])


def test_wrapped_more_than_once(read):
    times = (np.arange(ROWS) * 1000.0 + 60000) % 65536
    run = read(content=csv(times=times).encode(), toml=toml('time_unit = "ms"'))
    (repair,) = run.repairs
    assert (repair.rule, repair.count) == ("wrapped counter", 3)
    assert np.diff(run.table["time"]) == pytest.approx(1.0)


def test_a_column_added_midway_is_no_number_of_another(read):
    lines = csv("t,x").splitlines()
    lines[100:] = [line.replace(",", ",87,") for line in lines[100:]]
    with pytest.raises(RunError, match=r"row 101 .*columns change here: .*added.*Fix: make a run"):
        read(content="\n".join(lines).encode(), toml=toml())


@pytest.mark.parametrize("low", [0.0, -180.0])
def test_angles_logged_within_a_turn_run_on(read, low):
    turning = 40.0 * TIME**2 + 300.0
    wrapped = (turning - low) % 360.0 + low
    metadata = toml('accept_units = ["position"]').replace('"rad"', '"deg"')
    run = read(content=csv(positions=wrapped).encode(), toml=metadata)
    (repair,) = run.repairs
    assert repair.rule == "wrapped angle"
    assert np.diff(run.coordinate) == pytest.approx(np.deg2rad(np.diff(turning)), abs=1e-6)
