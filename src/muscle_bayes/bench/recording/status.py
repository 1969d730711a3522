"""What is shown of a run while it is recorded."""

from dataclasses import dataclass

from muscle_bayes.bench.heat.heating import Channel


@dataclass(frozen=True)
class Status:
    """The bench at one moment."""

    name: str
    time: float | None
    """s after the first row, None before it"""
    rows: int
    channels: tuple[Channel, ...]
    """as they are now: a view keeps none"""
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


class View:
    """Where it is shown; this one shows nothing."""

    def show(self, status: Status) -> None:
        """Show the bench as it is now; quick, never raises."""

    def ask(self, question: str) -> None:
        """Show a question before a run begins; empty takes it away."""
