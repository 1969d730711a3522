"""Gain files: read, written, refused with a message; and the firmware's header."""

import subprocess
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from muscle_bayes.control.laws.gains import (
    FeedForward,
    Gains,
    Inner,
    board_numbers,
    gains_header,
    gains_toml,
    read_gains,
)
from muscle_bayes.control.plant.design import Design
from muscle_bayes.errors import MuscleBayesError

FIRMWARE = Path(__file__).parents[2] / "firmware"


@pytest.mark.parametrize(
    "gains",
    [
        Gains(proportional=1234.5678, integral=0.1, bias=3.0),
        Gains(
            law="cascade",
            period_ms=60,
            proportional=100.0,
            integral=0.0,
            inner=Inner(hold=1.2, heat=15.0),
        ),
        Gains(
            law="feedforward",
            proportional=10.0,
            integral=1.0,
            feedforward=FeedForward(angle=(-0.1, 0.1), output=(-50.0, 60.0)),
        ),
    ],
)
def test_what_is_written_is_read(gains, tmp_path):
    path = tmp_path / "g.toml"
    path.write_text(gains_toml(gains, "two\nlines"))
    assert read_gains(path) == gains


GOOD = "proportional = 1000.0\nintegral = 50.0\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("proportional = -5.0\nintegral = 1.0\n", "key proportional"),
        ("proportional = nan\nintegral = 1.0\n", "key proportional"),
        ("proportional = inf\nintegral = 1.0\n", "key proportional"),
        ('proportional = "big"\nintegral = 1.0\n', "key proportional"),
        ("proportional = 0.0\nintegral = 0.0\n", "proportional: is zero"),
        ("proportional = 1.0\n", "key integral: missing"),
        (GOOD + "bias = 300.0\n", "key bias"),
        (GOOD + "period_ms = 0\n", "key period_ms"),
        (GOOD + "period_ms = 30.5\n", "key period_ms"),
        (GOOD + 'law = "pid"\n', "'pid' is not known"),
        (GOOD + 'law = "cascade"\n', "does not fit"),
        (GOOD + "[inner]\nhold = 1.0\nheat = 10.0\n", "does not fit"),
        (GOOD + "governor = [97.0, 87.0]\n", "does not rise"),
        (GOOD + "derivative = 3.0\n", "unknown key"),
        ("proportional = \n", "not valid TOML"),
        (
            GOOD + 'law = "feedforward"\n[feedforward]\nangle = [1.0, 0.0]\noutput = [0.0, 1.0]\n',
            "does not rise",
        ),
    ],
)
def test_nonsense_gets_a_message_that_names_file_and_key(text, told, tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(MuscleBayesError) as raised:
        read_gains(path)
    message = str(raised.value)
    assert "bad.toml" in message
    assert "Fix:" in message
    assert told.removeprefix("proportional: ").removeprefix("feedforward: ") in message


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(
        MuscleBayesError, match=r"g\.toml.*no such file\. Fix: write them with `muscle-bayes tune`"
    ):
        read_gains(tmp_path / "g.toml")


@given(st.floats(1.0, 20000.0), st.floats(0.5, 2500.0), st.floats(0.0, 255.0))
def test_rounding_to_the_bench_keeps_gains_within_half_a_unit(proportional, integral, bias):
    """Muscle A shortens, the angle falls, the reading falls: both gains are negative."""
    found = board_numbers(Gains(proportional=proportional, integral=integral, bias=bias), Design())
    assert -found.kp == pytest.approx(proportional * 0.0058 * 256, abs=0.501)
    assert -found.ki == pytest.approx(integral * 0.0058 * 0.03 * 65536, abs=0.501)
    assert found.bias == pytest.approx(bias, abs=0.501)


@pytest.mark.parametrize(
    ("gains", "told"),
    [
        (Gains(proportional=1e5, integral=1.0), "times what the firmware's integers hold"),
        (Gains(proportional=100.0, integral=2e4), "times what the firmware's integers hold"),
        (Gains(proportional=0.1, integral=10.0), "too small"),
    ],
)
def test_what_the_firmware_cannot_hold_is_refused(gains, told):
    with pytest.raises(MuscleBayesError, match=told):
        gains_header(gains, Design())


def test_the_header_compiles_into_the_firmware(tmp_path):
    gains = Gains(proportional=2500.0, integral=120.0, bias=7.0)
    header = tmp_path / "gains.h"
    header.write_text(gains_header(gains, Design(), "CVaR over 64 draws"))
    build = ["make", "-s", "-C", FIRMWARE, f"GAINS={header}", f"BUILD={tmp_path / 'build'}", "host"]
    made = subprocess.run(list(map(str, build)), capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    found = board_numbers(gains, Design())
    for name, value in (("KP", f"{found.kp}L"), ("KI", f"{found.ki}L"), ("BIAS", "7")):
        assert f"#define GAINS_{name} {value}" in header.read_text()
