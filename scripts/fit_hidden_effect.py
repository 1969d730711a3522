"""Staircases of a muscle whose heat comes late, fitted with and without knowing it.

python scripts/fit_hidden_effect.py FOLDER writes hidden.nc and hidden-unseen.nc there. The runs are
synthetic: the shipped plan's staircases with a thermal lag hidden in its default size.
"""

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from muscle_bayes.compiled import keep_compiled_code
from muscle_bayes.data import read_runs
from muscle_bayes.data.writer import write_run
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.sampling.fit import QUICK, fit
from muscle_bayes.progress import shown_progress
from muscle_bayes.twin import EFFECTS, simulate
from muscle_bayes.twin.shipped import SEED, shipped_runs

HIDDEN = "thermal-lag"


def main(folder: Path) -> None:
    """Write both posteriors; the fixture's is read from FOLDER/fixture-coulomb.nc."""
    keep_compiled_code()
    given = Posterior.load(folder / "fixture-coulomb.nc")
    with tempfile.TemporaryDirectory() as runs:
        for number, (name, (rig, protocol)) in enumerate(shipped_runs().items()):
            if name.startswith("staircase"):
                truth = replace(rig.truth, effects=(EFFECTS[HIDDEN](),))
                run = simulate(replace(rig, truth=truth), protocol, (SEED, number))
                write_run(Path(runs), name, run.log, run.metadata)
        read = read_runs([Path(runs)])
    for name, effects in (("hidden", (HIDDEN,)), ("hidden-unseen", ())):
        with shown_progress() as report:
            posterior = fit(read, "coulomb", effects, effort=QUICK, given=given, report=report)
        posterior.save(folder / f"{name}.nc")
        print(name, "converged" if posterior.converged else posterior.complaints)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
