"""Lines over sockets, ptys and RFC 2217: settings, and what is seen when they go."""

import os
import pty
import select
import socket
import struct
import threading
import time

import pytest
import serial
import serial.rfc2217

from muscle_bayes.bench.boards.transport import (
    SerialTransport,
    TransportError,
    meter_transport,
)


def read_until(transport, length, seconds=5.0):
    """Bytes that come within some seconds."""
    data, end = b"", time.monotonic() + seconds
    while len(data) < length and time.monotonic() < end:
        data += transport.read(length - len(data))
        time.sleep(0.005)
    return data


def wait_for_loss(transport, seconds=5.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        transport.read(16)
        time.sleep(0.005)


@pytest.fixture
def line():
    """A transport on a socket, and the far end."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        transport = SerialTransport(f"socket://127.0.0.1:{server.getsockname()[1]}")
        far, _ = server.accept()
        with far:
            yield transport, far
        transport.close()


def test_bytes_both_ways_and_reading_never_waits(line):
    transport, far = line
    waits = []
    for _ in range(5):
        start = time.monotonic()
        assert transport.read(100) == b""
        waits.append(time.monotonic() - start)
    # The least: a busy machine may hold up any of them.
    assert min(waits) < 0.05
    transport.write(b">0 ID*1234\n")
    assert far.recv(100) == b">0 ID*1234\n"
    far.sendall(b"answer")
    assert read_until(transport, 6) == b"answer"


def test_loss_is_told_by_reading_and_stays(line):
    transport, far = line
    far.close()
    transport.write(b"x")  # the first write to a closed socket succeeds
    with pytest.raises(TransportError, match=r"socket://.*gone"):
        wait_for_loss(transport)
    for act in (lambda: transport.read(1), lambda: transport.write(b"y")):
        with pytest.raises(TransportError, match="gone"):
            act()
    assert transport._port.is_open  # why that is not asked


def test_a_lost_line_is_released(line):
    transport, far = line
    held = transport._port._socket
    # Closed with no time to linger, the far end resets the line, and pyserial cannot shut it down.
    far.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    far.close()
    with pytest.raises(TransportError, match="gone"):
        wait_for_loss(transport)
    transport.close()
    assert held.fileno() == -1


def test_what_came_before_the_loss_is_read(line):
    transport, far = line
    far.sendall(b"last words")
    far.close()
    assert read_until(transport, 10) == b"last words"
    with pytest.raises(TransportError, match="gone"):
        wait_for_loss(transport)


def test_pulled_cable_of_a_tty():
    far, near = pty.openpty()
    transport = SerialTransport(os.ttyname(near))
    os.close(near)
    transport.write(b"hello\n")
    assert select.select([far], [], [], 2.0)[0]
    assert os.read(far, 10) == b"hello\n"
    os.close(far)
    with pytest.raises(TransportError, match="gone"):
        wait_for_loss(transport)
    transport.close()
    transport.close()


@pytest.mark.parametrize("url", ["/dev/does-not-exist", "socket://127.0.0.1:1", "bogus://x"])
def test_line_that_cannot_be_opened(url):
    with pytest.raises(TransportError, match=r"cannot be opened.*Fix"):
        SerialTransport(url)


def test_a_port_is_opened_once_only():
    far, near = pty.openpty()
    first = SerialTransport(os.ttyname(near))
    with pytest.raises(TransportError, match=r"cannot be opened: .*lock.*no other program"):
        SerialTransport(os.ttyname(near))
    first.close()
    SerialTransport(os.ttyname(near)).close()
    os.close(far)
    os.close(near)


def test_full_line_is_a_loss_and_no_long_wait():
    far, near = pty.openpty()
    transport = SerialTransport(os.ttyname(near))
    start = time.monotonic()
    with pytest.raises(TransportError, match="gone"):
        transport.write(bytes(1 << 20))  # nobody reads
    assert time.monotonic() - start < 1.0
    transport.close()
    os.close(far)
    os.close(near)


class SettingsPort:
    """What an RFC 2217 server sets on the port behind it."""

    def __init__(self):
        self.baudrate, self.bytesize, self.parity, self.stopbits = 9600, 7, "O", 2
        self.rts = self.dtr = False
        self.cts = self.dsr = self.ri = self.cd = True
        self.xonxoff = self.rtscts = self.dsrdtr = False
        self.break_condition = False

    def reset_input_buffer(self):
        """Nothing is held."""

    def reset_output_buffer(self):
        """Nothing is held."""


@pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")  # pyserial's own
@pytest.mark.parametrize(
    ("opener", "settings"),
    [(SerialTransport, (115200, 8, "N", 1)), (meter_transport, (19200, 8, "E", 1))],
)
def test_settings_reach_the_port(opener, settings):
    port, stop = SettingsPort(), threading.Event()
    server = socket.create_server(("127.0.0.1", 0))

    def serve():
        connection, _ = server.accept()
        connection.settimeout(0.05)

        class Writer:
            def write(self, data):
                connection.sendall(data)

        manager = serial.rfc2217.PortManager(port, Writer())
        with connection:
            while not stop.is_set():
                try:
                    data = connection.recv(1024)
                except TimeoutError:
                    continue
                if not data:
                    return
                list(manager.filter(data))

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        transport = opener(f"rfc2217://127.0.0.1:{server.getsockname()[1]}")
        assert (port.baudrate, port.bytesize, port.parity, port.stopbits) == settings
        transport.close()
    finally:
        stop.set()
        thread.join()
        server.close()
