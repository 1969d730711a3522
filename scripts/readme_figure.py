"""Draw the front page's figure: the held-out sawtooth of the shipped, synthetic data, predicted.

    python scripts/readme_figure.py MUSCLE.nc

MUSCLE.nc is the posterior of the staircases, by `make study` or the notebooks.
"""

import argparse
from pathlib import Path

from muscle_bayes.criticism.coverage import check_run
from muscle_bayes.data import read_run
from muscle_bayes.inference.posteriors.posterior import Posterior
from muscle_bayes.inference.posteriors.predictive import predict_runs
from muscle_bayes.report.predictive_figures import predictive_figure
from muscle_bayes.report.style import save

PROJECT = Path(__file__).parents[1]
FIGURE = PROJECT / "docs" / "figures" / "held-out.png"


def main() -> None:
    """Write the figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("posterior", type=Path)
    run = read_run(PROJECT / "data" / "sawtooth.csv")
    (prediction,) = predict_runs(Posterior.load(parser.parse_args().posterior), [run])
    save(predictive_figure(prediction, check_run(prediction), run.metadata.origin), FIGURE)


if __name__ == "__main__":
    main()
