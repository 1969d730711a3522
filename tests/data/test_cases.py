"""Inputs that failed once, read where they are: what must come out of each."""

import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app
from muscle_bayes.data import RunError, read_run
from muscle_bayes.inference.posteriors.contradiction import contradiction

pytestmark = pytest.mark.real

SWING = (0.8, 0.79362, -0.04746)
"""First, second and third-last position of the swings."""

READ = {
    "past-pi": (2400, []),
    "coast": (400, []),
    "quotedheader": (300, []),
    "torque_request": (300, []),
    "one_short_row": (299, [("short row", 1, 202)]),
    "hms": (300, []),
    "hash": (300, [("comment", 3, 1)]),
    "sep_line": (300, []),
    "bom_utf8": (300, []),
    "garbage": (298, [("encoding", 1, 41), ("short row", 1, 91), ("bad cell", 1, 41)]),
    "nul": (300, [("cut row", 1, 302)]),
    "multirate": (1200, [("slower sensor", 1, 3)]),
    "wrap16": (600, [("wrapped counter", 1, 279)]),
    "wrap32": (300, [("wrapped counter", 1, 67)]),
    "artisan_m1": (1200, [("impossible jump", 8, 138)]),
    "max6675_zero": (1200, [("impossible jump", 8, 138)]),
    "ds18b20_85": (1200, [("impossible jump", 8, 138)]),
}


@pytest.mark.parametrize("name", READ)
def test_is_read_and_what_was_repaired_is_said(cases, name):
    rows, repairs = READ[name]
    run = read_run(cases / f"{name}.csv")
    assert len(run.table) == rows
    assert [(one.rule, one.count, one.first_row) for one in run.repairs] == repairs
    assert np.diff(run.table["time"]).min() > 0


@pytest.mark.parametrize(
    "name", ["quotedheader", "torque_request", "one_short_row", "hms", "hash", "sep_line", "nul"]
)
def test_columns_are_the_right_ones(cases, name):
    run = read_run(cases / f"{name}.csv")
    assert run.coordinate[[0, 1, -3]].tolist() == pytest.approx(SWING)
    assert run.duration == pytest.approx(5.98)


@pytest.mark.parametrize("name", ["wrap16", "wrap32"])
def test_wrapped_counters_go_on_evenly(cases, name):
    time = read_run(cases / f"{name}.csv").table["time"].to_numpy()
    assert np.diff(time) == pytest.approx(0.02, abs=1e-6)


@pytest.mark.parametrize("name", ["artisan_m1", "max6675_zero", "ds18b20_85"])
def test_failed_readings_are_held(cases, name):
    heat = read_run(cases / f"{name}.csv").table["temperature_a"].to_numpy()
    assert heat.min() == 25.13
    assert heat.max() < 80
    assert np.abs(np.diff(heat)).max() < 2.5


def test_a_slower_sensor_keeps_its_own_times(cases):
    run = read_run(cases / "multirate.csv")
    own = run.own_times["temperature_a"]
    assert own == pytest.approx(np.arange(120.0))
    heat = run.table["temperature_a"].to_numpy()
    assert heat[[0, 10]].tolist() == [26.1, 35.96]
    assert heat[5] == pytest.approx((26.1 + 35.96) / 2)


def test_a_rig_without_stops_has_none(cases):
    assert read_run(cases / "past-pi.csv").stops == (-np.inf, np.inf)


REFUSED = {
    "columns_change": (["row 202", "columns change", "4 cells before and 3", "removed"], None),
    "units_row": (
        ["column 'Time'", "columns.time_unit", "units row (ms)", 'time_unit = "ms"'],
        'time_unit = "ms"\naccept_units = ["position"]',
    ),
    "time_ms": (["'time_ms'", "says ms", 'time_unit = "ms"'], 'time_unit = "ms"'),
    "epoch_ms": (["column 't'", "in ms since 1970", "time_unit"], 'time_unit = "ms"'),
    "decimal_comma_bare": (
        ["'0,000,0,80000'", 'separator = ","', 'decimal = ","'],
        '[log]\nseparator = ","\ndecimal = ","',
    ),
    "thousands": (["'1,234.000'", 'thousands = ","'], '[log]\nthousands = ","'),
    "fahrenheit": (["column 'T'", "degrees F", "temperature_unit"], 'temperature_unit = "degF"'),
    "kelvin": (["column 'T'", "kelvin", "temperature_unit"], 'temperature_unit = "kelvin"'),
}


@pytest.mark.parametrize("name", REFUSED)
def test_is_refused_with_the_true_cause_and_read_by_the_key_that_it_names(cases, name, tmp_path):
    told, keys = REFUSED[name]
    with pytest.raises(RunError) as caught:
        read_run(cases / f"{name}.csv")
    for words in [f"{name}.csv", "Fix: ", *told]:
        assert words in str(caught.value)
    if keys is None:
        return
    shutil.copy(cases / f"{name}.csv", tmp_path)
    toml = (cases / f"{name}.toml").read_text()
    where = "[columns]\n" if not keys.startswith("[log]") else "format = 1\n"
    if keys.startswith("[log]"):
        toml += f"\n{keys}\n"
    else:
        toml = toml.replace(where, f"{where}{keys}\n")
    (tmp_path / f"{name}.toml").write_text(toml)
    run = read_run(tmp_path / f"{name}.csv")
    assert run.repairs == ()
    if "temperature" in keys:
        assert run.table["temperature_a"].min() == pytest.approx(25.13, abs=0.01)
    else:
        assert run.duration == pytest.approx(5.98)
        assert run.coordinate[[0, 1, -3]].tolist() == pytest.approx(SWING)


def init(cases, tmp_path, name, *options):
    shutil.copy(cases / name, tmp_path / name)
    command = ["init", str(tmp_path / name), "--no-ask", *options]
    return CliRunner().invoke(app, command), tmp_path / name


INIT = {
    "mass-spring-1.csv": (
        ["--position-unit", "mm", "--element", "spring", "--load", "0.791"],
        (250, 0.01, -0.068, "mm"),
    ),
    "mass-spring-2.csv": (["--position-unit", "mm"], (250, 0.01, -0.036, "mm")),
    "free-swing-1.txt": (
        ["--position-unit", "deg", "--element", "arm 0.0157 0.0685"],
        (5000, 0.001, np.deg2rad(-90.36), "deg"),
    ),
    "driven-pendulum.csv": (["--position-unit", "rad"], (399, 1 / 300, -0.0014572, "rad")),
    "gyro-wheel.csv": (["--position-unit", "rad/s"], (2317, 0.002, 0.641871, "rad/s")),
}


@pytest.mark.parametrize("name", INIT)
def test_init_reads_it_with_what_it_cannot_know(cases, tmp_path, name):
    options, (rows, spacing, first, unit) = INIT[name]
    result, log = init(cases, tmp_path, name, *options)
    assert result.exit_code == 0, result.output
    run = read_run(log)
    assert len(run.table) == rows
    assert np.median(np.diff(run.table["time"])) == pytest.approx(spacing, rel=1e-3)
    assert run.output[0] == pytest.approx(first, rel=1e-4)
    assert run.unit == unit


def test_a_spring_that_nobody_described_is_to_be_estimated(cases, tmp_path):
    _, log = init(cases, tmp_path, "mass-spring-1.csv", *INIT["mass-spring-1.csv"][0])
    spring = read_run(log).metadata.element_a
    assert (spring.rate, spring.free_length, spring.tension_at_zero) == (None, None, None)
    assert set(read_run(log).table["load"]) == {0.791}
    assert read_run(log).metadata.fixture.inertia == 0.0


def test_init_takes_the_torque_of_the_driven_pendulum(cases, tmp_path):
    _, log = init(cases, tmp_path, "driven-pendulum.csv", "--position-unit", "rad")
    run = read_run(log)
    assert run.metadata.columns.applied == "torque"
    assert run.table["applied"].max() == pytest.approx(17.04, abs=0.01)


def test_the_arm_of_the_driven_pendulum_is_contradicted(cases, tmp_path):
    options = ("--position-unit", "rad", "--element", "arm 0.546 0.5")
    told = contradiction(read_run(init(cases, tmp_path, "driven-pendulum.csv", *options)[1]))
    assert "with the stated inertia" in told
    assert "a mass, a length or the scale of what drives is contradicted" in told


def test_the_rate_of_the_wheel_is_no_angle(cases, tmp_path):
    _, log = init(cases, tmp_path, "gyro-wheel.csv", "--position-unit", "rad/s")
    run = read_run(log)
    assert run.measured == "velocity"
    with pytest.raises(RunError, match=r"measures a velocity.*Fix"):
        _ = run.coordinate


def test_bursts_of_labview_are_no_clock(cases, tmp_path):
    result, log = init(cases, tmp_path, "sma-labview.txt", "--position", "2")
    assert result.exit_code == 2
    assert "No column rises" in result.stderr
    assert "--sample-rate" in result.stderr
    toml = (
        'format = 1\nprotocol = "free"\norigin = "measured"\n[log]\nseparator = "tab"\n'
        'header = false\nRATE\n[columns]\ntime = 1\nposition = 2\nposition_unit = "mm"\n'
        '[fixture]\nmotion = "linear"\n[element_a]\nkind = "none"\n'
    )
    log.with_suffix(".toml").write_text(toml.replace("RATE\n", ""))
    with pytest.raises(RunError) as caught:
        read_run(log)
    assert "the time column does not rise" in str(caught.value)
    assert "sample_rate" in str(caught.value)
    log.with_suffix(".toml").write_text(toml.replace("RATE", "sample_rate = 10.0"))
    assert len(read_run(log).table) == 474
