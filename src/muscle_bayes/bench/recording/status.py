"""What is shown of a run while it is recorded."""

from dataclasses import dataclass
from typing import Protocol

from muscle_bayes.bench.heat.heating import Channel


@dataclass(frozen=True)
class ChannelStatus:
    """One side. Temperatures in C, None where unknown or off."""

    side: str
    temperature: float | None
    setpoint: float | None
    stable: bool
    duty: int
    verdict: str


@dataclass(frozen=True)
class Status:
    """The bench at one moment."""

    name: str
    time: float | None
    """s after the first row, None before it"""
    rows: int
    channels: tuple[ChannelStatus, ...]
    reading: float | None
    """counts"""
    angle: float | None
    """rad"""
    load: float
    """kg"""
    stage: str
    stage_number: int
    stages: int
    """how many there are, repeats counted"""
    time_to_go: float
    """rough, s"""
    question: str
    """what the operator is asked, empty if nothing"""
    troubles: tuple[str, ...]
    faults: str
    lost: int
    resets: int
    fan: bool = False


def channel_status(channel: Channel) -> ChannelStatus:
    """A channel's state as shown."""
    control = channel.control
    return ChannelStatus(
        channel.side,
        channel.temperature,
        control.setpoint,
        control.stable,
        channel.duty,
        channel.verdict.value,
    )


class View(Protocol):
    """Where it is shown."""

    def show(self, status: Status) -> None:
        """Show the bench as it is now; quick, never raises."""
        ...

    def ask(self, question: str) -> None:
        """Show a question before a run begins; empty takes it away."""
        ...


class NoView:
    """Shows nothing."""

    def show(self, status: Status) -> None:
        pass

    def ask(self, question: str) -> None:
        pass
