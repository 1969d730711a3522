"""What the terminal shows."""

import io

from rich.console import Console

from muscle_bayes.bench.heat.heating import Channel
from muscle_bayes.bench.heat.temperature_control import TemperatureControl
from muscle_bayes.bench.heat.thermometry import Verdict, Watch
from muscle_bayes.bench.recording.live import Moment, TerminalView, clock, panel, trace
from muscle_bayes.bench.recording.status import Status

HEATED = Channel(
    "a", True, TemperatureControl(), Watch(temperature=61.4), verdict=Verdict.GOOD, duty=128
)
HEATED.control.aim(64.0)

STATUS = Status(
    name="bend-1",
    time=83.0,
    rows=2767,
    channels=(
        HEATED,
        Channel("b", False, verdict=Verdict.OPEN),
    ),
    reading=431,
    angle=-0.4698,
    load=0.139,
    stage="A 64 C until stable",
    stage_number=6,
    stages=32,
    time_to_go=3725.0,
    question="Hang 166 g and press a key as it hangs",
    troubles=("thermocouple A: stuck. Fix: release HOLD.",),
    faults="the firmware hung",
    lost=2,
    resets=1,
)


def shown(renderable, **options):
    console = Console(file=io.StringIO(), width=100, **options)
    console.print(renderable)
    return console.file.getvalue()


def test_panel_tells_everything():
    text = shown(panel(STATUS))
    for words in [
        "bend-1",
        "1:23, about 1:02:05 to go",
        "6 of 32: A 64 C until stable",
        "-26.9 deg (431.0 counts), load 139 g",
        "2767, 2 lost, 1 resets",
        "61.4 C",
        "64.0 C",
        "##########",
        "off",
        "heaters off: thermocouple A: stuck",
        "latched: the firmware hung",
        "Hang 166 g and press a key as it hangs; q stops",
    ]:
        assert words in text


def test_a_file_gets_questions_and_troubles_once():
    console = Console(file=io.StringIO(), width=100)
    with TerminalView(console) as view:
        view.ask("Hang 139 g")
        view.ask("")
        for _ in range(5):
            view.show(STATUS)
    lines = console.file.getvalue().splitlines()
    assert lines == ["Hang 139 g", STATUS.troubles[0], STATUS.question, STATUS.faults]


def test_a_terminal_is_redrawn_and_left_clean():
    console = Console(file=io.StringIO(), width=100, force_terminal=True)
    with TerminalView(console) as view:
        view.show(STATUS)
    assert "bend-1" in console.file.getvalue()


def test_clock():
    assert [clock(s) for s in (0, 59.6, 61, 3600, 36_061)] == [
        "0:00",
        "1:00",
        "1:01",
        "1:00:00",
        "10:01:01",
    ]


def test_a_trace_reaches_from_lowest_to_highest():
    assert trace([1.0, 2.0, None, 3.0, 8.0]) == "▁▂ ▃█"
    assert trace([5.0, 5.0]) == "▁▁"
    assert trace([]) == ""


def test_the_panel_shows_traces():
    moments = [Moment(float(n), -0.01 * n, (25.0 + n, None)) for n in range(1, 31)]
    text = shown(panel(STATUS, moments))
    assert "-17.2 to -0.6 deg" in text
    assert "26.0 to 55.0 C" in text
