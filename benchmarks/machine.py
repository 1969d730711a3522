"""On what and with what a benchmark ran."""

import os
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from benchmarks.competitors.c_floor import compiler


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _compiler_version() -> str:
    cc = compiler()
    if cc is None:
        return "none"
    shown = subprocess.run([cc, "--version"], capture_output=True, text=True, check=True)
    return shown.stdout.splitlines()[0]


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


def machine(packages: tuple[str, ...]) -> dict[str, str]:
    """Processor, cores and versions."""
    facts = {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "Python": platform.python_version(),
        "C compiler": _compiler_version(),
    }
    return facts | {package: _version(package) for package in packages}
