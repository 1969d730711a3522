"""The TMD-56 as an emulated device on a line: requests in, 14-byte answers out."""

from collections import deque
from collections.abc import Callable

import numpy as np

from muscle_bayes.bench.meters.meter import REQUEST, format_answer
from muscle_bayes.twin.plant.rig import Meter
from muscle_bayes.twin.sensors import ThermocoupleMeter

_BYTE_TIME = 11 / 19200
"""Of one byte at 19200 8E1, s."""
_THINKING = 0.012
"""From a request's end to the answer's first byte, s."""


class MeterEmulator:
    """Answers each request with its newest reading, taken every 0.4 s or so at 0.1 C.

    Faults: `silent` gives no answers; `frozen` repeats the last reading for ever; from the next
    reading on, `open_channels` shows OL and `forced` these temperatures [C] instead of the true ones;
    `shows` makes what is measured from time [s] and true temperatures [C].
    """

    def __init__(self, meter: Meter, generator: np.random.Generator) -> None:
        self.silent = False
        self.frozen = False
        self.open_channels = (False, False)
        self.forced: tuple[float | None, float | None] = (None, None)
        self.shows: Callable[[float, tuple[float, float]], tuple[float, float]] | None = None
        self._thermocouples = ThermocoupleMeter(meter, generator)
        self._shown: tuple[float | None, float | None] = (None, None)
        self._time = 0.0
        self._asked = b""
        self._answers: deque[tuple[float, bytes]] = deque()

    def step(self, time: float, temperatures: tuple[float, float]) -> None:
        """Let time go to `time` [s] with these true temperatures [C]."""
        self._time = time
        if self.frozen:
            return
        if self.shows is not None:
            temperatures = self.shows(time, temperatures)
        self._thermocouples.updated = False
        self._thermocouples.poll(time, temperatures)
        if self._thermocouples.updated:
            self._shown = self._measured()

    def send(self, data: bytes) -> None:
        """Bytes from the host."""
        self._asked += data
        *requests, self._asked = self._asked.split(REQUEST)
        self._asked = self._asked[-len(REQUEST) :]
        for _ in requests:
            if not self.silent:
                answer = format_answer(self._shown)
                due = self._time + (len(REQUEST) + len(answer)) * _BYTE_TIME + _THINKING
                self._answers.append((due, answer))

    def receive(self, max_bytes: int) -> bytes:
        """Answers that are due; none is ever cut."""
        data = b""
        while self._answers and self._answers[0][0] <= self._time:
            data += self._answers.popleft()[1]
        return data

    def _measured(self) -> tuple[float | None, float | None]:
        readings = self._thermocouples.readings
        first, second = (
            None if is_open else reading if forced is None else forced
            for is_open, reading, forced in zip(
                self.open_channels, readings, self.forced, strict=True
            )
        )
        return first, second
