"""The firmware's logic, compiled for this machine: one bench that is fed bytes and milliseconds."""

import ctypes
from pathlib import Path

from muscle_bayes.bench.boards.protocol import Decoder, Message, encode

OLD_NOTHING, OLD_PROMPT, OLD_WRITE, OLD_DIGITAL_READ, OLD_ANALOG_READ = range(5)


class HostFirmware:
    """Time passes in `tick` alone."""

    def __init__(
        self,
        build: Path,
        *,
        cause: int = 1,
        was_heating: bool = False,
        heater: bool = True,
        boot: int = 7,
        library: str = "libbench_host.so",
    ) -> None:
        self._library = ctypes.CDLL(str(build / library))
        self._library.host_size.restype = ctypes.c_size_t
        self._bench = ctypes.create_string_buffer(self._library.host_size())
        self._text = ctypes.create_string_buffer(256)
        self._decoder = Decoder()
        self._library.host_start(self._bench, cause, ctypes.c_bool(was_heating), int(heater), boot)
        self.greeting = self.text()

    def text(self) -> bytes:
        """What it wants to send."""
        length = self._library.host_take(self._bench, self._text)
        return self._text.raw[:length]

    def feed(self, data: bytes) -> bytes:
        """Bytes in; what is sent meanwhile."""
        sent = b""
        for byte in data:
            self._library.host_byte(self._bench, byte)
            sent += self.text()
        return sent

    def ask(self, verb: str, *arguments: int | None, sequence: int = 1) -> list[Message]:
        """Messages that follow a command."""
        return self._decoder.feed(self.feed(encode(sequence, verb, *arguments)))

    def tick(self, milliseconds: int = 1) -> bytes:
        """Let time pass; what is sent meanwhile."""
        sent = b""
        for _ in range(milliseconds):
            self._library.host_tick(self._bench)
            sent += self.text()
        return sent

    def sample(self, micros: int, adc: int) -> bytes:
        """A conversion; what is sent upon it."""
        self._library.host_sample(self._bench, ctypes.c_uint32(micros), adc)
        return self.text()

    def old(self, *numbers: int) -> bytes:
        """Answer the old protocol's prompts with numbers, unterminated as the old scripts do."""
        sent = b""
        for number in numbers:
            sent += self.tick(2) + self.feed(str(number).encode()) + self.tick(4)
        return sent

    @property
    def duties(self) -> tuple[int, int]:
        return self._library.host_duty(self._bench, 0), self._library.host_duty(self._bench, 1)

    @property
    def faults(self) -> int:
        return int(self._library.host_faults(self._bench))

    @property
    def wanted_pin(self) -> tuple[int, int]:
        """What the old protocol asks of the board: action and pin."""
        return self._library.host_pin_action(self._bench), self._library.host_pin(self._bench)

    def pin_value(self, value: int) -> bytes:
        self._library.host_pin_value(self._bench, value)
        return self.text()

    def calibrate(self, channel: int, gain: int, cooling: int) -> None:
        """Tube `channel` has this calibration, or none (gain 0)."""
        self._library.host_tube(self._bench, channel, gain, cooling)

    def thermal(self, channel: int) -> tuple[int, ...]:
        """most, least, least_mean, shown, shown_mean, cold, dose and ms of the heat model."""
        states = (ctypes.c_int32 * 8)()
        self._library.host_thermal(self._bench, channel, states)
        return tuple(states)

    def restart(self, *, known: bool, hot: bool, rise: int = 0) -> None:
        """Comes up anew; it remembers that both tubes are `rise` [0.1 C] warm, or that one was hot."""
        self._library.host_restart(self._bench, ctypes.c_bool(known), ctypes.c_bool(hot), rise)
        self.greeting = self.text()

    @property
    def stores(self) -> bool:
        """Whether a calibration was to be stored since the last look."""
        return bool(self._library.host_stores(self._bench) & 1)

    def thermometer(self, kind: int, word: int) -> tuple[int, bool]:
        """Temperature [0.1 C] in what a thermometer gives, and whether it makes sense."""
        sense = ctypes.c_bool()
        self._library.host_thermometer.restype = ctypes.c_int16
        found = self._library.host_thermometer(
            self._bench, kind, ctypes.c_uint32(word), ctypes.byref(sense)
        )
        return int(found), bool(sense)

    @property
    def looks(self) -> int:
        """Bits of the channels whose thermometers are to be looked at."""
        return int(self._library.host_looks(self._bench)) & 0xFF

    def looked(self, channel: int, word: int) -> bytes:
        """What a channel's thermometer gave; what is sent upon it."""
        self._library.host_looked(self._bench, channel, ctypes.c_uint32(word))
        return self.text()

    def internal_fault(self) -> bytes:
        self._library.host_internal_fault(self._bench)
        return self.text()

    def crc(self, data: bytes) -> int:
        self._library.host_crc.restype = ctypes.c_uint16
        return int(self._library.host_crc(data, ctypes.c_size_t(len(data))))
