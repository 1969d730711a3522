"""The view in the terminal."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from math import degrees
from types import TracebackType
from typing import Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from muscle_bayes.bench.recording.status import ChannelStatus, Status

_BAR = 20


class TerminalView:
    """Redraws one panel in place; on what is no terminal it shows questions and troubles as lines."""

    def __init__(self, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)
        self._live = Live(console=self._console, auto_refresh=False, transient=True)
        self._question = ""
        self._said: tuple[str, ...] = ()

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._live.stop()

    @contextmanager
    def away(self) -> Iterator[None]:
        """Takes the panel away, for what is printed inside the `with` block."""
        self._live.stop()
        try:
            yield
        finally:
            if self._console.is_terminal:
                self._live = Live(console=self._console, auto_refresh=False, transient=True)
                self._live.start()

    def ask(self, question: str) -> None:
        """Show a question before a run begins; empty takes it away."""
        self._draw(Panel(Text(question, style="bold"), title="muscle-bayes record"))
        self._say((question,) if question else ())

    def show(self, status: Status) -> None:
        self._draw(panel(status))
        said = (*status.troubles, *filter(None, (status.question, status.faults)))
        self._say(said)

    def _draw(self, shown: RenderableType) -> None:
        if self._console.is_terminal:
            with suppress(OSError):  # a terminal that went away must not end a run
                self._live.update(shown, refresh=True)

    def _say(self, said: tuple[str, ...]) -> None:
        if self._console.is_terminal:
            return
        for line in said:
            if line not in self._said:
                with suppress(OSError):
                    self._console.print(line, markup=False, highlight=False, soft_wrap=True)
        self._said = said


def panel(status: Status) -> RenderableType:
    """A status as rich draws it."""
    parts: list[RenderableType] = [_facts(status), _channels(status.channels)]
    for text in status.troubles:
        parts.append(Text(f"heaters off: {text}", style="bold red"))
    if status.faults:
        parts.append(Text(f"latched: {status.faults}", style="bold red"))
    if status.question:
        parts.append(Text(f"{status.question}; q stops", style="bold reverse yellow"))
    return Panel(Group(*parts), title=Text(status.name), title_align="left")


def _facts(status: Status) -> Table:
    table = Table.grid(padding=(0, 2))
    time = "not logging yet" if status.time is None else clock(status.time)
    angle = "-" if status.angle is None else f"{degrees(status.angle):.1f} deg"
    counts = "-" if status.reading is None else f"{status.reading:.1f} counts"
    table.add_row("time", f"{time}, about {clock(status.time_to_go)} to go")
    table.add_row("stage", f"{status.stage_number} of {status.stages}: {status.stage}")
    table.add_row("angle", f"{angle} ({counts}), load {1000 * status.load:g} g")
    table.add_row("rows", f"{status.rows}, {status.lost} lost, {status.resets} resets")
    return table


def _channels(channels: tuple[ChannelStatus, ...]) -> Table:
    table = Table(box=None, padding=(0, 2))
    for name in ("", "temperature", "setpoint", "", "duty", ""):
        table.add_column(name, justify="right" if name else "left")
    for channel in channels:
        measured = "-" if channel.temperature is None else f"{channel.temperature:.1f} C"
        wanted = "off" if channel.setpoint is None else f"{channel.setpoint:.1f} C"
        stable = Text("stable", style="green") if channel.stable else Text("")
        filled = round(_BAR * channel.duty / 255)
        bar = Text("#" * filled, style="yellow") + Text("." * (_BAR - filled), style="dim")
        if channel.verdict not in ("good", "open"):
            bar = Text(channel.verdict, style="bold red")
        table.add_row(channel.side.upper(), measured, wanted, stable, str(channel.duty), bar)
    return table


def clock(seconds: float) -> str:
    """Seconds as h:mm:ss or m:ss."""
    whole = round(seconds)
    hours, minutes = whole // 3600, whole % 3600 // 60
    return f"{hours}:{minutes:02d}:{whole % 60:02d}" if hours else f"{minutes}:{whole % 60:02d}"
