"""The TMD-56: its bytes, its driver by turns and in a thread over a socket."""

import socket
import threading
import time

import numpy as np
import pytest
from fake_bench import FakeClock, FakeMeter
from hypothesis import given
from hypothesis import strategies as st

from muscle_bayes.bench.boards.clock import RealClock
from muscle_bayes.bench.boards.transport import meter_transport
from muscle_bayes.bench.meters.meter import (
    ANSWER_TIME,
    REQUEST,
    Meter,
    MeterError,
    ThreadedMeter,
    agrees,
    first_reading,
    format_answer,
    parse_answer,
)


def test_known_answer():
    answer = bytes([0x3E, 0x0F, 0, 0, 0, 0x01, 0x02, 0, 0, 0, 0x03, 0x84, 0x0D, 0x0A])
    assert parse_answer(answer) == (25.8, 90.0)
    assert REQUEST == b"#0A0000NA2\r\n"


def test_open_channels():
    answer = bytearray(14)
    answer[5:7], answer[10:12] = b"\xff\xff", b"\x7f\xff"
    assert parse_answer(bytes(answer)) == (None, None)


@pytest.mark.parametrize("length", [0, 13, 15])
def test_other_lengths_are_no_answers(length):
    with pytest.raises(ValueError, match=f"14 bytes, this one {length}"):
        parse_answer(bytes(length))


celsius = st.one_of(st.none(), st.integers(0, 13720).map(lambda tenths: tenths / 10))


@given(celsius, celsius)
def test_format_and_parse_are_inverse(first, second):
    assert parse_answer(format_answer((first, second))) == (first, second)


class Bench:
    def __init__(self):
        self.clock = FakeClock()
        self.device = FakeMeter(lambda: (30.0, 25.5))
        self.clock.listeners.append(self.device.step)
        self.meter = Meter(self.device, self.clock)

    def run(self, seconds):
        end = self.clock.now() + seconds
        while self.clock.now() < end:
            self.clock.sleep(0.005)
            self.meter.poll()


def test_polls_several_times_a_second():
    bench = Bench()
    bench.run(0.2)
    assert bench.meter.latest.temperatures == (30.0, 25.5)
    times = set()
    for _ in range(100):
        bench.run(0.01)
        times.add(bench.meter.latest.time)
    assert len(times) >= 8


@pytest.mark.parametrize("garble", [lambda data: data[:-3], lambda data: data + data[:2]])
def test_short_and_long_answers_are_counted_and_not_used(garble):
    bench = Bench()
    bench.device.garble = garble
    bench.run(3.0)
    assert bench.meter.latest is None
    assert bench.meter.garbled >= 3.0 / (ANSWER_TIME + 0.1) - 1
    bench.device.garble = lambda data: data
    bench.run(1.0)
    assert bench.meter.latest is not None


def test_random_answers_of_the_right_length_are_counted_and_not_used():
    bench = Bench()
    random = np.random.default_rng(0)
    answers = 0

    def garble(data):
        nonlocal answers
        answers += len(data) == 14
        return random.bytes(len(data))

    bench.run(0.5)
    before = bench.meter.latest
    bench.device.garble = garble
    while answers < 1000:
        bench.run(1.0)
    assert bench.meter.garbled >= answers - 1
    assert bench.meter.latest.temperatures == before.temperatures


def test_a_jump_counts_once_two_answers_agree():
    bench = Bench()
    bench.run(0.5)
    bench.device.forced = (900.0, 25.5)
    while bench.meter.garbled == 0:
        bench.run(0.005)
    assert bench.meter.latest.temperatures == (30.0, 25.5)
    bench.run(0.2)
    assert bench.meter.latest.temperatures == (900.0, 25.5)
    assert bench.meter.garbled == 1


@pytest.mark.parametrize(
    ("before", "raw", "passed", "sound"),
    [
        (250, 399, 0.06, True),
        (250, 401, 0.06, False),
        (250, 850, 2.0, True),
        (0xFFFF, 0xFFFF, 0.06, True),
        (0xFFFF, 0x7FFF, 0.06, False),
        (250, 0xFFFF, 0.06, False),
        (0xFFFF, 250, 9.0, False),
    ],
)
def test_what_can_follow_what(before, raw, passed, sound):
    assert agrees(before, raw, passed) is sound


def test_silent_meter_is_asked_again():
    bench = Bench()
    bench.device.silent = True
    with pytest.raises(MeterError, match=r"no reading in 2 s.*switch it on"):
        first_reading(bench.meter, bench.clock, 2.0)
    bench.device.silent = False
    assert first_reading(bench.meter, bench.clock, 2.0).temperatures == (30.0, 25.5)


def test_line_that_is_gone():
    bench = Bench()
    bench.device.pulled = True
    with pytest.raises(MeterError, match="gone"):
        bench.run(0.1)


@pytest.fixture
def served():
    """An emulated meter behind a socket; yields its address and a switch that ends it."""
    server = socket.create_server(("127.0.0.1", 0))
    stop = threading.Event()

    def serve():
        connection, _ = server.accept()
        connection.settimeout(0.05)
        with connection:
            while not stop.is_set():
                try:
                    request = connection.recv(64)
                except TimeoutError:
                    continue
                if request == REQUEST:
                    connection.sendall(format_answer((41.5, None)))

    thread = threading.Thread(target=serve)
    thread.start()
    yield f"socket://127.0.0.1:{server.getsockname()[1]}", stop
    stop.set()
    thread.join()
    server.close()


def poll_for(meter, seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        meter.poll()
        time.sleep(0.01)


def test_thread_polls_over_a_socket_and_tells_when_the_line_goes(served):
    url, stop = served
    meter = ThreadedMeter(Meter(meter_transport(url), RealClock()))
    try:
        reading = first_reading(meter, RealClock(), 5.0)
        assert reading.temperatures == (41.5, None)
        stop.set()
        with pytest.raises(MeterError, match="gone"):
            poll_for(meter, 5.0)
    finally:
        meter.close()
