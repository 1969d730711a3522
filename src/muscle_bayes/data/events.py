"""NAME.events.jsonl: what happened while a run was recorded, and what of it is missing."""

import json
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

EVENTS_SUFFIX: Final = ".events.jsonl"
_AGAIN: Final = re.compile(r"-again(-\d+)?$")


@dataclass(frozen=True)
class Recording:
    """How the recording of a run went, as its events tell."""

    complete: bool
    reason: str
    """why it ended; where no end was written, that it was killed, or the disk was full"""
    stages: int
    """passed through to their end"""
    planned: int | None
    """stages of the plan, repeats counted; None where the events do not tell"""
    gaps: int
    longest_gap: float
    """s"""
    missing: float
    """s without rows within the run, all gaps together"""
    lost: int
    """samples that were lost between board and host"""

    def __str__(self) -> str:
        parts = ["complete" if self.complete else f"BROKEN OFF: {self.reason}"]
        if not self.complete:
            of = "" if self.planned is None else f" of {self.planned}"
            parts.append(f"{self.stages}{of} stages were passed")
        if self.gaps:
            parts.append(
                f"{self.missing:.1f} s are missing in {self.gaps} gaps, the longest "
                f"{self.longest_gap:.1f} s"
            )
        if self.lost:
            parts.append(f"{self.lost} samples lost")
        return "; ".join(parts)


def read_events(log: Path) -> list[dict[str, Any]]:
    """What happened during a run, oldest first; a line cut short is left out."""
    path = log.with_suffix(EVENTS_SUFFIX)
    if not path.exists():
        return []
    events = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        with suppress(ValueError):
            if isinstance(event := json.loads(line), dict):
                events.append(event)
    return events


def recording_of(log: Path) -> Recording | None:
    """How a run was recorded; None where it has no events, as runs of other loggers."""
    events = read_events(log)
    if not events:
        return None
    end = _last(events, "end")
    start = _last(events, "start")
    gaps = [
        float(event["end"]) - float(event["start"])
        for event in events
        if event.get("event") == "gap" and "end" in event and "start" in event
    ]
    lost = sum(
        int(event.get("count", 0)) for event in events if event.get("event") == "samples lost"
    )
    return Recording(
        complete=bool(end.get("complete")),
        reason=str(end.get("reason", "no end was written: it was killed, or the disk was full")),
        stages=sum(event.get("event") == "stage over" for event in events),
        planned=start.get("stages"),
        gaps=len(gaps),
        longest_gap=max(gaps, default=0.0),
        missing=sum(gaps),
        lost=lost,
    )


def complete_attempt(folder: Path, name: str) -> str | None:
    """Name under which a run was recorded to its end: its own, or a later attempt's; None if none."""
    for log in (folder / f"{name}.csv", *sorted(folder.glob(f"{name}-again*.csv"))):
        if log.exists() and (made := recording_of(log)) is not None and made.complete:
            return log.stem
    return None


def without_broken_off(logs: Sequence[Path]) -> tuple[list[Path], list[str]]:
    """Logs without those that broke off and were recorded again, and what is said of those.

    A run that broke off and has no later attempt among the logs stays: it is all there is of it.
    """
    kept, left_out = [], []
    for log in logs:
        made = recording_of(log)
        later = _later_attempts(log, logs)
        if made is not None and not made.complete and later:
            left_out.append(f"{log}: {made}; left out, {later[-1].stem} is its later attempt")
        else:
            kept.append(log)
    return kept, left_out


def _later_attempts(log: Path, logs: Sequence[Path]) -> list[Path]:
    name, number = _attempt(log)
    return sorted(
        (
            other
            for other in logs
            if other.parent == log.parent
            and _attempt(other)[0] == name
            and _attempt(other)[1] > number
        ),
        key=_attempt,
    )


def _attempt(log: Path) -> tuple[str, int]:
    """Name of the run, and number of the attempt at it: 0 for NAME, 1 for NAME-again."""
    match = _AGAIN.search(log.stem)
    if match is None:
        return log.stem, 0
    return log.stem[: match.start()], int((match[1] or "-1")[1:])


def _last(events: list[dict[str, Any]], kind: str) -> dict[str, Any]:
    return next((event for event in reversed(events) if event.get("event") == kind), {})
