"""The synthetic runs that come with the package."""

from importlib.resources import files
from pathlib import Path

from muscle_bayes.data.reader import read_runs
from muscle_bayes.data.run import Run
from muscle_bayes.errors import MuscleBayesError, did_you_mean

GROUPS = {
    "springs": "plain/spring-*.csv",
    "staircases": "plain/staircase-*.csv",
    "sawtooth": "plain/sawtooth.csv",
    "lot": "lot/*/*.csv",
}
"""Files of each example."""


def load_example(name: str) -> list[Run]:
    """Shipped synthetic runs of one kind, in which nothing is hidden.

    An independent simulator wrote them, with the values of the thesis as truth.

    Args:
        name: "springs": five records of a weight on a spring, for J and D. "staircases": three of a
            muscle heated in steps. "sawtooth": one, to predict. "lot": one of each of eight muscles.
            Or a single run such as "spring-1" or "staircase-139g".

    Returns:
        The runs, sorted by name, as `read_runs` gives them.

    Raises:
        MuscleBayesError: where there is no example of that name; the message lists all.

    Example:
        >>> import muscle_bayes as mb
        >>> springs = mb.load_example("springs")
        >>> len(springs), springs[0].name, springs[0].unit
        (5, 'spring-1', 'counts')
    """
    folder = _folder()
    if name in GROUPS:
        return read_runs(sorted(folder.glob(GROUPS[name])))
    single = sorted(path.stem for path in folder.glob("plain/*.csv"))
    if name not in single:
        known = [*GROUPS, *(one for one in single if one not in GROUPS)]
        raise MuscleBayesError(
            f"there is no example {name!r}.{did_you_mean(name, known)} Fix: choose one of "
            f"{', '.join(known)}."
        )
    return read_runs([folder / "plain" / f"{name}.csv"])


def _folder() -> Path:
    """The shipped runs: inside an installed package, in `data` of a checkout."""
    installed = Path(str(files("muscle_bayes") / "example_data"))
    return installed if installed.is_dir() else Path(__file__).parents[2] / "data"
