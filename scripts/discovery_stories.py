"""Hide effects in the shipped plan of runs, search them blind, and write docs/discovery-stories.md.

    python scripts/discovery_stories.py

The thesis found touching coils by eye and left a drift at room temperature unexplained. Here the same
nine runs are simulated anew, each time with one effect hidden (coil contact; the drift as another damper
law, and as a yield), and `discover` gets nothing but the files. The shipped runs hide two at once, for
`make study`. Takes some ten minutes on two cores.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

from muscle_bayes.compiled import keep_compiled_code
from muscle_bayes.data import read_runs
from muscle_bayes.data.writer import write_run
from muscle_bayes.discovery.discover import discover
from muscle_bayes.report.discovery_figures import misfit_figure
from muscle_bayes.report.discovery_summary import summary
from muscle_bayes.report.style import save
from muscle_bayes.twin import EFFECTS, Effect, simulate
from muscle_bayes.twin.shipped import SEED, shipped_runs

DOCS = Path(__file__).parents[1] / "docs"
HELD_OUT = "staircase-166g"
STORIES = {
    "Touching coils, which the thesis found by eye": "coil-contact",
    "Drift at room temperature: HYST's damper follows another law of temperature": "damper-law",
    "Drift at room temperature: dry friction inside HYST": "hysteresis-yield",
}


def tell(hidden: Effect, title: str, figure: Path) -> str:
    """One story: simulated with an effect, searched blind, told."""
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, (rig, protocol)) in enumerate(shipped_runs().items()):
            truth = replace(rig.truth, effects=(hidden,))
            run = simulate(replace(rig, truth=truth), protocol, (SEED, number))
            write_run(Path(folder), name, run.log, run.metadata)
        runs = read_runs([Path(folder)])
        found = discover(runs, hold_out=[HELD_OUT], seed=1)
    origins = {run.name: run.metadata.origin for run in runs}
    save(misfit_figure(found, origins), figure)
    text = summary(found, origins).partition("\n")[2].replace("\n## ", "\n### ")
    return (
        f"## {title}\n\nHidden: `{hidden}`. {text}\n"
        f"![Misfit of synthetic runs, before and after](figures/{figure.name})\n"
    )


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    keep_compiled_code()
    parts = [
        "# The thesis' open questions, answered by discovery",
        "",
        "Written by `scripts/discovery_stories.py`; do not edit. All data are SYNTHETIC: the shipped "
        f"plan of nine runs, with an effect hidden. {HELD_OUT} was held out. The search saw nothing but "
        "the files. Terms: [glossary](glossary.md).",
        "",
    ]
    for title, name in STORIES.items():
        parts.append(tell(EFFECTS[name](), title, DOCS / "figures" / f"story-{name}.png"))
        (DOCS / "discovery-stories.md").write_text("\n".join(parts))
        print(f"{title}: written", flush=True)


if __name__ == "__main__":
    main()
