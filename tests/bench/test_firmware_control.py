"""The angle controller on the board: gains from a header, integers, the same safety."""

import subprocess

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from host_firmware import HostFirmware
from hypothesis import given, settings
from hypothesis import strategies as st

from muscle_bayes.bench.boards.protocol import Error, Fault, encode
from muscle_bayes.bench.simulation import SimulatedBench, TwinPlant
from muscle_bayes.control.laws.feed import NoFeed
from muscle_bayes.control.laws.law import Measured
from muscle_bayes.control.laws.pi import PI
from muscle_bayes.control.laws.split import SplitPI
from muscle_bayes.control.laws.windup import Conditional
from muscle_bayes.twin import Element, Rig

PERIOD_MS, KP, KI, BIAS = 20, -5000, -800, 12


def build(source, folder, *targets, kp=KP, ki=KI, bias=BIAS):
    """Build the firmware with a header of gains."""
    header = folder / "gains.h"
    header.write_text(
        f"#define GAINS_PERIOD_MS {PERIOD_MS}\n#define GAINS_KP {kp}L\n"
        f"#define GAINS_KI {ki}L\n#define GAINS_BIAS {bias}\n"
    )
    command = ["make", "-s", "-C", source, f"GAINS={header}", f"BUILD={folder / 'build'}", *targets]
    return subprocess.run(list(map(str, command)), capture_output=True, text=True)


@pytest.fixture(scope="module")
def tuned(firmware, tmp_path_factory):
    """A build folder of firmware with gains."""
    folder = tmp_path_factory.mktemp("tuned")
    assert build(firmware.parent, folder).returncode == 0
    return folder / "build"


def hold(board, setpoint, first=250, second=250):
    return board.ask("HOLD", setpoint, first, second)


def pi(readings, setpoint):
    """The law in exact arithmetic, one reading a period, as gains.h states it."""
    total, duties = 0, []
    for reading in readings:
        error = setpoint - reading

        def output(sum_, error=error):
            exact = (KP * error * 256 + KI * sum_) / 2**16
            return max(-255, min(255, int(exact)))  # int() cuts towards zero, as C does

        before, after = output(total), output(total + error)
        if not ((before == 255 and after >= 255) or (before == -255 and after <= -255)):
            total += error
        u = output(total)
        duties.append((min(255, BIAS + max(u, 0)), min(255, BIAS + max(-u, 0))))
    return duties


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 1023), st.lists(st.integers(0, 1023), min_size=1, max_size=80))
def test_the_law_is_the_stated_one(tuned, setpoint, readings):
    board = HostFirmware(tuned)
    board.sample(0, readings[0])
    hold(board, setpoint)
    duties = []
    for reading in readings:
        board.sample(0, reading)
        board.tick(1)
        duties.append(board.duties)
        hold(board, setpoint)
        board.tick(PERIOD_MS - 1)
    assert duties == pi(readings, setpoint)


def test_the_control_study_simulates_this_law_digit_for_digit(tuned):
    readings = [int(500 + 90 * np.sin(n / 7) + n % 3) for n in range(120)]
    board = HostFirmware(tuned)
    board.sample(0, readings[0])
    hold(board, 520)
    with jax.enable_x64(True):
        pi_law = PI(jnp.asarray(KP / 2**8), jnp.asarray(KI / 2**16), Conditional())
        law = SplitPI(pi_law, jnp.asarray(float(BIAS)), NoFeed())
        state = law.initial()
        for reading in readings:
            board.sample(0, reading)
            board.tick(1)
            seen = Measured(jnp.asarray(520.0), jnp.asarray(float(reading)), jnp.zeros(2))
            state, duty = law.update(state, seen)
            assert tuple(map(int, duty)) == board.duties
            hold(board, 520)
            board.tick(PERIOD_MS - 1)


def test_without_gains_nothing_is_held(firmware):
    board = HostFirmware(firmware)
    board.sample(0, 500)
    assert hold(board, 600) == [Error(1, "GAINS")]


def test_a_sensor_board_holds_nothing(tuned):
    board = HostFirmware(tuned, heater=False)
    board.sample(0, 500)
    assert hold(board, 600) == [Error(1, "ROLE")]


def test_without_a_sample_nothing_is_held(tuned):
    assert hold(HostFirmware(tuned), 600) == [Error(1, "BUSY")]


@pytest.fixture
def holding(tuned):
    board = HostFirmware(tuned)
    board.sample(0, 500)
    hold(board, 400)
    board.tick()
    assert board.duties[0] > BIAS
    return board


def test_the_dead_man_watches_it(holding):
    holding.tick(398)
    assert holding.faults == 0
    holding.tick(1)
    assert holding.duties == (0, 0)
    assert holding.faults == Fault.DEADMAN
    hold(holding, 400)
    holding.tick(100)
    assert holding.duties == (0, 0)


@pytest.mark.parametrize("verb", ["DUTY", "OFF"])
def test_another_command_ends_it(holding, verb):
    holding.ask(verb, *((0, 0, 250, 250) if verb == "DUTY" else ()))
    holding.tick(200)
    assert holding.duties == (0, 0)
    assert holding.faults == 0


def test_it_does_not_go_on_by_itself_after_a_fault_is_cleared(holding):
    holding.internal_fault()
    holding.tick()
    holding.ask("CLEAR")
    holding.tick(200)
    assert holding.duties == (0, 0)
    hold(holding, 400)
    holding.tick()
    assert holding.duties[0] > BIAS


@pytest.mark.parametrize(
    ("temperatures", "fault"),
    [
        ((250, None), Fault.SENSOR),
        ((None, 250), Fault.SENSOR),
        ((250, 1101), Fault.OVER_TEMPERATURE),
    ],
)
def test_it_needs_both_thermocouples(holding, temperatures, fault):
    hold(holding, 400, *temperatures)
    assert holding.duties == (0, 0)
    assert holding.faults == fault


def test_limits_hold_for_it(holding):
    holding.ask("LIMIT", 60, 900, 1100)
    for _ in range(100):
        hold(holding, 0)
        holding.tick(10)
        assert max(holding.duties) <= 60


@pytest.mark.parametrize("gains", [{"kp": 40_000}, {"ki": -40_000}, {"bias": 256}, {"bias": -1}])
def test_gains_that_are_out_of_range_are_not_compiled(firmware, tmp_path, gains):
    made = build(firmware.parent, tmp_path, "host", **gains)
    assert made.returncode != 0
    assert "is out of range" in made.stderr


def test_the_compiled_controller_holds_an_antagonistic_joint(tuned, monkeypatch):
    """Two muscles, the potentiometer on the heater board as well."""
    monkeypatch.setenv("MUSCLE_BAYES_FIRMWARE", str(tuned))
    rig = Rig(element_b=Element(kind="muscle"))
    with SimulatedBench(TwinPlant(rig, load=0.0)) as bench:
        bench.listeners.append(lambda _: bench.heater.set_analog(bench.plant.counts()))
        bench.clock.sleep(0.05)
        start = bench.plant.counts()
        setpoint = start - 20
        for n in range(40_000 // 50):
            first, second = (round(10 * t) for t in bench.plant.temperatures())
            bench.heater_board.write(encode(n % 65536, "HOLD", setpoint, first, second))
            bench.clock.sleep(0.05)
        readings = []
        for n in range(100):
            first, second = (round(10 * t) for t in bench.plant.temperatures())
            bench.heater_board.write(encode(n, "HOLD", setpoint, first, second))
            bench.clock.sleep(0.05)
            readings.append(bench.plant.counts())
        assert sum(readings) / len(readings) == pytest.approx(setpoint, abs=1.5)
        assert max(bench.plant.temperatures()) < 110.0
