"""The firmware's safety logic on this machine, to the millisecond and against a model of it."""

import pytest
from host_firmware import HostFirmware
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)

from muscle_bayes.bench.boards.messages import Fault
from muscle_bayes.bench.boards.protocol import (
    ChecksumReport,
    Decoder,
    Error,
    FaultReport,
    Reply,
    encode,
    frame,
    read_answer,
)

DEADMAN_MS = 400
MAX_RISE = 900
MAX_T = 1100
TUBE = (450, 480)


@pytest.fixture
def board(firmware):
    board = HostFirmware(firmware)
    for channel in range(2):
        board.calibrate(channel, *TUBE)
    return board


def heat(board, first=200, second=100, first_t=250, second_t=250):
    return board.ask("DUTY", first, second, first_t, second_t)


def test_heaters_are_off_at_start_up(board):
    assert board.duties == (0, 0)
    assert board.faults == 0


def test_duties_are_those_asked_for(board):
    (reply,) = heat(board, 200, 100)
    assert read_answer("DUTY", reply) == (200, 100, 0)
    assert board.duties == (200, 100)


def test_dead_man_switches_off_after_its_time_and_not_before(board):
    heat(board)
    board.tick(DEADMAN_MS - 1)
    assert board.duties == (200, 100)
    told = Decoder().feed(board.tick())
    assert board.duties == (0, 0)
    assert told == [FaultReport(Fault.DEADMAN)]


def test_dead_man_does_not_mind_silence_while_nothing_heats(board):
    heat(board, 0, 0)
    board.tick(10_000)
    assert board.faults == 0


@pytest.mark.parametrize("verb", ["ID", "READ", "CLEAR"])
def test_only_heater_commands_feed_the_dead_man(board, verb):
    heat(board)
    for _ in range(8):
        board.tick(DEADMAN_MS // 8)
        board.ask(verb)
    assert board.duties == (0, 0)
    assert board.faults == (0 if verb == "CLEAR" else Fault.DEADMAN)


@pytest.mark.parametrize(
    "line",
    [
        b">1 DUTY 200 100 250 250*0000\n",
        b">1 DUTY 200 100 250 250\n",
        encode(1, "DUTY", 200, 100, 250, 250)[:-1] + b"x\n",
        encode(1, "DUTY", 200, 100, 250, 250).lower(),
        b">" + b"1" * 200 + b"\n",
    ],
)
def test_garbled_frames_are_counted_and_do_nothing(board, line):
    assert Decoder().feed(board.feed(line)) == [ChecksumReport(1)]
    assert board.duties == (0, 0)


def test_a_frame_begins_anew_wherever_its_start_stands(board):
    told = Decoder().feed(board.feed(b"noise>1 DUTY 20" + encode(2, "DUTY", 9, 8, 250, 250)))
    assert told == [ChecksumReport(1), Reply(2, ("9", "8", "0"))]
    assert board.duties == (9, 8)


def test_carriage_returns_before_line_feeds_are_ignored(board):
    line = encode(2, "DUTY", 9, 8, 250, 250).replace(b"\n", b"\r\n")
    assert Decoder().feed(board.feed(line)) == [Reply(2, ("9", "8", "0"))]


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("DUTY 1 2 3", "ARGS"),
        ("DUTY 1 2 3 4 5", "ARGS"),
        ("DUTY 1 2 3 x", "ARGS"),
        ("DUTY  1 2 3 4", "ARGS"),
        ("DUTY +1 2 3 4", "ARGS"),
        ("DUTY 1.0 2 3 4", "ARGS"),
        ("DUTY 256 2 3 4", "RANGE"),
        ("DUTY -1 2 3 4", "RANGE"),
        ("DUTY 1 2 3 40000", "RANGE"),
        ("DUTY 1 2 3 99999999999999", "ARGS"),
        ("STREAM 4", "RANGE"),
        ("STREAM 10001", "RANGE"),
        ("STREAM", "ARGS"),
        ("duty 1 2 3 4", "VERB"),
        ("DUTYS 1 2 3 4", "VERB"),
        ("DUT 1 2 3 4", "VERB"),
        ("READ", "BUSY"),
    ],
)
def test_wrong_commands_are_refused_by_their_code_and_feed_nothing(board, words, code):
    heat(board)
    board.tick(DEADMAN_MS - 1)
    assert Decoder().feed(board.feed(frame(f">77 {words}"))) == [Error(77, code)]
    assert board.duties == (200, 100)
    board.tick()
    assert board.duties == (0, 0)


@pytest.mark.parametrize("sequence", ["", "x", "-1", "65536", "1x"])
def test_a_sequence_number_that_is_none_is_refused(board, sequence):
    assert Decoder().feed(board.feed(frame(f">{sequence} ID"))) == [Error(0, "SEQ")]


def test_faults_stay_until_they_are_cleared(board):
    heat(board)
    board.tick(DEADMAN_MS)
    for _ in range(5):
        (reply,) = heat(board)
        assert read_answer("DUTY", reply) == (0, 0, Fault.DEADMAN)
    board.ask("OFF")
    assert board.faults == Fault.DEADMAN
    board.ask("CLEAR")
    assert board.faults == 0
    assert board.duties == (0, 0)
    heat(board)
    assert board.duties == (200, 100)


def test_over_temperature_cuts_out_and_clears_only_after_cooling(board):
    heat(board, first_t=MAX_T)
    assert board.faults == 0
    told = heat(board, first_t=MAX_T + 1)
    assert board.duties == (0, 0)
    assert FaultReport(Fault.OVER_TEMPERATURE) in told
    assert board.ask("CLEAR") == [Error(1, "FAULT")]
    heat(board, 0, 0, first_t=MAX_T - 49)
    assert board.ask("CLEAR") == [Error(1, "FAULT")]
    heat(board, 0, 0, first_t=MAX_T - 50)
    assert board.ask("CLEAR") == [Reply(1, ("0",))]


def test_a_channel_that_is_off_cuts_out_too(board):
    heat(board, 200, 0, 250, MAX_T + 1)
    assert board.faults == Fault.OVER_TEMPERATURE


@pytest.mark.parametrize("absurd", [-201, 2001, 32767, -32767])
def test_absurd_temperatures_cut_out(board, absurd):
    heat(board, 200, 0, 250, absurd)
    assert board.duties == (0, 0)
    assert board.faults == Fault.SENSOR
    assert board.ask("CLEAR") == [Error(1, "FAULT")]
    heat(board, 0, 0, 250, None)
    assert board.ask("CLEAR") == [Reply(1, ("0",))]


def test_a_channel_without_thermocouple_cannot_be_heated(board):
    heat(board, 200, 0, 250, None)
    assert board.duties == (200, 0)
    heat(board, 200, 1, 250, None)
    assert board.duties == (0, 0)
    assert board.faults == Fault.SENSOR


def test_limits_can_only_be_tightened(board):
    assert board.ask("LIMIT", 100, 800, 900) == [Reply(1, ("100", "800", "900"))]
    assert board.ask("LIMIT", 255, 32767, 32767) == [Reply(1, ("100", "800", "900"))]
    heat(board, 255, 50)
    assert board.duties == (100, 50)
    board.ask("LIMIT", 80, 800, 900)
    assert board.duties == (80, 50)
    heat(board, 1, 1, 901)
    assert board.faults == Fault.OVER_TEMPERATURE


def test_compiled_limits_are_reported_and_cannot_be_exceeded(board):
    told = board.ask("LIMIT", 255, 32767, 32767)
    assert told == [Reply(1, ("255", str(MAX_RISE), str(MAX_T)))]


@pytest.mark.parametrize(
    ("cause", "was_heating", "faults"),
    [
        (1, False, 0),
        (2, True, 0),
        (1 | 4, True, 0),
        (4, False, Fault.BROWN_OUT),
        (8, False, Fault.WATCHDOG),
        (4 | 8, False, Fault.BROWN_OUT | Fault.WATCHDOG),
        (2 | 8, False, 0),
        (2 | 8, True, Fault.WATCHDOG),
        (0, False, 0),
        (0, True, Fault.WATCHDOG),
    ],
)
def test_what_a_reset_leaves_behind(firmware, cause, was_heating, faults):
    board = HostFirmware(firmware, cause=cause, was_heating=was_heating)
    assert board.faults == faults
    heat(board)
    assert board.duties == ((0, 0) if faults else (200, 100))
    board.ask("CLEAR")
    heat(board)
    assert board.duties == (200, 100)


def test_a_sensor_board_never_heats(firmware):
    board = HostFirmware(firmware, heater=False)
    assert heat(board) == [Error(1, "ROLE")]
    assert heat(board, 0, 0) == [Reply(1, ("0", "0", "0"))]
    board.old(3, 6, 200)
    assert board.duties == (0, 0)


def test_an_internal_fault_latches(board):
    heat(board)
    assert Decoder().feed(board.internal_fault()) == [FaultReport(Fault.INTERNAL)]
    heat(board)
    assert board.duties == (0, 0)


def test_samples_are_streamed_at_the_period_and_numbered(board):
    board.ask("STREAM", 30)
    decoder = Decoder()
    samples = [m for n in range(300) for m in decoder.feed(board.sample(1000 * n, n))]
    assert [s.number for s in samples] == list(range(10))
    # Each is the sum of the last eight conversions, and stands in their middle.
    assert [s.angle for s in samples] == [8 * n - 28 for n in range(29, 300, 30)]
    assert [s.micros for s in samples] == [1000 * n - 3500 for n in range(29, 300, 30)]
    board.ask("STREAM", 0)
    assert board.sample(0, 0) == b""


def test_sample_numbers_wrap(board):
    board.ask("STREAM", 5)
    decoder = Decoder()
    numbers = [m.number for n in range(5 * 65537) for m in decoder.feed(board.sample(n, 1))]
    assert numbers[-2:] == [65535, 0]


class AgainstModel(RuleBasedStateMachine):
    """The firmware's logic against an independent statement of what is safe."""

    build = None

    def __init__(self):
        super().__init__()
        self.board = HostFirmware(self.build)
        self.silence = 10**6
        for channel in range(2):
            self.board.calibrate(channel, *TUBE)
        self.limit = 255
        self.asked = (0, 0)

    @rule(
        duties=st.tuples(st.integers(0, 255), st.integers(0, 255)),
        temperatures=st.tuples(
            st.none() | st.integers(-300, 2100), st.none() | st.integers(200, 1000)
        ),
    )
    def command(self, duties, temperatures):
        faulty = self.board.faults
        heat(self.board, *duties, *temperatures)
        self.silence = 0
        bad = any(
            (t is None and duty > 0) or (t is not None and not -200 <= t <= MAX_T)
            for duty, t in zip(duties, temperatures, strict=True)
        )
        self.asked = (0, 0) if bad or faulty else tuple(min(d, self.limit) for d in duties)
        assert self.board.duties == self.asked
        if bad:
            assert self.board.faults

    @rule(milliseconds=st.integers(1, 500))
    def wait(self, milliseconds):
        for _ in range(milliseconds):
            self.board.tick()
            self.silence += 1
            if self.silence >= DEADMAN_MS:
                assert self.board.duties == (0, 0)

    @rule(noise=st.binary(max_size=60).filter(lambda data: b">" not in data))
    def noise(self, noise):
        self.board.feed(b">" + noise + b"\n")

    @rule(limit=st.integers(100, 255))
    def tighten(self, limit):
        self.board.ask("LIMIT", limit, 32767, 32767)
        self.limit = min(self.limit, limit)

    @precondition(lambda self: self.board.faults)
    @rule()
    def clear(self):
        self.board.ask("CLEAR")
        assert self.board.duties == (0, 0)
        self.asked = (0, 0)

    @rule()
    def off(self):
        self.board.ask("OFF")
        self.asked = (0, 0)

    @invariant()
    def nothing_heats_that_was_not_asked(self):
        duties = self.board.duties
        assert all(d <= min(a, self.limit) for d, a in zip(duties, self.asked, strict=True))
        if self.board.faults or self.silence >= DEADMAN_MS:
            assert duties == (0, 0)


def test_random_histories_keep_to_the_model(firmware):
    AgainstModel.build = firmware
    run_state_machine_as_test(AgainstModel, settings=settings(max_examples=60, deadline=None))
