"""Plans that separate two explanations: their course, and what they are expected to tell."""

from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
import pytest

from muscle_bayes.bench.sequences.sequence_file import parse_sequence
from muscle_bayes.data import read_runs
from muscle_bayes.discovery.candidates import candidates
from muscle_bayes.discovery.next_experiment import Thermal, course, plans, propose, thermal_of
from muscle_bayes.discovery.nominal import nominal
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.twin import Rig

DATA = Path(__file__).parents[2] / "data" / "plain"
ROOM = 25.0


def test_a_plan_heats_holds_and_cools_as_the_heater_does() -> None:
    thermal = Thermal(ROOM, heating=2.0, cooling=0.02)
    (plan, *_) = plans(ROOM, (0.2,))
    nodes, level = course(plan, thermal, 4000)
    assert nodes[0] == 0.0
    assert level.min() == pytest.approx(ROOM)
    assert 85.0 < level.max() < 95.0
    rate = np.diff(level) / np.diff(nodes)
    assert rate.max() == pytest.approx(2.0, rel=1e-2)
    middle = 0.5 * (level[1:] + level[:-1])
    # Held setpoints and the chords of the cooling aside, it falls as Newton's law says.
    falling = (rate < -0.05) & (middle > ROOM + 10.0)
    law = -0.02 * (middle[falling] - ROOM)
    assert np.median(rate[falling] / law) == pytest.approx(1.0, abs=0.05)


def test_the_heater_is_read_off_the_runs() -> None:
    """Free cooling of the shipped synthetic staircases against the twin's own time constant."""
    with jax.enable_x64(True):
        nested = Nested(pose(read_runs([DATA / "staircase-139g.csv"]), "coulomb", ("slack",)))
    found = thermal_of(nested)
    assert found is not None
    assert 1.0 / found.cooling == pytest.approx(Rig().heater.cooling_time, rel=0.1)
    assert found.heating > 0.5


@pytest.mark.slow
def test_what_is_proposed_separates_what_it_says_and_can_be_recorded() -> None:
    runs = read_runs([DATA / "spring-1.csv", DATA / "staircase-139g.csv"])
    names = ("bias-torque", "second-relaxation")
    search, base = nominal(runs, "coulomb", (), names)
    nested = search.nested
    tried = candidates(search, base, names, seed=0)
    first, second = search.fit([tried[name][0].start for name in names], steps=3)
    found = propose(nested, first, second)
    assert found is not None
    assert found.separates == names
    assert found.information > 0.0
    sequence = parse_sequence(found.sequence.encode(), "next.toml")
    (load,) = {load for block in sequence.run[0].stage if (load := getattr(block, "load", None))}
    assert f"{1000 * load:g} g" in found.plan
    same = propose(nested, first, first)
    assert same is not None
    assert same.information == pytest.approx(0.0, abs=1e-9)


def test_a_farther_release_tells_drag_from_friction(compiled_fast: None) -> None:
    """Drag grows with the square of speed: the farthest release tells most."""
    runs = read_runs([DATA / "spring-1.csv"])
    names = ("quadratic-drag", "viscous-friction")
    with jax.enable_x64(True):
        search, base = nominal(runs, "coulomb", (), names)
        tried = candidates(search, base, names, seed=0)
        first, second = search.fit([tried[name][0].start for name in names], steps=3)
        found = propose(search.nested, first, second)
    assert found is not None
    assert found.separates == names
    assert "spring-1 again, but begun at" in found.plan
    assert "(2 times as far" in found.plan
    assert found.information > 0.0
    assert found.sequence == ""
    # With a stop just behind the first position, at -0.006 rad, no farther one is proposed.
    (run,) = search.nested.problem.runs
    fixture = run.metadata.fixture.model_copy(update={"stops": (-0.05, 1.2)})
    near = replace(run, metadata=run.metadata.model_copy(update={"fixture": fixture}))
    nested = replace(search.nested, problem=replace(search.nested.problem, runs=(near,)))
    with jax.enable_x64(True):
        nearer = propose(nested, first, second)
    assert nearer is not None
    assert "(0.5 times as far" in nearer.plan
