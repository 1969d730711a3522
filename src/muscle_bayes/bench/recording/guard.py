"""What may go wrong with the lines while a run is recorded, and what is done about it.

The rule: whatever part of the loop is missing, the heaters go off at once; a line that comes back is
taken up again; what a person has to look at ends the run.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

from muscle_bayes.bench.boards.board import Board, BoardError
from muscle_bayes.bench.boards.link import Devices, Link
from muscle_bayes.bench.boards.messages import Fault, explain
from muscle_bayes.bench.boards.protocol import Boot
from muscle_bayes.bench.boards.samples import SampleStream, Tell, TimedSample
from muscle_bayes.bench.heat.heating import Heating, most_rise
from muscle_bayes.bench.meters.meter import MeterError
from muscle_bayes.bench.sequences.sequence import Limits
from muscle_bayes.errors import MuscleBayesError

MOST_RECOVERIES: Final = 3
"""Times that a run goes on after the heater board's dead-man, reset or absence."""
_STATE_TIME: Final = 1.0
_OFF_TIME: Final = 0.5


class RecordingError(MuscleBayesError):
    """A recording that could not go on; heaters are off and the run is kept."""


class Guard:
    """Keeps the lines up and the heaters off while one is down."""

    def __init__(
        self,
        devices: Devices,
        stream: SampleStream,
        heating: Heating,
        limits: Limits,
        tell: Tell,
        room: float,
    ) -> None:
        """`room` in C."""
        self.troubles: tuple[str, ...] = ()
        """what keeps the heaters off now"""
        self.recoveries = 0
        self.fan = False
        """whether the fan is wanted on"""
        self._devices = devices
        self._stream = stream
        self._heating = heating
        self._limits = limits
        self._room = room
        self._tell = tell
        self._since: float | None = None
        self._boot: int | None = None

    def start(self) -> None:
        """Prepare open devices. Raises MuscleBayesError."""
        sensor, heater = self._devices.sensor.device, self._devices.heater.device
        assert sensor is not None
        assert heater is not None
        self._prepare(heater)
        self._stream.start(sensor)

    def listen(self) -> list[TimedSample]:
        """Take what meter and sensor board have sent; the samples."""
        meter, sensor = self._devices.meter, self._devices.sensor
        samples: list[TimedSample] = []
        if meter.device is not None:
            with self._lost_on_error(meter):
                meter.device.poll()
                self._heating.trust(meter.device)
                self._heating.take(meter.device.latest)
        if sensor.device is not None:
            with self._lost_on_error(sensor):
                samples = self._stream.poll(sensor.device)
        return samples

    def look(self, now: float) -> bool:
        """Judge readings, heater board and lines; True where control was lost and begins anew.

        Raises RecordingError.
        """
        recoveries, troubled = self.recoveries, self._since is not None
        self._judge_readings(now)
        self._read_heater()
        self._judge(now)
        return self.recoveries > recoveries or (troubled and self._since is None)

    def command(self, duties: tuple[int, int]) -> None:
        """Set the duties and report the temperatures."""
        link = self._devices.heater
        if link.device is None:
            return
        with self._lost_on_error(link):
            link.device.command_duty(*duties, *self._heating.temperatures)
            self._heating.fan = self.fan
            if link.device.fan != self.fan:
                link.device.command_fan(self.fan)

    def recover(self, now: float) -> None:
        """Open again what is away and restart what stalls; call it with the heaters off."""
        sensor, heater, meter = self._devices.sensor, self._devices.heater, self._devices.meter
        with self._lost_on_error(sensor):
            if sensor.device is None:
                if (board := sensor.retry()) is not None:
                    self._tell("sensor board is back")
                    self._stream.start(board)
            elif self._stream.stalled(now):
                self._stream.restart(sensor.device)
        with self._lost_on_error(heater):
            if heater.device is None and (board := heater.retry()) is not None:
                self._tell("heater board is back")
                self._count("the heater board was away")
                self._prepare(board)
        if meter.device is None and meter.retry() is not None:
            self._tell("meter is back")

    def heaters_off(self) -> bool:
        """Switch off, end the stream, and tell whether the heater board has said that it is off."""
        off = self._request(self._devices.heater, "OFF")
        self._request(self._devices.sensor, "STREAM", 0)
        return off

    def _request(self, link: Link[Board], verb: str, *arguments: int) -> bool:
        """Whether the board has answered; one that does not is let go."""
        if link.device is None:
            return False
        try:
            link.device.request(verb, *arguments, timeout=_OFF_TIME)
        except MuscleBayesError as error:
            link.lose(error)
            return False
        return True

    def _judge_readings(self, now: float) -> None:
        self._heating.judge(now)
        if (alarm := self._heating.alarm) is not None:
            raise RecordingError(alarm)
        if self._heating.hottest > self._limits.max_temperature:
            raise RecordingError(
                f"{self._heating.hottest:.1f} C is above limits.max_temperature, "
                f"{self._limits.max_temperature:g} C"
            )

    def _read_heater(self) -> None:
        link = self._devices.heater
        if link.device is None:
            return
        with self._lost_on_error(link):
            for message in link.device.poll():
                if isinstance(message, Boot) and message.identity.boot != self._boot:
                    identity = message.identity
                    cause = identity.cause.name or "unknown"
                    self._tell("heater board reset", boot=identity.boot, cause=cause)
                    self._count("the heater board was reset")
                    self._prepare(link.device)
            self._treat_faults(link.device)

    def _prepare(self, board: Board) -> None:
        """Heaters off, faults treated, limits set. Raises BoardError and RecordingError."""
        clock = self._devices.clock
        self._boot = None if board.identity is None else board.identity.boot
        board.heat = None
        board.command_duty(0, 0, *self._heating.temperatures)
        end = clock.now() + _STATE_TIME
        while board.heat is None and clock.now() < end:
            clock.sleep(0.005)
            board.poll()
        self._treat_faults(board)
        self._heating.calibrate(board.tubes())
        rise = most_rise(self._room)
        wanted = (self._limits.max_duty, rise, self._limits.max_temperature)
        if any(got < least - 0.05 for got, least in zip(board.limit(*wanted), wanted, strict=True)):
            duty, rise, temperature = board.limit(*wanted)
            raise RecordingError(
                f"the heater board holds to tighter limits than the sequence's: duty {duty}, "
                f"{temperature:g} C, {rise:g} C above the room. Fix: press its reset "
                "button, or lower the sequence's limits"
            )

    def _treat_faults(self, board: Board) -> None:
        faults = board.faults
        if not faults:
            return
        self._tell("heater faults", faults=int(faults), meaning=explain(faults))
        if faults != Fault.DEADMAN:
            raise RecordingError(
                f"the heater board has switched its heaters off: {explain(faults)}. Fix: look for "
                "the cause, then record again with --clear-faults"
            )
        # The host was away and is back, and the board did what it should.
        self._count(explain(faults))
        board.clear()

    def _count(self, why: str) -> None:
        self.recoveries += 1
        if self.recoveries > MOST_RECOVERIES:
            raise RecordingError(f"{why}; more than {MOST_RECOVERIES} times in this run")

    def _judge(self, now: float) -> None:
        devices = self._devices
        found = [
            f"the {link.name} is away: {link.problem}"
            for link in (devices.sensor, devices.heater, devices.meter)
            if link.device is None
        ]
        if devices.sensor.device is not None and self._stream.stalled(now):
            found.append("the sensor board sends no samples. Fix: check cable and power.")
        if devices.meter.device is not None and (trouble := self._heating.trouble):
            found.append(trouble)
        if found and self._since is None:
            self._since = now
            self._tell("trouble", what=found)
        elif not found and self._since is not None:
            self._tell("trouble over", after=round(now - self._since, 3))
            self._since = None
        self.troubles = tuple(found)
        if self._since is not None and now - self._since > self._limits.reconnect_time:
            lasted = now - self._since
            raise RecordingError(f"{found[0].rstrip('.')}. It lasted {lasted:.0f} s")

    @contextmanager
    def _lost_on_error(self, link: Link[Any]) -> Iterator[None]:
        """Let a line go, and tell so, where its device fails."""
        try:
            yield
        except (BoardError, MeterError) as error:
            self._tell(f"{link.name} lost", why=str(error))
            link.lose(error)
