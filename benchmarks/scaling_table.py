"""The section of docs/benchmarks.md on how cost grows."""

from collections.abc import Sequence
from typing import Any

import numpy as np

LINEAR = 1.1
"""Growth exponent up to which a cost is taken for linear: timings scatter by some per cent."""
TITLES = {
    "length": ("record length [s]", "value and gradient, three staircases cut there"),
    "runs": ("runs", "value and gradient, staircases (repeated beyond three)"),
    "muscles": ("muscles on the rotor", "value and gradient, three staircases"),
    "draws": ("draws", "predictive draws of three staircases"),
    "workers": ("workers", "independent fixture fits, processes started and compiling anew"),
}
CLAIMED = "length", "runs"


def exponent(rows: Sequence[dict[str, Any]]) -> float:
    """Slope of log seconds over log size, by least squares."""
    size, seconds = ([row[key] for row in rows] for key in ("size", "seconds"))
    return float(np.polyfit(np.log(size), np.log(seconds), 1)[0])


def _time(seconds: float) -> str:
    return f"{seconds * 1e3:.2f} ms" if seconds < 1.0 else f"{seconds:.1f} s"


def section(results: dict[str, Any]) -> str:
    """Tables, and whether cost grows no faster than linearly."""
    facts = ", ".join(f"{name} {value}" for name, value in results["machine"].items())
    lines = ["", "## How cost grows", "", f"Machine: {facts}.", ""]
    for key, (title, meaning) in TITLES.items():
        rows = results["scaling"][key]
        sized = "intervals" in rows[0]
        head = [title, "readings' intervals", "time"] if sized else [title, "time"]
        lines += [f"**{title}** ({meaning})", "", f"| {' | '.join(head)} |"]
        lines += ["|" + "---|" * len(head)]
        for row in rows:
            cells = [f"{row['size']:g}", *([str(row["intervals"])] if sized else [])]
            lines.append(f"| {' | '.join([*cells, _time(row['seconds'])])} |")
        grown = exponent(rows)
        verdict = ""
        if key in CLAIMED:
            holds = "holds" if grown <= LINEAR else "**missed**"
            verdict = f"; no faster than linear: {holds}"
        lines += ["", f"Time grows as the {grown:.2f}th power{verdict}.", ""]
    lines += [
        "A record is solved on at most some hundred intervals whatever its length, as many as keep the "
        "error in bounds (docs/model.md),",
        "so that longer records cost the same beyond that.",
        "",
    ]
    return "\n".join(lines)
