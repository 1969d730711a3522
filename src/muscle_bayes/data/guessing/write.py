"""The commented NAME.toml that `muscle-bayes init` writes."""

from dataclasses import dataclass, field
from typing import Any

from muscle_bayes.data.writer import toml_value

_STOPS = "# stops = [-1.2, 1.2]  # endstops, rad or m; without this line there are none"


@dataclass(frozen=True)
class Entry:
    """One key of a table, with the reason for it."""

    key: str
    value: Any
    why: str = ""


@dataclass
class Draft:
    """Tables of a NAME.toml under way."""

    protocol: Entry = Entry(
        "protocol", "free", "spring (released from rest) | staircase | sawtooth | imposed | free"
    )
    log: list[Entry] = field(default_factory=list)
    columns: list[Entry] = field(default_factory=list)
    potentiometer: list[Entry] = field(default_factory=list)
    fixture: list[Entry] = field(default_factory=list)
    element: list[Entry] = field(default_factory=list)
    load: list[Entry] = field(default_factory=list)
    unused: list[str] = field(default_factory=list)
    """columns of numbers that no key names, with their range"""

    def text(self, log: str) -> str:
        """The file's text; `log` is the log's name."""
        parts = [
            f"# Written by `muscle-bayes init` from {log}. Check every line.",
            "",
            "format = 1",
            _line(self.protocol),
            'origin = "measured"',
            "",
        ]
        for name, entries in (
            ("log", self.log),
            ("columns", self.columns),
            ("potentiometer", self.potentiometer),
            ("fixture", self.fixture),
            ("element_a", self.element),
            ("load", self.load),
        ):
            if entries:
                extra = [_STOPS] if name == "fixture" else []
                extra += [f"# not used: {one}" for one in self.unused if name == "columns"]
                parts += [f"[{name}]", *map(_line, entries), *extra, ""]
        return "\n".join(parts[:-1]) + "\n"


def _line(entry: Entry) -> str:
    line = f"{entry.key} = {toml_value(entry.value)}"
    why = " ".join(entry.why.split())
    return f"{line}  # {why}" if why else line
