"""Good logs: what a Run holds."""

import re
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pandas.testing import assert_frame_equal
from sample_log import ROWS, TOML, edit_cell, fixture_rows

from muscle_bayes.data import HEATER_HEADER, RunError, read_run, read_runs
from muscle_bayes.data.log import parse_log
from muscle_bayes.data.run import COLUMNS
from muscle_bayes.data.sensor import grid_step

OTHER_RIG = """\
format = 1
protocol = "free"
origin = "measured"
[columns]
time = "t"
position = "height"
position_unit = "mm"
position_sign = -1
temperature_a = "hot"
load = "kg"
applied = "force"
[fixture]
motion = "linear"
room_temperature = 21.0
[element_a]
kind = "spring"
linkage = "straight"
length_at_zero = 0.02
"""


def test_table_is_canonical(read):
    run = read()
    table = run.table
    assert tuple(table.columns) == COLUMNS
    assert set(map(str, table.dtypes)) == {"float64"}
    assert len(table) == ROWS
    assert table["time"][0] == 0
    assert run.start == 100
    assert run.duration == pytest.approx(3.0)
    assert table["reading"][:3].tolist() == [500, 501, 502]
    assert table["temperature_a"].max() == pytest.approx(30.7)
    assert (table["setpoint_a"] == 40).all()
    assert (table["applied"] == 0).all()
    assert run.repairs == ()


def test_load_is_piecewise_constant(read):
    run = read()
    assert run.load_steps == (1.0,)
    before = run.table["time"] < 1.0
    assert set(run.table["load"][before]) == {0.139}
    assert set(run.table["load"][~before]) == {0.166}


def test_load_before_its_first_step_is_none(read):
    run = read(toml=TOML.replace("[0.0, 1.0]", "[0.5, 1.0]"))
    assert run.table["load"][0] == 0
    assert run.load_steps == (0.5, 1.0)


def test_counts_become_radians(read):
    sensor = read().sensor
    assert (sensor.zero, sensor.scale, sensor.sign, sensor.resolution) == (512, 0.0058, 1, 1)
    assert sensor.coordinate(522.0) == pytest.approx(0.058)
    assert sensor.reading(sensor.coordinate([3.0, 700.0])) == pytest.approx([3, 700])


def test_a_zero_is_as_sure_as_the_metadata_say(read):
    told = "radians_per_count = 0.0058\nzero_uncertainty = 0.0"
    assert read().sensor.zero_uncertainty == 2.0
    assert read(toml=TOML.replace("radians_per_count = 0.0058", told)).sensor.zero_uncertainty == 0
    lines = ["t,height,hot,kg,force", *(f"{i},{0.5 * i},30,0.1,0" for i in range(6))]
    assert read(lines, OTHER_RIG).sensor.zero_uncertainty == 2 * 0.5
    no_steps = ["t,height,hot,kg,force", *(f"{i},{0.1 * i**1.5},30,0.1,0" for i in range(6))]
    assert read(no_steps, OTHER_RIG).sensor.zero_uncertainty == 0.0
    unsure = 'position_unit = "mm"\nposition_zero = 0.4\nposition_zero_uncertainty = 0.1'
    sensor = read(lines, OTHER_RIG.replace('position_unit = "mm"', unsure)).sensor
    assert (sensor.zero, sensor.zero_uncertainty) == (0.4, 0.1)
    assert sensor.coordinate(1.4) == pytest.approx(-1e-3)


def test_negative_scale_is_a_sign(read):
    sensor = read(toml=TOML.replace("0.0058", "-0.0058")).sensor
    assert (sensor.scale, sensor.sign) == (0.0058, -1)


def test_other_rig(read):
    lines = ["t,height,hot,kg,force,unused"]
    lines += [f"{i},{0.5 * i},{30 + i},{0.1 if i < 3 else 0.2},{i},text" for i in range(6)]
    run = read(lines, OTHER_RIG)
    assert run.unit == "mm"
    assert run.sensor.resolution == pytest.approx(0.5)
    assert run.coordinate[2] == pytest.approx(-0.001)
    assert run.load_steps == (3.0,)
    assert run.table["applied"].tolist() == [0, 1, 2, 3, 4, 5]
    assert (run.table["temperature_b"] == 21).all()
    assert run.table["setpoint_a"].isna().all()


@given(st.lists(st.sampled_from(["\n", "\r\n", "\r"]), min_size=21, max_size=21))
@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_line_ends_do_not_matter(read, ends):
    lines = fixture_rows(20)
    mixed = "".join(line + end for line, end in zip(lines, ends, strict=True))
    assert_frame_equal(read(content=mixed.encode()).table, read(lines).table)
    assert len(set(parse_log(mixed.encode(), Path("a.csv"), None).lines)) == 20


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_encodings(read, encoding):
    lines = ["t;°C".replace(";", ","), *(f"{i},{i}" for i in range(5))]
    toml = OTHER_RIG.split("position_sign")[0].replace("height", "°C")
    toml += '[fixture]\nmotion = "linear"\n[element_a]\nkind = "none"\n'
    run = read(toml=toml, content="\n".join(lines).encode(encoding))
    assert run.table["reading"].tolist() == [0, 1, 2, 3, 4]
    assert [repair.rule for repair in run.repairs] == (["encoding"] * (encoding == "latin-1"))


def test_header_tolerates_spaces_quotes_and_true_false(read):
    lines = fixture_rows()
    lines[0] = ",".join(f'  "{name.strip()}" ' for name in lines[0].split(","))
    lines[1:] = [re.sub(r",1,1,", ",True,False,", line) for line in lines[1:]]
    assert read(lines).repairs == ()


def test_either_file_names_the_run(write):
    path = write()
    by_log, by_metadata = read_run(path), read_run(path.with_suffix(".toml"))
    assert by_log.checksum == by_metadata.checksum
    assert len(by_log.checksum) == 64
    assert by_log.path == by_metadata.path == path


def test_checksum_sees_both_files(write):
    path = write()
    first = read_run(path).checksum
    path.with_suffix(".toml").write_text(TOML + "# remark\n")
    assert read_run(path).checksum != first


def test_folder_is_every_run_sorted(write):
    write(name="b")
    path = write(name="a")
    assert [run.name for run in read_runs([path.parent])] == ["a", "b"]
    assert len(read_runs([path, path.with_suffix(".toml")])) == 1


def test_folder_without_runs(tmp_path):
    with pytest.raises(RunError, match=r"no runs: the folder holds no CSV\. Fix:"):
        read_runs([tmp_path])
    with pytest.raises(RunError, match="No runs were named"):
        read_runs([])


def test_duplicate_names(write, tmp_path):
    path = write()
    other = tmp_path / "other"
    other.mkdir()
    with pytest.raises(RunError, match=r"duplicate run name.*rename"):
        read_runs([path, other / "stairs.csv"])


def test_missing_files(write, tmp_path):
    path = write()
    path.with_suffix(".toml").unlink()
    with pytest.raises(RunError, match=r"stairs\.toml.*metadata is missing.*init stairs\.csv"):
        read_runs([path.parent])
    for absent in ("absent.csv", "absent.toml"):
        with pytest.raises(RunError, match=f"{absent}: no such file. Fix: correct the path."):
            read_runs(tmp_path / absent)
    (tmp_path / "truth.toml").write_text("")
    with pytest.raises(RunError, match=r"truth\.toml: no log lies beside it, such as truth\.csv"):
        read_run(tmp_path / "truth.toml")
    with pytest.raises(RunError, match="no such file or folder"):
        read_run(tmp_path / "absent")
    with pytest.raises(RunError, match=r"neither NAME\.csv nor NAME\.toml"):
        read_run(tmp_path / "absent.xlsx")


def test_shows_well(read):
    run = read()
    assert repr(run) == (
        "<Run stairs | staircase | SYNTHETIC | 101 rows, 3.0 s | position in counts | no repairs>"
    )
    assert "<b>Run</b> stairs" in run._repr_html_()


@pytest.mark.parametrize("digits", [6, 7, 9])
def test_grid_of_significant_digits(digits):
    """As %.9g prints: small numbers have more decimals than large ones."""
    steps = 0.3 + np.arange(-400, 1200) * 0.00153398079
    printed = np.array([float(f"{one:.{digits}g}") for one in steps])
    assert grid_step(printed) == pytest.approx(0.00153398, rel=1e-4)
    noise = np.random.default_rng(1).normal(size=300)
    assert grid_step([float(f"{one:.{digits}g}") for one in noise]) < 1e-5


def test_grid_of_printed_steps():
    steps = np.arange(400) * 0.00153398
    assert grid_step(np.round(steps, 6)) == pytest.approx(0.00153398, rel=1e-5)
    assert grid_step(np.degrees(steps)) == pytest.approx(np.degrees(0.00153398), rel=1e-5)
    assert grid_step(np.random.default_rng(1).normal(size=300)) == 0
    assert grid_step(np.random.default_rng(1).normal(size=30_000)) == 0
    assert grid_step([1.0, 1.0]) == 0
    assert grid_step(1.0 / 3.0 + np.arange(5) * 1e-15) == 0
    assert grid_step([]) == 0


def test_the_work_on_a_log_grows_no_faster_than_its_rows(read):
    calls = []
    for rows in (1_000, 10_000):
        lines = fixture_rows(rows)
        lines[500] = lines[500].replace("40.0", "")
        counted = Counter()
        sys.setprofile(lambda frame, event, argument, counted=counted: counted.update([event]))
        try:
            run = read(lines)
        finally:
            sys.setprofile(None)
        assert len(run.table) == rows
        calls.append(counted["call"] + counted["c_call"])
    assert calls[1] < 11 * calls[0]


def test_blank_cells_of_the_heater_board_stay_blank(read):
    header, *rows = fixture_rows()
    told = [f"{row},255,0,0,1" if at % 3 == 0 else f"{row},,,," for at, row in enumerate(rows)]
    run = read([f"{header}, {', '.join(HEATER_HEADER)}", *told])
    assert run.repairs == ()
    assert run.table["duty_a"].tolist()[:4] == pytest.approx(
        [255, np.nan, np.nan, 255], nan_ok=True
    )
    assert run.table["fan"].count() == len(rows) // 3 + 1


@pytest.mark.parametrize(("reading", "count"), [("4094.875", 0), ("4094.9", 1), ("4096", 1)])
def test_averages_of_a_wider_converter(read, reading, count):
    keys = "radians_per_count = 0.0058\nbits = 12\nresolution = 0.125"
    about = TOML.replace("radians_per_count = 0.0058", keys).replace("stops = [-1.2, 1.2]\n", "")
    lines = edit_cell(fixture_rows(), 3, 8, "505.125")
    run = read([*lines, f"103.030,37.7,40.0,0,25.0,25.0,1,1,{reading}"], about)
    assert [repair.rule for repair in run.repairs] == ["glitch"] * count
