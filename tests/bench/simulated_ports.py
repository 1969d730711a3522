"""The simulated bench on real ports in real time, for programs that open ports."""

import os
import socket
import threading
import time
import tty
from contextlib import suppress
from typing import Final, Self

from muscle_bayes.bench.simulation.bench import SimulatedBench
from muscle_bayes.bench.simulation.links import Link

_PAUSE: Final = 0.002
_MOST_BEHIND: Final = 0.1
"""Wall time that is made up at once, s; a machine that is busier than that slows virtual time."""


class Ports:
    """Boards on pseudo-terminals, the meter on a socket (a pseudo-terminal has no parity).

    `sensor_board`, `heater_board` and `meter` are URLs for pyserial. A thread moves bytes and time.
    """

    def __init__(self, bench: SimulatedBench) -> None:
        self._bench = bench
        self._stop = threading.Event()
        self._server = socket.create_server(("127.0.0.1", 0))
        self._server.setblocking(False)
        self._client: socket.socket | None = None
        self._terminals = [os.openpty() for _ in range(2)]
        for master, slave in self._terminals:
            tty.setraw(slave)
            os.set_blocking(master, False)
        self.sensor_board, self.heater_board = (os.ttyname(slave) for _, slave in self._terminals)
        self.meter = f"socket://127.0.0.1:{self._server.getsockname()[1]}"
        self._thread = threading.Thread(target=self._run, name="simulated ports", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._stop.set()
        self._thread.join()
        for pair in self._terminals:
            for end in pair:
                os.close(end)
        if self._client is not None:
            self._client.close()
        self._server.close()

    def _run(self) -> None:
        last = time.monotonic()
        while not self._stop.wait(_PAUSE):
            now = time.monotonic()
            self._exchange()
            self._bench.clock.sleep(min(now - last, _MOST_BEHIND))
            last = now

    def _exchange(self) -> None:
        links = (self._bench.sensor_board, self._bench.heater_board)
        for link, (master, _) in zip(links, self._terminals, strict=True):
            with suppress(BlockingIOError):
                link.write(os.read(master, 4096))
            data = link.read(4096)
            if data:
                with suppress(BlockingIOError):  # nobody reads: the line's buffer is full
                    os.write(master, data)
        self._exchange_meter(self._bench.meter)

    def _exchange_meter(self, link: Link) -> None:
        with suppress(BlockingIOError):
            self._client = self._server.accept()[0]
            self._client.setblocking(False)
        if self._client is None:
            return
        try:
            with suppress(BlockingIOError):
                link.write(self._client.recv(4096))
            self._client.sendall(link.read(4096))
        except OSError:
            self._client.close()
            self._client = None
