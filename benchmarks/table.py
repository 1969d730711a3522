"""python -m benchmarks.table writes docs/benchmarks.md from the results; no number is typed."""

import json
from pathlib import Path
from typing import Any

from benchmarks import RESULTS, sampling_table, scaling_table

PAGE = Path(__file__).parents[1] / "docs" / "benchmarks.md"
OURS, FLOOR = "muscle_bayes", "C by hand"
CLAIMS = (
    ("diffrax Kvaerno5, forward mode", 20.0),
    ("CasADi with CVODES, forward sensitivities", 5.0),
)
"""How many times faster ours should be, at equal error."""
FLOOR_CLAIM = 5.0
"""Within how many times the floor ours should be."""


def _time(seconds: float) -> str:
    return f"{seconds * 1e3:.2f} ms" if seconds < 0.1 else f"{seconds:.2f} s"


def _spread(timing: dict[str, Any]) -> str:
    ends = f"{_time(timing['low'])} to {_time(timing['high'])}"
    return f"{_time(timing['median'])} ({ends}, {timing['calls']} calls)"


def _rows(entries: list[dict[str, Any]], ours: float) -> list[str]:
    rows = [
        "| way | settings | error [counts] | value and gradient | times ours | first call | "
        "log posterior off by | gradient off by |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for entry in entries:
        timing = entry["timing"]
        times = (
            [
                _spread(timing),
                f"{timing['median'] / ours:.3g}",
                f"{entry['first']:.1f} s",
            ]
            if timing
            else [f"**fails:** {entry['failure']}", "", ""]
        )
        cells = [
            entry["competitor"],
            entry["settings"],
            f"{entry['error']:.2g}",
            *times,
            f"{entry['density']:.2g}",
            f"{entry['gradient']:.2g}",
        ]
        rows.append(f"| {' | '.join(cells)} |")
    return rows


def _claims(results: dict[str, Any]) -> list[str]:
    medians = {
        (entry["competitor"], entry["level"]): entry["timing"]["median"]
        for entry in results["entries"]
        if entry["timing"]
    }
    ours = medians[OURS, "own"]
    lines = []
    for name, wanted in CLAIMS:
        for level, meaning in (("equal", "at equal error"), ("coarse", "at the coarser error")):
            if (name, level) not in medians:
                lines.append(
                    f"| faster than {name}, {meaning} | {wanted:g} x | not timed: it fails |"
                )
                continue
            ratio = medians[name, level] / ours
            holds = "holds" if ratio >= wanted else "**missed**"
            lines.append(
                f"| faster than {name}, {meaning} | {wanted:g} x | {ratio:.3g} x: {holds} |"
            )
    ratio = ours / medians[FLOOR, "own"]
    holds = "holds" if ratio <= FLOOR_CLAIM else "**missed**"
    lines.append(f"| within the floor | {FLOOR_CLAIM:g} x | {ratio:.3g} x: {holds} |")
    return ["| ours is | wanted | measured |", "|---|---|---|", *lines]


def page(results: dict[str, Any]) -> str:
    """docs/benchmarks.md."""
    entries, others = results["entries"], results["others"]
    facts = ", ".join(f"{name} {value}" for name, value in results["machine"].items())
    by_level = {
        level: [entry for entry in entries if entry["level"] == level]
        for level in ("own", "equal", "coarse")
    }
    ours = by_level["own"][0]["timing"]["median"]
    away = [others[f"{name}, prior median"]["median"] for name in ("ours", "floor")]
    alone = [others[name]["median"] for name in ("our simulation alone", "C loop alone")]
    lines = [
        "# Benchmarks",
        "",
        "Written by `make bench` (see `benchmarks/README.md`); no number here is typed.",
        "",
        "## Value and gradient of the log posterior of three staircases",
        "",
        f"{results['unknowns']} unknowns, {' + '.join(map(str, results['intervals']))} intervals, "
        "double precision. Every way sees the same data, priors, noise model and course of",
        "temperature; its coordinates, log posterior and gradient are compared with ours before it is "
        "timed.",
        f"Machine: {facts}.",
        "",
        "Error is that of the coordinate against steps 31 times finer, RMS over all runs. The finer "
        "steps and",
        f"an independent solution by LSODA are {results['references_apart']:.1g} counts apart. "
        "Times are medians with quartiles.",
        "The first call sets up and compiles, but for what an earlier line has compiled.",
        "",
        "### Ours, and its floor",
        "",
        *_rows(by_level["own"], ours),
        "",
        "Runs and their derivatives alone, without priors and noise model, which both do in JAX: ours "
        f"{_time(alone[0])}, the C loop {_time(alone[1])}, {alone[0] / alone[1]:.2g} times.",
        f"At the prior median, far from the mode, where more roots need a bracket, ours takes "
        f"{_time(away[0])} and the floor {_time(away[1])}.",
        "",
        "### General solvers with an error no larger than ours",
        "",
        f"Ours errs by {results['own_error']:.2g} counts. General solvers know no dry friction: the "
        "rotor is overdamped with a coefficient c whose lag",
        "takes half of the error allowed. Each has the loosest tolerance with which it is accurate "
        "enough.",
        "",
        *_rows(by_level["equal"], ours),
        "",
        f"### General solvers with an error of {results['coarse_error']:g} counts",
        "",
        "No sensor shows what ours resolves, so this is the fairer question to a user: how long do "
        "they take for an error that just",
        "does not matter? Ours keeps its own, smaller error.",
        "",
        *_rows(by_level["coarse"], ours),
        "",
        "### Claims",
        "",
        *_claims(results),
        "",
        "What disqualifies: coordinates more than "
        f"{results['agreement']:g} counts RMS from ours; a log posterior off by more than "
        f"{results['density_tolerance']['equal']:g} (coarse: {results['density_tolerance']['coarse']:g});",
        f"a gradient off by more than {results['gradient_tolerance']['equal']:.0%} (coarse: "
        f"{results['gradient_tolerance']['coarse']:.0%}) of its length. The point lies near the mode, "
        "where contributions",
        "to the gradient cancel, so that small errors of coordinates show.",
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    """Write the page."""
    text = page(json.loads((RESULTS / "gradient.json").read_text(encoding="utf-8")))
    for name, section in (
        ("sampling", sampling_table.section),
        ("scaling", scaling_table.section),
    ):
        results = json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))
        text += section(results)
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
