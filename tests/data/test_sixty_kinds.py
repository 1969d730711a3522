"""Sixty kinds of broken log and metadata: each is repaired by a stated rule, or refused with a reason."""

from typing import NamedTuple

import numpy as np
import pytest
from swing_log import HEAT, ROWS, SWING, TIME, csv, toml

from muscle_bayes.data import RunError

LINES = csv().splitlines()
WARM = csv("t,x,T", TIME, SWING, HEAT)
WITH_HEAT = 'temperature_a = "T"'


class Kind(NamedTuple):
    """A fault: the files, and either the rules that mend it or words of the refusal."""

    log: str | bytes
    about: str = toml()
    repaired: tuple[str, ...] | None = None
    refused: tuple[str, ...] | None = None


def lines(*changed: tuple[int, str]) -> str:
    """The good log with these lines (from 0, the header) in place of its own."""
    text = list(LINES)
    for at, line in changed:
        text[at] = line
    return "\n".join(text) + "\n"


def inserted(at: int, line: str) -> str:
    return "\n".join([*LINES[:at], line, *LINES[at:]]) + "\n"


def heat(at: int, cell: str) -> str:
    """The warm log with another temperature in one row."""
    text = WARM.splitlines()
    text[at] = ",".join([*text[at].split(",")[:2], cell])
    return "\n".join(text) + "\n"


def times(values, **options) -> str:
    return csv("t,x", values, SWING[: len(values)], **options)


JUMPED = np.where(np.arange(ROWS) >= 100, TIME - 1.0, TIME)
BURSTS = 0.02 * (np.arange(ROWS) % 2)
TURNS = np.mod(np.linspace(0.0, 1440.0, ROWS), 360.0)
WRAPPED = np.mod(65_000.0 + 20.0 * np.arange(ROWS), 65_536.0)
KINDS = {
    "blank last lines": Kind(csv() + "\n\n\n", repaired=()),
    "rows of separators at the end": Kind(csv() + ",\n,\n", repaired=("blank row",)),
    "last row cut": Kind(csv() + "4.0", repaired=("cut row",)),
    "short row": Kind(inserted(9, "0.165"), repaired=("short row",)),
    "long row": Kind(inserted(9, "0.165,0.3,9"), repaired=("long row",)),
    "word for a number": Kind(lines((9, "0.160,oops")), repaired=("bad cell",)),
    "NaN": Kind(lines((9, "0.160,NaN")), repaired=("bad cell",)),
    "infinity": Kind(lines((9, "0.160,inf")), repaired=("bad cell",)),
    "overflowing number": Kind(lines((9, "0.160,1e400")), repaired=("bad cell",)),
    "grouped digits of Python": Kind(lines((9, "0.160,1_0")), repaired=("bad cell",)),
    "hexadecimal": Kind(lines((9, "0.160,0x1F")), repaired=("bad cell",)),
    "error of a spreadsheet": Kind(lines((9, "0.160,#VALUE!")), repaired=("bad cell",)),
    "open quote": Kind(lines((9, '0.160,"0.3')), repaired=("broken quote",)),
    "header again": Kind(inserted(50, "t,x"), repaired=("repeated header",)),
    "comment within": Kind(inserted(50, "# paused"), repaired=("comment",)),
    "comments above": Kind("# rig 3\n" + csv(), repaired=("comment",)),
    "row twice": Kind(inserted(50, LINES[49]), repaired=("duplicate time",)),
    "gap": Kind(times(np.where(np.arange(ROWS) >= 100, TIME + 5.0, TIME)), repaired=("gap",)),
    "clock set back": Kind(times(JUMPED), repaired=("clock set back",)),
    "counter of 16 bits": Kind(
        times(WRAPPED, digits=0), toml('time_unit = "ms"'), repaired=("wrapped counter",)
    ),
    "angle within one turn": Kind(
        csv("t,x", TIME, TURNS),
        toml(position_unit='"deg"').replace('"arm"\nmass = 0.3\ncentre_distance = 0.2', '"none"'),
        repaired=("wrapped angle",),
    ),
    "byte-order mark": Kind(b"\xef\xbb\xbf" + csv().encode(), repaired=()),
    "Latin-1 byte": Kind(
        ("# Gr\xfc\xdfe\n" + csv()).encode("latin-1"), repaired=("encoding", "comment")
    ),
    "zero bytes at the end": Kind(csv().encode() + b"\0" * 64, repaired=("cut row",)),
    "CR alone": Kind(csv().replace("\n", "\r"), repaired=()),
    "CR LF": Kind(csv().replace("\n", "\r\n"), repaired=()),
    "sep line of Excel": Kind("sep=,\n" + csv(), repaired=()),
    "spaces about cells": Kind(csv().replace(",", " , "), repaired=()),
    "quoted numbers": Kind(
        "t,x\n"
        + "\n".join(f'"{t:.3f}","{x:.5f}"' for t, x in zip(TIME, SWING, strict=True))
        + "\n",
        repaired=(),
    ),
    "Fortran's exponent": Kind(lines((9, "0.160D0,0.3")), repaired=()),
    "typographic minus": Kind(csv().replace("-", "\u2212"), repaired=()),
    "failed thermometer, -1": Kind(heat(60, "-1"), toml(WITH_HEAT), repaired=("impossible jump",)),
    "failed thermometer, 0": Kind(heat(60, "0.0"), toml(WITH_HEAT), repaired=("impossible jump",)),
    "failed thermometer, 85": Kind(
        heat(20, "85.0"), toml(WITH_HEAT), repaired=("impossible jump",)
    ),
    "thermometer beyond its range": Kind(
        heat(60, "6553.5"), toml(WITH_HEAT), repaired=("wild temperature",)
    ),
    "blank temperature": Kind(heat(60, ""), toml(WITH_HEAT), repaired=("bad cell",)),
    "slow thermometer": Kind(
        csv("t,x,T", TIME, SWING, [f"{h:.2f}" if i % 10 == 0 else "" for i, h in enumerate(HEAT)]),
        toml(WITH_HEAT),
        repaired=("slower sensor",),
    ),
    "position that jumps and comes back": Kind(
        lines((60, "1.180,97.0")), repaired=("impossible jump",)
    ),
    "clock of HH:MM:SS over midnight": Kind(
        times([f"23:59:{58 + t:06.3f}" if t < 2 else f"00:00:{t - 2:06.3f}" for t in TIME]),
        repaired=("wrapped counter",),
    ),
    "dates of ISO": Kind(times([f"2024-02-29T10:00:{t:06.3f}" for t in TIME]), repaired=()),
    "empty file": Kind("", refused=("the log is empty",)),
    "header alone": Kind("t,x\n", refused=("0 whole rows",)),
    "no header": Kind(csv(""), refused=("header = false",)),
    "wrong name": Kind(csv("time,x"), refused=("column 't'", "correct the name")),
    "name twice": Kind(csv("x,x"), refused=("column 't'",)),
    "semicolons": Kind(csv("t;x", separator=";"), refused=("row 1", "separator")),
    "decimal commas": Kind(csv("t;x", separator=";", decimal=","), refused=("row 1", "separator")),
    "decimal commas between semicolons": Kind(
        csv("t;x", separator=";", decimal=","), toml(log='separator = ";"'), refused=("decimal",)
    ),
    "UTF-16": Kind(csv().encode("utf-16"), refused=("UTF-16", "save it as UTF-8")),
    "an Excel workbook": Kind(b"PK\x03\x04" + b"\0" * 80, refused=("Excel", "save the log as CSV")),
    "a gzip archive": Kind(b"\x1f\x8b" + b"\0" * 80, refused=("gzip",)),
    "milliseconds": Kind(times(1000 * TIME, digits=0), refused=("milliseconds", "time_unit")),
    "epoch in milliseconds": Kind(
        times(1.7e12 + 20 * np.arange(ROWS), digits=0), refused=("in ms since 1970",)
    ),
    "unit in the name": Kind(
        csv("t,x_deg"), toml(position='"x_deg"'), refused=("deg", "position_unit")
    ),
    "units row": Kind("t,x\n(ms),(rad)\n" + csv(""), refused=("units row", "time_unit")),
    "kelvin": Kind(csv("t,x,T", TIME, SWING, HEAT + 273.15), toml(WITH_HEAT), refused=("kelvin",)),
    "Fahrenheit": Kind(
        csv("t,x,T", TIME, SWING, HEAT * 1.8 + 32), toml(WITH_HEAT), refused=("degrees F",)
    ),
    "grams": Kind(
        csv("t,x,m", TIME, SWING, np.full(ROWS, 212.0)),
        toml('load = "m"') + "[fixture]\ndisc_radius = 0.05\n",
        refused=("grams fit",),
    ),
    "degrees called radians": Kind(csv("t,x", TIME, 90 * SWING), refused=("position_unit",)),
    "time that restarts in bursts": Kind(times(BURSTS), refused=("the time column does not rise",)),
    "time that stands still": Kind(times(0 * TIME), refused=("t",)),
    "readings beyond the stops": Kind(
        csv(), toml() + "[fixture]\nstops = [-0.1, 0.1]\n", refused=("beyond the endstops",)
    ),
    "most cells blank": Kind(
        csv("t,x", TIME, ["" if 20 < i < 120 else f"{x:.5f}" for i, x in enumerate(SWING)]),
        refused=("'x'",),
    ),
    "a column added midway": Kind(
        "\n".join([*LINES[:100], *(line + ",7" for line in LINES[100:])]),
        refused=("columns change",),
    ),
    "unknown key": Kind(
        csv(), toml("postion_unit = 'deg'"), refused=("postion_unit", "position_unit")
    ),
    "unknown unit": Kind(csv(), toml(position_unit='"furlongs^"'), refused=("furlongs^",)),
    "broken TOML": Kind(csv(), toml() + "[fixture\n", refused=("TOML",)),
    "text for a number": Kind(csv(), toml().replace("0.3", '"0.3"'), refused=("mass",)),
    "mass without its distance": Kind(
        csv(),
        toml().replace("centre_distance = 0.2\n", ""),
        refused=("centre_distance", "give both"),
    ),
    "back-EMF of a current": Kind(
        csv("t,x,i", TIME, SWING, np.sin(TIME)),
        toml('applied = "i"\napplied_unit = "A"') + "[drive]\nback_emf = 0.1\n",
        refused=("back_emf",),
    ),
    "drive without its column": Kind(
        csv(), toml() + "[drive]\ngain = 0.1\n", refused=("columns.applied",)
    ),
}


def test_they_are_sixty_or_more():
    assert len(KINDS) >= 60


@pytest.mark.parametrize("name", KINDS)
def test_it_is_mended_or_refused(read, name):
    kind = KINDS[name]
    content = kind.log if isinstance(kind.log, bytes) else kind.log.encode()
    if kind.repaired is not None:
        run = read(content=content, toml=kind.about, name="swing")
        assert tuple(repair.rule for repair in run.repairs) == kind.repaired
        assert np.isfinite(run.output).all()
        assert np.diff(run.table["time"]).min() > 0.0
        return
    with pytest.raises(RunError) as caught:
        read(content=content, toml=kind.about, name="swing")
    for words in ("swing", "Fix: ", *kind.refused):
        assert words in str(caught.value)
