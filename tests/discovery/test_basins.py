"""A candidate whose spring opens on the wrong side of the loads finds the right one."""

from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.discovery.basins import with_best_basin
from muscle_bayes.discovery.compare import compare
from muscle_bayes.discovery.explanation import Explanation, Search
from muscle_bayes.discovery.nominal import nest, nominal
from muscle_bayes.inference.model.density import constrain
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.search.descent import descend
from muscle_bayes.inference.search.mode import find_mode
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.trial.cases import HELD_OUT, Case, data_set
from muscle_bayes.twin import random_rig, save_runs, simulate, spring_rig
from muscle_bayes.twin.protocols import spring, staircase


@pytest.mark.slow
def test_a_spring_on_the_wrong_side_changes_it(tmp_path: Path) -> None:
    """MODULUS opens under the heavier load only; a descent that begins with it open stays there."""
    rig = random_rig(np.random.default_rng((8, 0, 7)))
    truth = rig.truth.muscle_a.F_modulus_min
    for number, mass in enumerate((0.139, 0.212)):
        protocol = staircase(mass, room=rig.fixture.room_temperature, cycles=1)
        run = simulate(rig, replace(protocol, log_period=0.1), (3, number))
        save_runs(tmp_path / str(number), {f"staircase-{number}": run})
    problem = pose(read_runs([tmp_path / "0", tmp_path / "1"]), "coulomb", ("slack",))
    nested = Nested(problem)
    plain = pose(problem.runs)
    mode = find_mode(jax.random.key(0), plain.layout, plain.data)
    values = constrain(mode.vector, plain.layout, plain.data)
    force = nested.shared_names().index("F_modulus_min")
    point = nested.point(values, ())
    point[force] = np.log(0.4 * truth)
    wrong = descend(nested, (), point)
    assert np.exp(wrong.point[force]) < 0.6 * truth
    right = with_best_basin(nested, wrong)
    assert np.exp(right.point[force]) == pytest.approx(truth, rel=0.05)
    assert right.log_evidence > wrong.log_evidence + 100.0


@pytest.mark.slow
@double_precision
def test_an_effect_and_the_force_that_it_acts_beside_are_moved_together(tmp_path: Path) -> None:
    """Without slack MODULUS's force ends a third too low, and beside that no slack is needed."""
    save_runs(tmp_path / "runs", data_set(Case("pair", ("modulus-temperature", "slack"), 5)))
    present, held = ("modulus-temperature",), (HELD_OUT,)
    start = nominal(read_runs([tmp_path / "runs"]), "coulomb", present, 5, held)
    whole, point = nest(start, ["slack"])
    search = Search(whole, whole, held, 5, lambda *told: None, 2).over(whole)
    base = Explanation(search, descend(search.train, present, point)).settled()
    found = compare(base, ["slack"]).found["slack"].fitted
    assert found.log_evidence > base.fitted.log_evidence + 20.0


def test_without_a_muscle_nothing_is_tried(tmp_path: Path) -> None:
    run = simulate(spring_rig(random_rig(np.random.default_rng(1))), spring(0.11), 1)
    save_runs(tmp_path / "runs", {"spring-1": run})
    nested = Nested(pose(read_runs([tmp_path / "runs"]), "coulomb", ("bias-torque",)))
    fitted = descend(nested, (), np.zeros(nested.shared + nested.choice(()).slot.size), 0)
    assert with_best_basin(nested, fitted) is fitted
