"""Kinds of meters by name: the TMD-56, and those of installed packages."""

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Final

from muscle_bayes.bench.boards.clock import Clock
from muscle_bayes.bench.boards.transport import meter_transport
from muscle_bayes.bench.meters.meter import Meter, MeterSource, ThreadedMeter
from muscle_bayes.errors import MuscleBayesError

GROUP: Final = "muscle_bayes.meters"
"""Entry points of installed packages that open a meter: `open(url, clock) -> MeterSource`."""
FIRST: Final = "tmd-56"

OpenMeter = Callable[[str, Clock], MeterSource]
"""Opens a meter on a URL, to be read by a host's clock. Raises MuscleBayesError."""


def open_tmd56(url: str, clock: Clock) -> MeterSource:
    """The TMD-56, polled by a thread of its own."""
    return ThreadedMeter(Meter(meter_transport(url), clock))


def kinds() -> dict[str, OpenMeter]:
    """Every kind by its name."""
    return {FIRST: open_tmd56, **{one.name: one.load() for one in entry_points(group=GROUP)}}


def split(meter: str) -> tuple[str, str]:
    """Kind and URL of what a user gives: `KIND:URL`, or the URL of a TMD-56.

    Raises MuscleBayesError where a kind is named without a URL.
    """
    known = kinds()
    kind, colon, url = meter.partition(":")
    if kind not in known:
        return FIRST, meter
    if not colon or not url:
        raise MuscleBayesError(f"--meter {meter}: no port. Fix: --meter {kind}:PORT.")
    return kind, url
