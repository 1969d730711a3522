"""Which run serves for what: as the config says, else by protocol and rig."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from muscle_bayes.data import Run
from muscle_bayes.errors import MuscleBayesError, did_you_mean
from muscle_bayes.study.config import StudyConfig


@dataclass(frozen=True)
class Roles:
    """Names of runs. A run with none of these roles is described, and nothing else."""

    fixture: tuple[str, ...]
    muscle: tuple[str, ...]
    held_out: tuple[str, ...]
    until: dict[str, float]
    """Of runs that are fitted in part: where that part ends [s]."""

    @property
    def fitted(self) -> tuple[str, ...]:
        return (*self.fixture, *self.muscle)


def roles_of(runs: Sequence[Run], config: StudyConfig, where: str) -> Roles:
    """Runs without a muscle tell the fixture, staircases the muscle; other runs of a muscle are held out.

    Without a staircase all runs of a muscle but the last are fitted; a single one to its middle.
    Raises MuscleBayesError for names that no run has, for a run in two roles, and if none is left to fit.
    """
    asked = (*(config.fixture or ()), *(config.muscle or ()), *(config.held_out or ()))
    _check(runs, (*asked, *config.until), asked, where)
    still = [run for run in runs if run.name not in asked]
    own = [run.name for run in still if not run.has_muscle]
    fixture = tuple(own) if config.fixture is None else config.fixture
    moved = [run for run in still if run.has_muscle]
    muscle, left = _muscle(moved, config)
    held = tuple(left) if config.held_out is None else config.held_out
    until = dict(config.until)
    if config.muscle is None and len(muscle) == 1 and not held and muscle[0] not in until:
        (only,) = (run for run in moved if run.name == muscle[0])
        until[only.name] = round(0.5 * only.duration, 1)
    roles = Roles(fixture, muscle, held, until)
    if not roles.fitted:
        raise MuscleBayesError(
            f"{where}: every run is held out, none is left to fit. Fix: name runs for `fixture` or "
            "`muscle`."
        )
    _check_kinds(runs, roles, where)
    return roles


def _muscle(moved: Sequence[Run], config: StudyConfig) -> tuple[tuple[str, ...], list[str]]:
    """Names of runs that tell the muscle, and of those left over."""
    if config.muscle is not None:
        return config.muscle, [run.name for run in moved]
    climbing = [run.name for run in moved if run.metadata.protocol == "staircase"]
    names = [run.name for run in moved]
    if climbing:
        chosen = climbing
    elif config.held_out is not None or len(names) < 2:
        chosen = names
    else:
        chosen = names[:-1]
    return tuple(chosen), [name for name in names if name not in chosen]


def _check(runs: Sequence[Run], named: Iterable[str], asked: Sequence[str], where: str) -> None:
    known = [run.name for run in runs]
    for name in named:
        if name not in known:
            raise MuscleBayesError(
                f"{where}: run {name!r} is named, but there is none.{did_you_mean(name, known)} "
                f"Fix: use names of {', '.join(known)}."
            )
    for name in asked:
        if asked.count(name) > 1:
            raise MuscleBayesError(
                f"{where}: run {name!r} is named more than once. Fix: give each run one of fixture, "
                "muscle and held_out."
            )


def _check_kinds(runs: Sequence[Run], roles: Roles, where: str) -> None:
    for run in runs:
        if run.name in roles.fixture and run.has_muscle:
            raise MuscleBayesError(
                f"{where}, key fixture: run {run.name!r} has a muscle. Fix: move it to `muscle`."
            )
        if run.name in roles.muscle and not run.has_muscle:
            raise MuscleBayesError(
                f"{where}, key muscle: run {run.name!r} has no muscle. Fix: move it to `fixture`."
            )
