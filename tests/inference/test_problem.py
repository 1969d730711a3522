"""Sets of runs and effects that cannot be fitted together end in a message."""

from pathlib import Path

import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.problem import MUSCLE_PORTS, pose
from muscle_bayes.physics.effects import CATALOGUE, effect_type

DATA = Path(__file__).parents[2] / "data"


@pytest.mark.parametrize("name", CATALOGUE)
def test_effects_on_a_muscle_need_one(name):
    springs = read_runs([DATA / "spring-1.csv"])
    if effect_type(name).port in MUSCLE_PORTS:
        with pytest.raises(
            MuscleBayesError, match=f"'{name}' acts on a muscle, but no run has one"
        ):
            pose(springs, effects=(name,))
    else:
        sampled = [site for site, _ in pose(springs, effects=(name,)).layout.shapes]
        assert any(site.startswith(f"{name}.") for site in sampled)


def test_nothing_to_fit_and_effects_named_twice():
    with pytest.raises(MuscleBayesError, match="no runs were given"):
        pose([])
    with pytest.raises(MuscleBayesError, match="named twice"):
        pose(read_runs([DATA / "spring-1.csv"]), effects=("bias-torque", "bias-torque"))
