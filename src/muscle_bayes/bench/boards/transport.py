"""Bytes to and from a serial line, and nothing of their meaning."""

from contextlib import suppress
from typing import Any, Final, Protocol

from muscle_bayes.errors import MuscleBayesError

try:
    from termios import error as _termios_error
except ImportError:  # Windows has none
    _termios_error = OSError  # type: ignore[assignment, misc]

LINE_ERRORS: Final = (OSError, _termios_error)
"""What pyserial raises when a line is gone; termios.error is no OSError."""
BOARD_BAUD: Final = 115200
METER_BAUD: Final = 19200
_WRITE_TIMEOUT: Final = 0.2
"""Longest that a write may block, s: shorter than the boards' dead-man time."""


class TransportError(MuscleBayesError):
    """A line that cannot be opened, or that is gone."""


class Transport(Protocol):
    """A line. `read` returns at once with what has come, b"" if nothing has."""

    def read(self, max_bytes: int) -> bytes:
        """At most that many bytes. Raises TransportError where the line is gone."""

    def write(self, data: bytes) -> None:
        """Send all of `data`. Raises TransportError where the line is gone."""

    def close(self) -> None:
        """Release the line; never raises."""


class SerialTransport:
    """A line on any URL that pyserial knows: a port's name, socket://, rfc2217://, loop://.

    A board's unless said: 115200 baud, 8N1.

    What pyserial's `is_open` says is not trusted (it stays true when a cable is pulled), and neither
    is a write that went well (the first to a closed socket does): only a read tells that a line is
    gone, and from then on every call raises.
    """

    def __init__(self, url: str, baudrate: int = BOARD_BAUD, *, parity: str = "N") -> None:
        self.url = url
        self._lost: str | None = None
        try:
            self._port = _opened(url, baudrate, parity)
        except (*LINE_ERRORS, ValueError) as error:
            raise TransportError(
                f"{url}: cannot be opened: {_reason(error)}. Fix: check cable and name, and that "
                "no other program holds the port; `muscle-bayes record --help` lists the options."
            ) from None

    def read(self, max_bytes: int) -> bytes:
        self._refuse_lost()
        try:
            return bytes(self._port.read(max_bytes))
        except LINE_ERRORS as error:
            raise self._gone(error) from None

    def write(self, data: bytes) -> None:
        self._refuse_lost()
        try:
            sent = self._port.write(data)
        except LINE_ERRORS as error:
            raise self._gone(error) from None
        if sent is not None and sent != len(data):
            raise self._gone(OSError(f"only {sent} of {len(data)} bytes were sent"))

    def close(self) -> None:
        held = getattr(self._port, "_socket", None)
        with suppress(*LINE_ERRORS):
            self._port.close()
        if held is not None:  # which pyserial forgets to close where the far end went first
            held.close()
        self._lost = self._lost or "closed"

    def _refuse_lost(self) -> None:
        if self._lost is not None:
            raise TransportError(f"{self.url}: the line is gone: {self._lost}.")

    def _gone(self, error: BaseException) -> TransportError:
        self._lost = _reason(error)
        return TransportError(
            f"{self.url}: the line is gone: {self._lost}. Fix: check the cable and the power."
        )


def _opened(url: str, baudrate: int, parity: str) -> Any:
    import serial

    settings: dict[str, Any] = {"baudrate": baudrate, "parity": parity, "timeout": 0}
    settings["exclusive"] = True  # two programs on one heater board would fight
    if not url.lower().startswith("rfc2217:"):  # pyserial has none there
        settings["write_timeout"] = _WRITE_TIMEOUT
    return serial.serial_for_url(url, **settings)


def meter_transport(url: str) -> SerialTransport:
    """The line of the TMD-56: 19200 baud, 8E1. Raises TransportError."""
    return SerialTransport(url, METER_BAUD, parity="E")


def _reason(error: BaseException) -> str:
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return str(error.args[-1]) if error.args else type(error).__name__
