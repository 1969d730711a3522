"""Write what docs/bench.md says of the wiring, and docs/bench-trials.md from what bench_test wrote.

python -m benchmarks.bench_test.page FILE, of `python -m benchmarks.bench_test --json FILE`.
"""

import json
import sys
from collections.abc import Iterable
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.bench_test.failures import ALLOWED
from benchmarks.bench_test.overheating import HOTTEST
from muscle_bayes.bench.boards.messages import Fault, Role
from muscle_bayes.bench.sensors.catalogue import SENSORS

PROJECT = Path(__file__).parents[2]
BENCH = PROJECT / "docs" / "bench.md"
TRIALS = PROJECT / "docs" / "bench-trials.md"


def wiring() -> str:
    """The table of the sensors of the boards' own."""
    rows = [
        (f"`{sensor.name}`", sensor.what, sensor.role.lower(), pin, to)
        for role in Role
        for sensor in SENSORS.values()
        if sensor.role is role
        for pin, to in sensor.pins
    ]
    return table(("sensor", "what", "board", "pin", "to"), rows)


def document(text: str) -> str:
    """docs/bench.md with its generated part written anew."""
    begin, end = "<!-- sensors: begin -->\n", "<!-- sensors: end -->\n"
    head, rest = text.split(begin)
    _, tail = rest.split(end)
    return head + begin + wiring() + end + tail


def trials(report: dict[str, Any]) -> str:
    """docs/bench-trials.md of a report."""
    failures, heated = report["failures"], report["overheating"]
    benches = sorted({outcome["sensors"] for outcome in failures})
    latest = max(outcome["off_after"] for outcome in failures)
    safe = sum(o["heated"] and o["off_after"] <= ALLOWED for o in failures)
    hottest = max(outcome["peak"] for outcome in heated)
    parts = [
        "# Trials of the bench\n",
        "Written by `python -m benchmarks.bench_test.page FILE`. The results are those of `python -m "
        f"benchmarks.bench_test --failures {len(failures)} --overheating {len(heated)} "
        f"--seed {report['seed']} --json FILE`, with the compiled firmware on a simulated "
        "processor. Terms: [glossary](glossary.md); faults: [protocol](protocol.md#bits-of-faults).\n",
        "## Injected failures\n",
        f"{safe} of {len(failures)} failures of {len({o['failure'] for o in failures})} kinds: "
        f"heaters off within {ALLOWED:g} s, the latest after {latest:.3f} s.\n",
        table(
            ("failure", *(bench or "TMD-56" for bench in benches), "off after, s: median", "most"),
            (failure_row(name, failures, benches) for name in unique(failures, "failure")),
        ),
        "## Sensors that lie, hosts that heat on\n",
        f"{len(heated)} trials: no tube above {hottest:.1f} C (allowed {HOTTEST:g} C).\n",
        table(
            ("sensor or host", "tried", "hottest tube, C", "heated for, s", "ended by"),
            (heating_row(name, heated) for name in unique(heated, "trial")),
        ),
    ]
    return "\n".join(parts)


def failure_row(name: str, outcomes: list[Any], benches: list[str]) -> tuple[str, ...]:
    """How often one kind struck on each bench, and how it ended."""
    these = [outcome for outcome in outcomes if outcome["failure"] == name]
    counts = [str(sum(o["sensors"] == bench for o in these)) for bench in benches]
    times = [outcome["off_after"] for outcome in these]
    return name, *counts, f"{median(times):.3f}", f"{max(times):.3f}"


def heating_row(name: str, outcomes: list[Any]) -> tuple[str, ...]:
    """How hot a tube got by one kind."""
    these = [outcome for outcome in outcomes if outcome["trial"] == name]
    ends = {"the host" if o["stopped"] else fault_name(o["faults"]) for o in these}
    peak, heated = (max(o[key] for o in these) for key in ("peak", "heated"))
    return name, str(len(these)), f"{peak:.1f}", f"{heated:.1f}", ", ".join(sorted(ends))


def fault_name(faults: int) -> str:
    return Fault(faults).name or "nothing"


def unique(outcomes: Iterable[Any], key: str) -> list[str]:
    """Every name once, in order."""
    return list(dict.fromkeys(outcome[key] for outcome in outcomes))


def table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, tuple("---" for _ in head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


if __name__ == "__main__":
    BENCH.write_text(document(BENCH.read_text(encoding="utf-8")), encoding="utf-8")
    for path in sys.argv[1:]:
        report = json.loads(Path(path).read_text(encoding="utf-8"))
        TRIALS.write_text(trials(report), encoding="utf-8")
