"""The firmware onto a board, by avrdude: which boards can run it, and what went wrong where one cannot."""

import json
import os
import re
import shutil
import subprocess
import tomllib
from collections.abc import Callable, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Final

from serial.tools.list_ports_common import ListPortInfo

from muscle_bayes.errors import MuscleBayesError

SHIPPED: Final = Path(__file__).parent / "firmware" / "muscle_bench.hex"
"""The prebuilt program; `make -C firmware ship` writes it."""
BAUDS: Final = (115200, 57600)
"""Of boot loaders: an Uno's, and that of a Duemilanove or an older Nano."""
SIGNATURES: Final = ("1e950f", "1e9514")
"""Of an ATmega328P and an ATmega328."""
LONGEST: Final = 60.0
"""s that avrdude may take."""


def _boards(kind: str) -> dict[tuple[int, int], str]:
    """Names by USB vendor and product."""
    told = tomllib.loads(Path(__file__).with_name("usb.toml").read_text(encoding="utf-8"))[kind]
    pairs = {key.partition(":")[::2]: name for key, name in told.items()}
    return {(int(vendor, 16), int(product, 16)): name for (vendor, product), name in pairs.items()}


FIT: Final = _boards("fit")
"""Boards that run it, and converters that sit on such boards among others."""
UNFIT: Final = _boards("unfit")
"""Boards with another processor."""


Run = Callable[[Sequence[str]], "subprocess.CompletedProcess[str]"]


def find_avrdude() -> Path:
    """avrdude on the path, or that of an Arduino IDE. Raises MuscleBayesError."""
    if (found := shutil.which("avrdude")) is not None:
        return Path(found)
    homes = [Path.home() / ".arduino15", Path.home() / "Library" / "Arduino15"]
    if (local := os.environ.get("LOCALAPPDATA")) is not None:
        homes.append(Path(local) / "Arduino15")
    for home in homes:
        pattern = "packages/*/tools/avrdude/*/bin/avrdude*"
        for path in sorted(home.glob(pattern), reverse=True):
            if path.stem == "avrdude" and path.suffix in ("", ".exe"):
                return path
    raise MuscleBayesError(
        "avrdude is missing. Fix: install it (Debian and Ubuntu: `apt install avrdude`; macOS: "
        "`brew install avrdude`; Windows: `winget install avrdude`), or the Arduino IDE, which "
        "brings it along."
    )


def check_program(path: Path = SHIPPED) -> str:
    """What the shipped program is, in words. Raises MuscleBayesError where it is absent or damaged."""
    about = path.with_suffix(".json")
    if not path.is_file() or not about.is_file():
        raise MuscleBayesError(
            f"{path}: the program is missing. Fix: run `make -C firmware ship`, or give --hex."
        )
    told = json.loads(about.read_text(encoding="utf-8"))
    if sha256(path.read_bytes()).hexdigest() != told["program"]:
        raise MuscleBayesError(f"{path}: damaged. Fix: install the package anew, or give --hex.")
    return f"firmware {told['firmware']}, protocol {told['protocol']}"


def refuse_unfit(port: ListPortInfo) -> str:
    """Name of the board on a port, as far as USB tells. Raises MuscleBayesError where it cannot run it."""
    kind = (port.vid, port.pid)
    if kind in UNFIT:
        raise MuscleBayesError(
            f"{port.device}: an {UNFIT[kind]}; the firmware runs on an ATmega328P. Fix: use an "
            "Arduino Uno (up to R3), Duemilanove or Nano, or a clone of one."
        )
    return FIT.get(kind, "unknown board")


def choose_port(ports: Sequence[ListPortInfo], wanted: str | None) -> ListPortInfo:
    """The port that was named, or the only one that may be a board's. Raises MuscleBayesError."""
    if wanted is not None:
        return next((port for port in ports if port.device == wanted), ListPortInfo(wanted))
    possible = [port for port in ports if (port.vid, port.pid) in FIT]
    if len(possible) == 1:
        return possible[0]
    for port in ports:
        refuse_unfit(port)
    seen = ", ".join(port.device for port in possible) or "none"
    raise MuscleBayesError(
        f"boards that may be meant: {seen}. Fix: connect one and name it by --port."
    )


def flash(port: ListPortInfo, program: Path, avrdude: Path, run: Run | None = None) -> int:
    """Load a board through its boot loader; the baud rate that worked. Raises MuscleBayesError."""
    refuse_unfit(port)
    said = ""
    for baud in BAUDS:
        command = [
            str(avrdude), "-p", "atmega328p", "-c", "arduino", "-P", port.device, "-b", str(baud),
            "-D", "-U", f"flash:w:{program}:i",
        ]  # fmt: skip
        done = (run or _run)(command)
        if done.returncode == 0:
            return baud
        said = done.stdout + done.stderr
        if not _silent(said):
            break
    raise MuscleBayesError(f"{port.device}: {_explained(said)}")


def _run(command: Sequence[str]) -> "subprocess.CompletedProcess[str]":
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=LONGEST)
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, 1, "", "not in sync: nothing answered")
    except OSError as error:
        raise MuscleBayesError(
            f"{command[0]}: cannot be started: {error.strerror}. Fix: install avrdude anew."
        ) from None


def _silent(said: str) -> bool:
    """Whether no boot loader has answered at this baud rate."""
    return re.search(r"not in sync|not responding|programmer is not", said) is not None


def _explained(said: str) -> str:
    """What avrdude's words mean, and what to do."""
    signature = re.search(r"signature = (?:0x)?([0-9a-f ]{6,8})", said, re.IGNORECASE)
    if signature is not None and signature[1].replace(" ", "").lower() not in SIGNATURES:
        return (
            f"another processor answers there, signature {signature[1]}; the firmware runs on an "
            "ATmega328P. Fix: use an Uno (up to R3), Duemilanove or Nano."
        )
    if "ermission denied" in said or "ccess is denied" in said:
        return (
            "the port may not be opened. Fix: on Linux `sudo usermod -aG dialout $USER`, then log "
            "out and in; everywhere, close other programs that hold the port."
        )
    if "o such file" in said or "cannot find the file" in said:
        return "there is no such port. Fix: plug the board in; `muscle-bayes flash` lists ports."
    if _silent(said):
        return (
            "no boot loader answers. Fix: take a USB cable that carries data; install the CH340 "
            "driver for a clone (docs/bench.md); close other programs that hold the port; a "
            "board whose boot loader was replaced needs a programmer: `make -C firmware flash "
            "PROGRAMMER=usbasp`."
        )
    last = [line for line in said.splitlines() if line.strip()]
    return f"avrdude has failed: {last[-1] if last else 'it says nothing'}. Fix: see its words."
