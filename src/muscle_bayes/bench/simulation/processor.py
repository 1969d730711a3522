"""One ATmega328P in virtual time, by libsimavr behind firmware/simavr/bridge.c."""

import ctypes
import os
import struct
from ctypes import (
    POINTER,
    c_char_p,
    c_double,
    c_int,
    c_int64,
    c_uint8,
    c_uint16,
    c_uint32,
    c_uint64,
)
from dataclasses import astuple
from functools import cache
from math import ceil
from pathlib import Path
from typing import Final, Self

from muscle_bayes.bench.boards.messages import ResetCause
from muscle_bayes.bench.boards.protocol import crc16
from muscle_bayes.bench.boards.transport import BOARD_BAUD
from muscle_bayes.bench.heat.heat_model import TubeModel
from muscle_bayes.bench.sensors.catalogue import Wiring
from muscle_bayes.errors import MuscleBayesError

_VARIABLE = "MUSCLE_BAYES_FIRMWARE"
_BESIDE_THE_SOURCE = Path(__file__).parents[4] / "firmware" / "build"


def built(name: str) -> Path:
    """A file of the firmware's build folder. Raises MuscleBayesError where it is absent."""
    folder = Path(os.environ.get(_VARIABLE, _BESIDE_THE_SOURCE))
    path = folder / name
    if not path.is_file():
        raise MuscleBayesError(
            f"{path}: the firmware is not built. Fix: run `make firmware` in the project's folder "
            f"(it needs gcc-avr, avr-libc and libsimavr-dev), or point {_VARIABLE} to its build "
            "folder."
        )
    return path


FREQUENCY: Final = 16_000_000
"""Processor clock, Hz."""
CYCLES_PER_MS: Final = FREQUENCY // 1000
ROLE_PIN: Final = 4
"""Pin of port D that is tied to ground on a heater board."""
_TUBE_CELLS = 8
"""Address in EEPROM of the tubes' calibration (board_avr.c)."""
_WIRING_CELLS = 32
"""The same of what the inputs are wired to."""
_SUPPLY_MV = 5000
_FULL_SCALE = 1023

_SIGNATURES: Final = {
    "bridge_open": ([c_char_p, c_uint32, c_uint32], ctypes.c_void_p),
    "bridge_close": ([ctypes.c_void_p], None),
    "bridge_run": ([ctypes.c_void_p, c_uint64], None),
    "bridge_cycle": ([ctypes.c_void_p], c_uint64),
    "bridge_duty": ([ctypes.c_void_p, c_int], c_int),
    "bridge_duty_cycles": ([ctypes.c_void_p, c_int], c_double),
    "bridge_peak": ([ctypes.c_void_p, c_int], c_int),
    "bridge_send": ([ctypes.c_void_p, c_char_p, c_uint32], c_uint32),
    "bridge_unsent": ([ctypes.c_void_p], c_uint32),
    "bridge_drop_unsent": ([ctypes.c_void_p], None),
    "bridge_receive": ([ctypes.c_void_p, POINTER(c_uint8), c_uint32], c_uint32),
    "bridge_next_conversion": ([ctypes.c_void_p], c_uint64),
    "bridge_analog": ([ctypes.c_void_p, c_int, c_uint32], None),
    "bridge_ground_pin_d": ([ctypes.c_void_p, c_int], None),
    "bridge_chip": ([ctypes.c_void_p, c_int, c_uint32, c_int], None),
    "bridge_chip_reads": ([ctypes.c_void_p, c_int], c_uint32),
    "bridge_load": ([ctypes.c_void_p, c_uint32, c_int], None),
    "bridge_encoder": ([ctypes.c_void_p, c_int64], None),
    "bridge_fan": ([ctypes.c_void_p], c_int),
    "bridge_reset": ([ctypes.c_void_p, c_uint8, c_int], None),
    "bridge_hang": ([ctypes.c_void_p, c_int], None),
    "bridge_jump": ([ctypes.c_void_p, c_uint32], None),
    "bridge_poke": ([ctypes.c_void_p, c_uint16, c_uint8], None),
    "bridge_peek": ([ctypes.c_void_p, c_uint16], c_uint8),
    "bridge_eeprom": ([ctypes.c_void_p, c_uint16, c_char_p, c_uint32], None),
    "bridge_program_size": ([ctypes.c_void_p], c_uint32),
}


@cache
def _library() -> ctypes.CDLL:
    path = built("libbench_simavr.so")
    try:
        library = ctypes.CDLL(str(path))
    except OSError as error:
        raise MuscleBayesError(
            f"{path}: cannot be loaded: {error}. Fix: install libsimavr2 and libelf1, or build "
            "it anew with `make firmware`."
        ) from None
    for name, (arguments, result) in _SIGNATURES.items():
        function = getattr(library, name)
        function.argtypes, function.restype = arguments, result
    return library


class Processor:
    """The firmware, its serial line and its pins. Time passes only in `run`."""

    def __init__(self, *, heater: bool, elf: Path | None = None) -> None:
        path = elf or built("muscle_bench.elf")
        self._library = _library()
        self._bridge: int | None = self._library.bridge_open(
            str(path).encode(), FREQUENCY, BOARD_BAUD
        )
        if self._bridge is None:
            raise MuscleBayesError(f"{path}: simavr cannot load it. Fix: run `make firmware`.")
        self._buffer = (c_uint8 * 4096)()
        self._target = 0
        self._duty_cycles = (0.0, 0.0)
        if heater:
            self._library.bridge_ground_pin_d(self._bridge, ROLE_PIN)

    def run(self, milliseconds: int) -> tuple[float, float]:
        """Let time pass; mean duty (0-255) of both heater pins over it."""
        cycles, before = milliseconds * CYCLES_PER_MS, self._duty_cycles
        self.run_cycles(cycles)
        first, second = (self._library.bridge_duty_cycles(self._bridge, pin) for pin in (0, 1))
        self._duty_cycles = (first, second)
        return (first - before[0]) / cycles, (second - before[1]) / cycles

    def run_cycles(self, cycles: int) -> None:
        """Let time pass."""
        self._target += cycles
        self._library.bridge_run(self._bridge, self._target)

    @property
    def cycle(self) -> int:
        """Processor cycles since power-on."""
        return int(self._library.bridge_cycle(self._bridge))

    @property
    def duties(self) -> tuple[int, int]:
        """Duty (0-255) of both heater pins now, from the registers that drive them."""
        library, bridge = self._library, self._bridge
        return library.bridge_duty(bridge, 0), library.bridge_duty(bridge, 1)

    def peaks(self) -> tuple[int, int]:
        """Highest duty of both heater pins since the last call, however short."""
        library, bridge = self._library, self._bridge
        return library.bridge_peak(bridge, 0), library.bridge_peak(bridge, 1)

    def send(self, data: bytes) -> None:
        """Put bytes on the line to the board; they arrive at 115200 baud."""
        taken = self._library.bridge_send(self._bridge, data, len(data))
        if taken != len(data):
            raise MuscleBayesError(
                f"{len(data)} bytes are too many at once. Fix: let time pass between them."
            )

    @property
    def unsent(self) -> int:
        """Bytes still on the line to the board."""
        return int(self._library.bridge_unsent(self._bridge))

    def drop_unsent(self) -> None:
        """Lose what is on the line to the board."""
        self._library.bridge_drop_unsent(self._bridge)

    def receive(self, max_bytes: int = 4096) -> bytes:
        """Bytes that the board has sent."""
        room = min(max_bytes, len(self._buffer))
        count = self._library.bridge_receive(self._bridge, self._buffer, room)
        return bytes(self._buffer[:count])

    def conversions(self) -> list[int]:
        """Cycles at which the converter was started since the last call; 4096 are kept."""
        started = []
        while cycle := self._library.bridge_next_conversion(self._bridge):
            started.append(int(cycle))
        return started

    def set_analog(self, counts: float, channel: int = 0) -> None:
        """Put the voltage on an analog input that converts to that many counts."""
        millivolts = ceil(counts * _SUPPLY_MV / _FULL_SCALE)
        self._library.bridge_analog(self._bridge, channel, millivolts)

    def set_chip(self, channel: int, word: int, bits: int) -> None:
        """A channel's thermometer chip sends this word from now on; 0 bits: it is gone."""
        self._library.bridge_chip(self._bridge, channel, word, bits)

    def chip_reads(self, channel: int) -> int:
        """How often a channel's thermometer chip has been read."""
        return int(self._library.bridge_chip_reads(self._bridge, channel))

    def set_load_cell(self, word: int | None) -> None:
        """24 bits of the load cell's next conversions; None: its converter is gone."""
        self._library.bridge_load(self._bridge, word or 0, int(word is not None))

    def turn_encoder(self, count: int) -> None:
        """Turn the encoder to a count, edge by edge."""
        self._library.bridge_encoder(self._bridge, count)

    @property
    def fan(self) -> bool:
        """Whether the fan's pin is high."""
        return bool(self._library.bridge_fan(self._bridge))

    def reset(self, cause: ResetCause) -> None:
        """Reset; with power-on, RAM is lost too."""
        self._library.bridge_reset(self._bridge, int(cause), int(ResetCause.POWER_ON in cause))

    def hang(self, *, interrupts: bool) -> None:
        """Send the processor into an endless loop, with interrupts on or off."""
        self._library.bridge_hang(self._bridge, int(interrupts))

    def jump(self, address: int) -> None:
        """Let the processor go on at another byte address of the program."""
        self._library.bridge_jump(self._bridge, address)

    @property
    def program_size(self) -> int:
        """Bytes of flash in use."""
        return int(self._library.bridge_program_size(self._bridge))

    def store_tubes(self, tubes: tuple[TubeModel, TubeModel]) -> None:
        """Put a calibration of the heater tubes into EEPROM; the next boot reads it."""
        cells = b"".join(struct.pack("<HH", tube.gain, tube.cooling) for tube in tubes)
        self.write_eeprom(_TUBE_CELLS, cells + struct.pack("<H", crc16(cells)))

    def store_wiring(self, wiring: Wiring) -> None:
        """Put what the inputs are wired to into EEPROM; the next boot reads it."""
        cells = struct.pack("<5B2H", *astuple(wiring))
        self.write_eeprom(_WIRING_CELLS, cells + struct.pack("<H", crc16(cells)))

    def write_eeprom(self, address: int, cells: bytes) -> None:
        """Put bytes into EEPROM."""
        self._library.bridge_eeprom(self._bridge, address, cells, len(cells))

    def poke(self, address: int, value: int) -> None:
        """Overwrite one byte of data space: registers, ports or RAM."""
        self._library.bridge_poke(self._bridge, address, value)

    def peek(self, address: int) -> int:
        """One byte of data space."""
        return int(self._library.bridge_peek(self._bridge, address))

    def close(self) -> None:
        """Free the simulator."""
        if self._bridge is not None:
            self._library.bridge_close(self._bridge)
            self._bridge = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
