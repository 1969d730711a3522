"""A fake bench served in real time: boards on ptys, the meter on a socket."""

import os
import pty
import select
import socket
import threading
import time
import tty

from fake_bench import FakeBench


class ServedBench:
    """Lives in a thread; `ports` and `meter` are URLs for the command line."""

    def __init__(self):
        self.bench = FakeBench()
        self._lines = {}
        self._stop = threading.Event()
        for name in ("sensor", "heater"):
            far, near = pty.openpty()
            tty.setraw(near)
            self._lines[name] = (far, near)
        self.ports = [os.ttyname(near) for _, near in self._lines.values()]
        self._server = socket.create_server(("127.0.0.1", 0))
        self.meter = f"socket://127.0.0.1:{self._server.getsockname()[1]}"
        self._meter = None
        self._thread = threading.Thread(target=self._serve)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join()
        for name in list(self._lines):
            self.pull(name)
        if self._meter is not None:
            self._meter.close()
        self._server.close()

    def pull(self, name):
        """Close both ends of a board's line."""
        for descriptor in self._lines.pop(name):
            os.close(descriptor)

    @property
    def heating(self):
        return any(self.bench.heater.duties)

    def wait(self, condition, seconds=60.0):
        """Whether a condition holds within some seconds."""
        end = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > end:
                return False
            time.sleep(0.005)
        return True

    def _serve(self):
        start = time.monotonic()
        while not self._stop.is_set():
            time.sleep(0.001)
            self.bench.clock.sleep(time.monotonic() - start - self.bench.clock.now())
            for name, (far, _) in list(self._lines.items()):
                board = getattr(self.bench, name)
                if select.select([far], [], [], 0)[0]:
                    board.received(os.read(far, 4096))
                if board.out:
                    sent = os.write(far, board.out)
                    board.out = board.out[sent:]
            self._serve_meter()

    def _serve_meter(self):
        if self._meter is None:
            if select.select([self._server], [], [], 0)[0]:
                self._meter, _ = self._server.accept()
            return
        try:
            if not self._exchange(self._meter):
                raise ConnectionError
        except OSError:  # the host went, in whichever way
            self._meter.close()
            self._meter = None

    def _exchange(self, line):
        """Pass bytes on both ways; whether the line stands."""
        meter = self.bench.meter
        if select.select([line], [], [], 0)[0]:
            if not (data := line.recv(64)):
                return False
            meter.received(data)
        if meter.out:
            line.sendall(meter.out)
            meter.out = b""
        return True
