"""Search the shipped runs blind, and write docs/discovery-stories.md.

    python scripts/discovery_stories.py

The thesis found touching coils by eye and left a drift at room temperature unexplained. Both are hidden in
`data`, neither in `data/plain`, and `discover` gets nothing but the files.
"""

import argparse
from pathlib import Path

from muscle_bayes.compiled import keep_compiled_code
from muscle_bayes.data import read_runs
from muscle_bayes.discovery.discover import discover
from muscle_bayes.discovery.summary import summary
from muscle_bayes.report.discovery_figures import misfit_figure
from muscle_bayes.report.style import save
from muscle_bayes.twin.shipped import HIDDEN

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
HELD_OUT = "staircase-166g"
STORIES = {
    "data": "Touching coils, and a drift at room temperature",
    "data/plain": "The same runs with nothing hidden",
}


def tell(folder: str, title: str, figure: Path) -> str:
    """One story: the runs of a folder, searched blind, told."""
    runs = read_runs([ROOT / folder])
    found = discover(runs, hold_out=[HELD_OUT], seed=1)
    origins = {run.name: run.metadata.origin for run in runs}
    save(misfit_figure(found, origins), figure)
    hidden = " and ".join(f"`{effect}`" for effect in HIDDEN) if folder == "data" else "nothing"
    text = summary(found, origins).partition("\n")[2].replace("\n## ", "\n### ")
    return (
        f"## {title}\n\nRuns: `{folder}`. Hidden: {hidden}. {text}\n"
        f"![Misfit of synthetic runs, before and after](figures/{figure.name})\n"
    )


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    keep_compiled_code()
    parts = [
        "# The thesis' stories, told by discovery",
        "",
        "Written by `scripts/discovery_stories.py`; do not edit. All data are SYNTHETIC: the shipped "
        f"runs. {HELD_OUT} was held out; the search saw nothing but the files. What the effects do to the "
        "muscle's parameters is in the report of `make study`.",
        "",
    ]
    for folder, title in STORIES.items():
        parts.append(tell(folder, title, DOCS / "figures" / f"story-{Path(folder).name}.png"))
        (DOCS / "discovery-stories.md").write_text("\n".join(parts))
        print(f"{folder}: told", flush=True)


if __name__ == "__main__":
    main()
