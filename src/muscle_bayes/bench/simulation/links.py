"""Lines between the host and what is simulated, and what can happen to them."""

from collections.abc import Callable

from muscle_bayes.bench.boards.transport import TransportError
from muscle_bayes.bench.simulation.meter import MeterEmulator
from muscle_bayes.bench.simulation.processor import Processor


class Link:
    """The host's end of a line: a Transport, with faults to inject.

    `garble_to` and `garble_from` change the bytes on the way to and from the device; `deaf` loses
    what the host sends. A pulled cable raises TransportError at the host; `plug` puts it in again
    and opens the port, which `opened` hears: that resets an Arduino.
    """

    def __init__(
        self,
        device: Processor | MeterEmulator,
        name: str,
        opened: Callable[[], None] = lambda: None,
    ) -> None:
        self.name = name
        self._opened = opened
        self.garble_to: Callable[[bytes], bytes] | None = None
        self.garble_from: Callable[[bytes], bytes] | None = None
        self.deaf = False
        self.plugged = True
        self._device = device
        self._rest = b""

    def read(self, max_bytes: int) -> bytes:
        self._check()
        data = self._rest
        if not data:
            data = self._device.receive(max_bytes)
            if self.garble_from is not None:
                data = self.garble_from(data)
        data, self._rest = data[:max_bytes], data[max_bytes:]
        return data

    def write(self, data: bytes) -> None:
        self._check()
        if self.deaf:
            return
        self._device.send(data if self.garble_to is None else self.garble_to(data))

    def close(self) -> None:
        """Nothing is held."""

    def pull(self) -> None:
        """Pull the cable."""
        self.plugged = False

    def plug(self) -> None:
        """Put the cable in again and open the port."""
        self._device.receive(1 << 16)
        self._opened()
        self._rest = b""
        self.plugged = True

    def _check(self) -> None:
        if not self.plugged:
            raise TransportError(
                f"{self.name}: the line is gone: the simulated cable is pulled. Fix: plug it in."
            )
