"""Copy the built program into the package, with what it was built from: `make -C firmware ship`."""

import json
import re
import shutil
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

HERE = Path(__file__).parent
TARGET = HERE.parent / "src" / "muscle_bayes" / "bench" / "boards" / "firmware" / "muscle_bench.hex"


def digest() -> str:
    """Of every source that goes into the program."""
    found = sha256()
    for path in sorted([*(HERE / "src").glob("*.[ch]"), HERE / "Makefile"]):
        found.update(path.name.encode() + b"\0" + path.read_bytes())
    return found.hexdigest()


def compiler() -> str:
    """The first line by which the compiler tells what it is."""
    told = subprocess.run(["avr-gcc", "--version"], capture_output=True, text=True, check=True)
    return told.stdout.splitlines()[0]


def main(built: Path) -> None:
    """Write the program and NAME.json beside it."""
    versions = dict(
        re.findall(r"#define (PROTOCOL|FIRMWARE)_VERSION (\d+)", (HERE / "src/bench.h").read_text())
    )
    shutil.copyfile(built, TARGET)
    told = {
        "firmware": int(versions["FIRMWARE"]),
        "protocol": int(versions["PROTOCOL"]),
        "program": sha256(built.read_bytes()).hexdigest(),
        "sources": digest(),
        "compiler": compiler(),
    }
    TARGET.with_suffix(".json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
