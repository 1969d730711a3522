"""The heater board's own thermometers as a meter."""

from typing import Final

from muscle_bayes.bench.boards.board import Board, BoardError
from muscle_bayes.bench.boards.clock import Clock
from muscle_bayes.bench.boards.link import Link
from muscle_bayes.bench.meters.meter import MeterError, Reading
from muscle_bayes.bench.sensors.catalogue import thermometer_of

PERIOD: Final = 0.03
"""s between two questions."""
MOVED_WITHIN: Final = {"max6675": 0.19}
"""s of hard heating after which a thermometer must show other digits; the board looks at a MAX6675 every
0.22 s, at others every 0.11 s. With the board's look and the host's question that is under 0.5 s."""

AGE: Final = {"max6675": 0.125, "max31855": 0.09}
"""s since the middle of the conversion that a look of the board finds; next to nothing of a thermistor. A
MAX6675 converts, 0.17 to 0.22 s long, once it has been read: the look comes 0.22 s after the conversion's
beginning. A MAX31855 converts on and on, 0.07 to 0.1 s long: what is found ended half a conversion ago."""
STEP: Final = {"max31855": 0.25, "max6675": 0.25}
"""C between the values of a chip. The board tells tenths, each of which is that of one value alone."""


class BoardMeter:
    """Asks the heater board what its own thermometers show; polled by its owner, never waits."""

    garbled = 0

    def __init__(self, heater: Link[Board], clock: Clock) -> None:
        """Raises MeterError where the board is away or has no thermometers."""
        self._heater = heater
        self._clock = clock
        self.latest: Reading | None = None
        self._asked: float | None = None
        self._due = clock.now()
        try:
            wiring = self._board().wiring()
        except BoardError as error:
            raise MeterError(f"heater board: {error}") from None
        name = thermometer_of(wiring)
        if name is None:
            raise MeterError(
                "the heater board has no thermometers of its own. Fix: wire them (docs/bench.md) "
                "and tell the board, e.g. `muscle-bayes sensors max31855`; or use a meter."
            )

        self._age = AGE.get(name, 0.0)
        self.moved_within = MOVED_WITHIN.get(name, 0.25)
        self._step = STEP.get(name)

    def poll(self) -> None:
        """Raises MeterError where the board is away."""
        board = self._board()
        try:
            board.collect()
            if (shown := board.take_temperatures()) is not None:
                values = self._exact(shown[0]), self._exact(shown[1])
                self.latest = Reading(self._clock.now(), values, self._asked)
            if self._clock.now() >= self._due:
                self._asked = self._clock.now() - self._age
                self._due = self._clock.now() + PERIOD
                board.ask_temperatures()
        except BoardError as error:
            raise MeterError(f"heater board: {error}") from None

    def close(self) -> None:
        """The line is the board's."""

    def _exact(self, told: float | None) -> float | None:
        """What a chip showed [C], from the tenths that the board tells."""
        if told is None or self._step is None:
            return told
        return round(told / self._step) * self._step

    def _board(self) -> Board:
        if self._heater.device is None:
            raise MeterError("the heater board is away, and its thermometers with it")
        return self._heater.device
