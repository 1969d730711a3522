"""Named effects stay beside a function that nobody has named only if they would be added beside it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import jax
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.data.writer import write_run
from muscle_bayes.discovery.chain import Link
from muscle_bayes.discovery.explanation import Explanation, Search
from muscle_bayes.discovery.gate import Gate
from muscle_bayes.discovery.naming import Naming
from muscle_bayes.discovery.nominal import nest, nominal
from muscle_bayes.discovery.screen import starts_of
from muscle_bayes.discovery.search import finished, first_steps
from muscle_bayes.discovery.unknown import Unknown
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.search.descent import descend
from muscle_bayes.physics.effects.empirical import function_name
from muscle_bayes.trial.outside import Detent
from muscle_bayes.twin import Rig, simulate, spring_rig
from muscle_bayes.twin.effects.base import Effect
from muscle_bayes.twin.effects.rotor import ViscousFriction
from muscle_bayes.twin.protocols import spring

NAMED = "viscous-friction"
FUNCTION = function_name("torque", "q", -0.2, 1.2)


def _searched(folder: Path, hidden: Sequence[Effect]) -> Unknown:
    """What a viscous friction, a torque of the angle, and both explain of spring runs."""
    rig = spring_rig(Rig())
    rig = replace(rig, truth=replace(rig.truth, effects=tuple(hidden)))
    for number, mass in enumerate((0.100, 0.118), 1):
        run = simulate(rig, spring(mass), number)
        write_run(folder, f"spring-{number}", run.log, run.metadata)
    start = nominal(read_runs([folder]), "coulomb", (), 0)
    whole, point = nest(start, [NAMED, "unknown-torque"])
    search = Search(whole, whole, (), 0, lambda stage, done, total: None).over(whole)

    def beside(one: Explanation, effect: str) -> Explanation:
        train = search.train
        starts = starts_of(train, one.fitted, effect, jax.random.key(0))
        steps = first_steps(train, one.fitted, effect, starts)
        return Explanation(search, finished(train, one.fitted, steps))

    def link(before: Explanation) -> Link:
        nothing = Naming({}, {}, {})
        return Link(FUNCTION, nothing, before, beside(before, FUNCTION), Gate(0.0, 0.0, ""), None)

    base = Explanation(search, descend(search.train, (), point))
    named = beside(base, NAMED)
    return Unknown(named, link(named), link(base))


@pytest.mark.slow
@pytest.mark.parametrize("more", [(), (ViscousFriction(coefficient=2e-3),)], ids=["alone", "both"])
@double_precision
def test_names_stay_where_they_are_needed(more: Sequence[Effect], tmp_path: Path) -> None:
    found = _searched(tmp_path, (Detent(), *more))
    assert found.beside is not None
    assert found.instead is not None
    alone, named = found.instead.after.fitted, found.named.fitted
    assert alone.log_evidence > named.log_evidence + 50.0, "the function alone is likelier"
    assert found.replaces == (not more)
