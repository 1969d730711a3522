"""Which port is what: boards and meter found by what they answer, or given."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Final

from muscle_bayes.bench.boards.board import Board, BoardError
from muscle_bayes.bench.boards.clock import Clock, RealClock
from muscle_bayes.bench.boards.link import Devices, Link
from muscle_bayes.bench.boards.messages import Role
from muscle_bayes.bench.boards.transport import SerialTransport, TransportError
from muscle_bayes.bench.meters.board_meter import BoardMeter
from muscle_bayes.bench.meters.meter import (
    FIRST,
    MeterError,
    MeterSource,
    OpenMeter,
    first_reading,
    kinds,
    open_tmd56,
    split,
)
from muscle_bayes.bench.sensors.catalogue import thermometer_of
from muscle_bayes.errors import MuscleBayesError

BOARD_TIME: Final = 3.0
"""Opening a port resets an Uno, and its boot loader comes first, s."""
METER_TIME: Final = 2.0
BOARD: Final = "board"
"""In place of a meter's URL: the heater board's own thermometers."""

_NAMES: Final = {Role.SENSOR: "sensor board", Role.HEATER: "heater board"}


def serial_ports() -> list[str]:
    """Ports of this machine that may have a device on them: all that are on USB, else all."""
    from serial.tools.list_ports import comports

    ports = list(comports())
    on_usb = [port.device for port in ports if port.vid is not None]
    return sorted(on_usb or [port.device for port in ports])


@dataclass
class PortFinder:
    """Finds the bench's devices; `boards` and `meter` are URLs that were given, if any."""

    boards: Sequence[str] = ()
    meter: str | None = None
    clock: Clock = field(default_factory=RealClock)
    open_board: Callable[[str], SerialTransport] = SerialTransport
    open_meter: OpenMeter = open_tmd56
    """of the TMD-56"""
    list_ports: Callable[[], list[str]] = serial_ports
    otherwise: str = ""
    """what to do without a bench, where the command can"""
    in_use: dict[str, str] = field(default_factory=dict)
    """name of a device -> its URL"""
    _spare: dict[Role, tuple[str, Board]] = field(default_factory=dict)
    """boards that were met while another was sought, still open"""

    def devices(self) -> Devices:
        """Links to both boards and the meter, not open yet."""
        heater = Link("heater board", lambda: self.board(Role.HEATER), self.clock)

        def meter() -> MeterSource:
            board = heater.device
            own = board is not None and thermometer_of(board.wiring()) is not None
            by_board = self.meter == BOARD or (self.meter is None and own)
            return BoardMeter(heater, self.clock) if by_board else self.find_meter()

        return Devices(
            sensor=Link("sensor board", lambda: self.board(Role.SENSOR), self.clock),
            heater=heater,
            meter=Link("meter", meter, self.clock),
            clock=self.clock,
        )

    def board(self, role: Role) -> Board:
        """The board of a role, opened. Raises MuscleBayesError, or BoardError of the one port given."""
        name = _NAMES[role]
        if role in self._spare:
            self.in_use[name], board = self._spare.pop(role)
            return board
        tried: list[str] = []
        for url in self._candidates(name, self.boards):
            try:
                board = self._identified(url)
            except (TransportError, BoardError) as error:
                if self.boards:
                    tried.append(str(error))
                else:
                    tried.append(f"{url}: no board")
                continue
            assert board.identity is not None
            if board.identity.role == role:
                self.in_use[name] = url
                return board
            met = board.identity.role
            tried.append(f"{url}: a {_NAMES[met]}")
            if met in self._spare or _NAMES[met] in self.in_use:
                board.close()
            else:
                self._spare[met] = (url, board)
        raise MuscleBayesError(
            f"no {name} was found ({'; '.join(tried) or 'there is no port'}). Fix: connect the "
            "board and load the firmware, or give --port. Only a heater board has pin 4 tied to "
            f"GND.{self.otherwise}"
        )

    def find_meter(self) -> MeterSource:
        """The meter, opened and polled by its thread. Raises MuscleBayesError."""
        kind, given = FIRST, tuple[str, ...]()
        if self.meter is not None:
            kind, url = split(self.meter)
            given = (url,)
        opens = self.open_meter if kind == FIRST else kinds()[kind]
        tried: list[str] = []
        for url in self._candidates("meter", given):
            try:
                meter = opens(url, self.clock)
            except MuscleBayesError as error:
                tried.append(str(error))
                continue
            try:
                first_reading(meter, self.clock, METER_TIME)
            except MeterError as error:
                tried.append(f"{url}: {error}" if given else f"{url}: no meter")
                meter.close()
                continue
            self.in_use["meter"] = url
            return meter
        raise MuscleBayesError(
            f"no meter was found ({'; '.join(tried) or 'there is no port'}). Fix: connect the "
            "TMD-56 and switch on its link, or give --meter. A heater board with thermometers of "
            f"its own needs none (`muscle-bayes sensors`).{self.otherwise}"
        )

    def _identified(self, url: str) -> Board:
        board = Board(self.open_board(url), self.clock, f"board on {url}")
        try:
            board.identify(BOARD_TIME)
        except BaseException:
            board.close()
            raise
        return board

    def _candidates(self, name: str, given: Sequence[str]) -> list[str]:
        """Where to look: where it was before, then what was given or every port not in use."""
        before = self.in_use.pop(name, None)
        taken = {*self.in_use.values(), *(url for url, _ in self._spare.values())}
        found: list[str] = list(given)
        if not given:
            with suppress(OSError):
                found = self.list_ports()
            found = [url for url in found if url != self.meter]
        first = [] if before is None else [before]
        return [*first, *(url for url in found if url not in taken and url != before)]
