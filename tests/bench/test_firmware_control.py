"""The angle controller on the board: gains from a header, integers, the same safety."""

import subprocess

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from host_firmware import HostFirmware
from jax.experimental import io_callback

from muscle_bayes.bench.boards.messages import Fault
from muscle_bayes.bench.boards.protocol import Error
from muscle_bayes.control.closed_loop import Clock, simulate, start_of
from muscle_bayes.control.laws.gains import FeedForward, Gains, Inner, gains_header, law_of
from muscle_bayes.control.laws.law import Law, Measured
from muscle_bayes.control.plant.design import Design
from muscle_bayes.control.plant.draws import JointDraws
from muscle_bayes.control.scenarios.thesis import square
from muscle_bayes.study.published import TABLE_1, TABLE_2

PERIOD_MS = 20
TABLE = FeedForward(angle=(-0.12, 0.0, 0.1), output=(-70.0, 3.0, 55.0))
DUTY = Gains(
    period_ms=PERIOD_MS, proportional=3000.0, integral=400.0, bias=12.0, filter_time=0.8,
    windup_time=2.0, governor=(90.0, 105.0), feedforward=TABLE,
)  # fmt: skip
CASCADE = DUTY.model_copy(
    update={
        "law": "cascade",
        "proportional": 400.0,
        "integral": 60.0,
        "inner": Inner(hold=1.3, heat=12.0),
    }
)


def build(source, folder, *targets, gains=DUTY, text=""):
    """Build the firmware with a header of gains; `text` comes last in it."""
    header = folder / "gains.h"
    header.write_text(gains_header(gains, Design()) + text)
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


@pytest.fixture(scope="module")
def cascaded(firmware, tmp_path_factory):
    """The same with a cascade."""
    folder = tmp_path_factory.mktemp("cascaded")
    assert build(firmware.parent, folder, gains=CASCADE).returncode == 0
    return folder / "build"


UPDATE = eqx.filter_jit(Law.update)


@pytest.mark.parametrize("warmth", [(250, 250), (950, 300), (310, 1010)])
@pytest.mark.parametrize("gains", [DUTY, CASCADE], ids=["duty", "cascade"])
def test_the_control_study_simulates_this_law_digit_for_digit(gains, warmth, tuned, cascaded):
    board = HostFirmware(cascaded if gains.inner else tuned)
    with jax.enable_x64(True):
        law = law_of(gains, Design())
        state = law.initial(jnp.asarray(500.0))
        for number in range(80):
            reading = int(500 + 40 * np.sin(number / 9) + number % 2)
            setpoint = 520 if number < 40 else 470
            board.sample(0, reading)
            hold(board, setpoint, *warmth)
            board.tick(1)
            seen = Measured(
                jnp.asarray(float(setpoint)),
                jnp.asarray(float(reading)),
                jnp.asarray(warmth) / 10.0,
            )
            state, duty = UPDATE(law, state, seen)
            assert tuple(map(int, duty)) == board.duties, (number, board.faults)
            board.tick(PERIOD_MS - 1)


class BoardLaw(eqx.Module):
    """The board itself as the law of a simulated loop."""

    board: HostFirmware = eqx.field(static=True)

    def initial(self, reading):
        return jnp.zeros(())

    def update(self, state, measured):
        def ask(setpoint, reading, temperature):
            self.board.sample(0, int(reading))
            hold(self.board, int(setpoint), *(round(10.0 * float(t)) for t in temperature))
            self.board.tick(1)
            duties = np.array(self.board.duties, np.float32)
            self.board.tick(PERIOD_MS - 1)
            return duties

        shape = jax.ShapeDtypeStruct((2,), jnp.float32)
        duties = io_callback(ask, shape, *measured, ordered=True)
        return state, duties.astype(jnp.float64)


@pytest.mark.slow
def test_three_hundred_seconds_in_the_loop_are_the_simulations(tuned):
    """Through JAX's plant, sensors and heaters: the board's duties keep the angle to a count."""
    values = TABLE_1["coulomb"] | {key: np.full(2, value) for key, value in TABLE_2.items()}
    tube = {"heater.gain": 4.5, "heater.cooling": 1 / 48, "heater.lag": 0.4}
    values |= {key: np.full(2, value) for key, value in tube.items()} | {
        "room": 25.0,
        "meter_lag": 1.0,
    }
    draws = JointDraws(Design(), "coulomb", (), {k: np.asarray(v)[None] for k, v in values.items()})
    with jax.enable_x64(True):
        joint, course, clock = draws.one(), square(DUTY.period), Clock(DUTY.period)
        start = start_of(joint, jnp.zeros(()), jnp.zeros(()))

        def angles(law):
            run = jax.jit(
                lambda: simulate(joint, law, course, start, jax.random.key(0), clock).angle
            )
            return np.asarray(run())

        simulated = angles(law_of(DUTY, Design()))
        board = HostFirmware(tuned)
        for channel in (0, 1):
            board.calibrate(channel, 450, 480)
        on_board = angles(BoardLaw(board))
    assert board.faults == 0
    assert np.ptp(simulated) > 0.1
    assert np.abs(on_board - simulated).max() < 0.0058


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
    assert board.duties[0] > DUTY.bias
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


@pytest.mark.parametrize("reading", [0, 7, 1016, 1023, 570, 430])
def test_a_potentiometer_that_is_open_shorted_or_jumps_is_a_fault(holding, reading):
    for _ in range(19):
        holding.sample(0, reading)
        holding.tick()
    assert holding.faults == 0
    holding.sample(0, reading)
    holding.tick()
    assert holding.faults == Fault.ANGLE
    assert holding.duties == (0, 0)


def test_a_glitch_of_the_potentiometer_changes_nothing(tuned):
    duties = []
    for glitch in (500, 0):
        board = HostFirmware(tuned)
        board.sample(0, 500)
        for n in range(200):
            hold(board, 480)
            board.sample(0, glitch if n % 20 < 10 else 500)
            board.tick()
        assert board.faults == 0
        duties.append(board.duties)
    assert duties[0] == duties[1]


@pytest.mark.parametrize("reading", [3, 1020])
def test_a_broken_wire_is_not_held_by(tuned, reading):
    board = HostFirmware(tuned)
    board.sample(0, reading)
    assert hold(board, 500) == [Error(1, "ANGLE")]


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
    assert holding.duties[0] > DUTY.bias


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


@pytest.mark.parametrize(
    "number", ["KP 140000L", "KI -140000L", "BIAS 256", "BIAS -1", "FILTER 0L"]
)
def test_gains_that_are_out_of_range_are_not_compiled(firmware, tmp_path, number):
    text = f"#undef GAINS_{number.split()[0]}\n#define GAINS_{number}\n"
    made = build(firmware.parent, tmp_path, "host", text=text)
    assert made.returncode != 0
    assert "is out of range" in made.stderr
