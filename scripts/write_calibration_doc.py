"""Write docs/calibration.md and its figures from what `make calibration` has left.

python scripts/write_calibration_doc.py FOLDER, with a calibration in each of fixture and muscle.
"""

import json
import sys
from pathlib import Path
from typing import Any

from muscle_bayes.criticism.replicates import LEAST_SPAN
from muscle_bayes.report.calibration_figure import calibration_figure
from muscle_bayes.report.style import save
from muscle_bayes.study.steps.calibration import ranks_of

DOCS = Path(__file__).parents[1] / "docs"
RUNS = {"fixture": "the five shipped spring runs", "muscle": "the three shipped staircases"}

HEAD = """# Calibration of the posteriors

`make calibration` fits 200 data sets each. The table states how many were fitted for this page;
`muscle-bayes sbc --sets N` repeats them. Are posteriors as wide as they should be?

Simulation-based calibration (Talts et al. 2018) draws parameters, draws readings from the likelihood
at these, fits them, and ranks every parameter's true value among {ranks} draws of its
posterior: over many data sets ranks must be uniform. All data are synthetic: rig, drive and times
of readings are those of the runs named.

- **fixture**: parameters are drawn from the prior. Where friction holds the rotor fast, readings carry
  no information. Data sets with a run whose readings span less than {span:.0%} of the measured ones are
  drawn again. That depends on readings alone, so ranks stay uniform.
- **muscle**: its prior is so wide that in many of its draws the rotor lies at a stop. So parameters,
  each run's own included, are drawn from the posterior of the staircases as measured. Every run is
  recorded once more at these, from the same start. They are ranked in the posterior of both records
  (posterior SBC: Säilynoja, Schmitt, Bürkner, Vehtari 2025). That holds where the fits of this rig are,
  and says nothing of the rest of the prior.

A fit counts as converged with R-hat at most 1.05, a bulk effective sample size of 100 and no
divergences. Ranks of fits that did not converge count like the others. Uniformity is tested for
each quantity by chi-square in ten bins and by Kolmogorov and Smirnov's test. The least p-value is
multiplied by the number of tests (Bonferroni).

| posterior | of | data sets | converged | processor time | quantities | least uniform | p, corrected |
|---|---|---|---|---|---|---|---|
"""


def row(name: str, found: dict[str, Any]) -> str:
    """One calibration's line of the table."""
    least = found["least_uniform"]
    return (
        f"| {name} | {RUNS[name]} | {found['sets']} | {found['converged']} "
        f"| {found['processor_seconds'] / 60.0:.0f} min | {len(found['p'])} "
        f"| `{least['name']}` | {least['p_bonferroni']:.2g} |\n"
    )


def main(folder: Path) -> None:
    """Write page and figures."""
    every = {name: json.loads((folder / name / "calibration.json").read_text()) for name in RUNS}
    page = HEAD.format(ranks=every["fixture"]["ranks_of"], span=LEAST_SPAN)
    page += "".join(row(name, found) for name, found in every.items())
    for name, found in every.items():
        figure = f"calibration-{name}.png"
        save(calibration_figure(ranks_of(found), name), DOCS / figure)
        page += f"\n![Ranks of the {name}'s parameters]({figure})\n"
    page += (
        "\nA panel a quantity. A calibrated quantity stays in the grey band, at each rank with\n"
        "probability 99 %. A curve that dips and rises belongs to a posterior that is too narrow.\n"
    )
    (DOCS / "calibration.md").write_text(page)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
