"""The view in the terminal."""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from math import degrees
from typing import Final, Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from muscle_bayes.bench.heat.heating import Channel
from muscle_bayes.bench.recording.status import Status, View

_BAR = 20
_BLOCKS: Final = "▁▂▃▄▅▆▇█"
TRACE: Final = 60
"""Moments that a trace shows."""
TRACE_STEP: Final = 2.0
"""s between them."""


@dataclass(frozen=True)
class Moment:
    """What a trace shows of one status."""

    time: float
    """s"""
    angle: float | None
    """rad"""
    temperatures: tuple[float | None, ...]
    """C"""


class TerminalView(View):
    """Redraws one panel in place; on what is no terminal it shows questions and troubles as lines."""

    def __init__(self, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)
        self._live = Live(console=self._console, auto_refresh=False, transient=True)
        self._said: tuple[str, ...] = ()
        self._history: deque[Moment] = deque(maxlen=TRACE)

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, *error: object) -> None:
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
        self._remember(status)
        self._draw(panel(status, self._history))
        said = (*status.troubles, *filter(None, (status.question, status.faults)))
        self._say(said)

    def _remember(self, status: Status) -> None:
        """Keep one status a second, for the traces."""
        if status.time is None or (self._history and status.time < self._history[-1].time):
            self._history.clear()
        if status.time is not None and (
            not self._history or status.time - self._history[-1].time >= TRACE_STEP
        ):
            temperatures = tuple(channel.temperature for channel in status.channels)
            self._history.append(Moment(status.time, status.angle, temperatures))

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


def panel(status: Status, history: Iterable[Moment] = ()) -> RenderableType:
    """A status as rich draws it, over traces of the moments before."""
    parts: list[RenderableType] = [_facts(status), _channels(status.channels)]
    if moments := list(history):
        parts.append(_traces(moments))
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
    fan = ", fan on" if status.fan else ""
    table.add_row("rows", f"{status.rows}, {status.lost} lost, {status.resets} resets{fan}")
    return table


def _traces(moments: list[Moment]) -> Table:
    """Angle and temperatures over the last minutes, each from its lowest to its highest."""
    table = Table.grid(padding=(0, 2))
    angles = [None if m.angle is None else degrees(m.angle) for m in moments]
    columns = [("angle", angles, "deg")]
    for place, side in enumerate("AB"):
        columns.append((side, [m.temperatures[place] for m in moments], "C"))
    for name, values, unit in columns:
        known = [value for value in values if value is not None]
        if len(known) > 1:
            span = f"{min(known):.1f} to {max(known):.1f} {unit}"
            table.add_row(name, Text(trace(values), style="cyan"), span)
    return table


def trace(values: Sequence[float | None]) -> str:
    """Values as a line of blocks from their lowest to their highest; a gap where one is None."""
    known = [value for value in values if value is not None]
    low, high = min(known, default=0.0), max(known, default=0.0)
    scale = (len(_BLOCKS) - 1) / (high - low) if high > low else 0.0
    return "".join(
        " " if value is None else _BLOCKS[round(scale * (value - low))] for value in values
    )


def _channels(channels: tuple[Channel, ...]) -> Table:
    table = Table(box=None, padding=(0, 2))
    for name in ("", "temperature", "setpoint", "", "duty", ""):
        table.add_column(name, justify="right" if name else "left")
    for channel in channels:
        measured = "-" if channel.temperature is None else f"{channel.temperature:.1f} C"
        setpoint = channel.control.setpoint
        wanted = "off" if setpoint is None else f"{setpoint:.1f} C"
        stable = Text("stable", style="green") if channel.control.stable else Text("")
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
