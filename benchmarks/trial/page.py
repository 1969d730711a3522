"""Write docs/trial.md and its figure from what `make trial`, or benchmarks.trial.count, has left.

python -m benchmarks.trial.page FOLDER, with trial.json, outcomes.json and the figures in it.
"""

import inspect
import json
import shutil
import sys
from pathlib import Path
from typing import Any

from benchmarks.trial.__main__ import trial
from benchmarks.trial.cases import KINDS, RIG_NAMES
from benchmarks.trial.outcome import trial_tasks
from muscle_bayes.discovery.weigh import PRIOR_NONE

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
RESULTS = ROOT / "benchmarks" / "results"

HEAD = """# Trial of discovery

Written by `benchmarks/trial/page.py` (`make trial` runs it); do not edit.

Effects were hidden in SYNTHETIC runs of random rigs (geometry, true parameters, strengths, noise), and
searched blind (docs/discovery.md): {extent}. {rigs}
{code}
Intervals are exact (Clopper and Pearson, 95 %). Detectable: the nominal model's misfit in some run is
at least half the error of a reading (noise and rounding).

| claim | wanted | found | 95 % interval | |
|---|---|---|---|---|
"""

WHOLE = {kind: inspect.signature(trial).parameters[kind].default for kind in KINDS}
"""Data sets of each kind in the whole trial."""

RIGS = (
    "Of these {thesis} are of rigs like the thesis', {other} of pendulums, sprung discs and axes."
)
CURRENT = "The code that searched them is that of this page."
EARLIER = (
    "**Searched by earlier code**; the present code has not been tried on the whole trial yet."
)
MIXED = (
    "{count} of them were **searched by earlier code**; the present code has not been tried on the whole "
    "trial yet."
)


def searched_by(codes: dict[str, int]) -> str:
    """Whether the outcomes that were counted are of the present code."""
    older = sum(codes.values()) - codes.get(trial_tasks([]).stamp, 0)
    if not older:
        return CURRENT
    return EARLIER if older == sum(codes.values()) else MIXED.format(count=older)


def missing(counts: dict[str, int]) -> int:
    """How many data sets of the whole trial were not searched."""
    return sum(max(count - counts.get(kind, 0), 0) for kind, count in WHOLE.items())


def extent(counts: dict[str, int]) -> str:
    """How many data sets of each kind there were, and of how many."""
    parts = ", ".join(f"{counts.get(kind, 0)} of {WHOLE[kind]} ({kind})" for kind in KINDS)
    return f"{parts}" + (", **so not yet the whole trial**" if missing(counts) > 0 else "")


def verdict(one: dict[str, Any], *, whole: bool) -> str:
    """Whether the rate itself meets its aim, if it has one; of a part of the trial, so far."""
    if not one["wanted"]:
        return ""
    aim, limit = one["wanted"].split()[0], float(one["wanted"].split()[1]) / 100.0
    if one["share"] >= limit if aim == ">=" else one["share"] <= limit:
        return "holds" if whole else "so far"
    return "**does not hold**" if whole else "**not so far**"


def main(folder: Path) -> None:
    """Write page and figure."""
    found = json.loads((folder / "trial.json").read_text())
    code = searched_by(found["codes"])
    rigs = RIGS.format(**{rig: found["rigs"].get(rig, 0) for rig in RIG_NAMES})
    page = HEAD.format(extent=extent(found["kinds"]), code=code, rigs=rigs)
    whole = missing(found["kinds"]) == 0
    for one in found["rates"]:
        page += (
            f"| {one['what']} | {one['wanted']} | {one['hits']} of {one['cases']} "
            f"| {one['low']:.0%} to {one['high']:.0%} | {verdict(one, whole=whole)} |\n"
        )
    error, presumed = found["calibration_error"], found["calibration_error_as_presumed"]
    met = "below" if error < 0.05 else "**not below**"
    share = found["kinds"].get("none", 0) / found["cases"]
    page += (
        f"\nExpected calibration error of the probabilities: {error:.3f}, {met} 0.05. They presume that "
        f"nothing is missing in {PRIOR_NONE:.0%} of all data sets, and nothing was hidden in {share:.0%} "
        f"of these; with cases weighed so that it is as presumed, {presumed:.3f}.\n"
    )
    (DOCS / "figures").mkdir(exist_ok=True)
    for name in ("trial", "trial-power"):
        shutil.copyfile(folder / f"{name}.png", DOCS / "figures" / f"{name}.png")
    page += "\n![Confusion matrix and reliability, synthetic data](figures/trial.png)\n"
    page += "\n![Detection rate by strength, synthetic data](figures/trial-power.png)\n"
    RESULTS.mkdir(exist_ok=True)
    shutil.copyfile(folder / "outcomes.json", RESULTS / "trial.json")
    page += "\nEvery case, with all that was said of it: `benchmarks/results/trial.json`.\n"
    if (baselines := RESULTS / "discovery.json").exists():
        page += (
            "\n## Other ways to select\n\nOn the same cases, from what `discover` had at its first step "
            "(`benchmarks/discovery.py`):\n\n"
            "| method | detectable effects named first | claims where nothing was hidden |\n|---|---|---|\n"
        )
        for row in json.loads(baselines.read_text()):
            cells = [
                f"{hits} of {cases} ({low:.0%} to {high:.0%})"
                for hits, cases, low, high in (row["named"], row["false_claims"])
            ]
            page += f"| {row['method']} | {' | '.join(cells)} |\n"
    (DOCS / "trial.md").write_text(page)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
