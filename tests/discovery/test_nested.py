"""One model with every candidate, against each candidate's own model."""

from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.discovery.fit import Search
from muscle_bayes.discovery.fitted import Fitted, Start, first_share, sampled_values
from muscle_bayes.discovery.gate import without_blocks
from muscle_bayes.discovery.nominal import nest, seen_parts, without_runs
from muscle_bayes.inference.model.density import unconstrain
from muscle_bayes.inference.model.prior_draws import prior_draws
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.posteriors.starts import SETTLING_SHARE
from muscle_bayes.inference.running.programs import potential_at
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.nested_programs import explained_at, look_at
from muscle_bayes.physics.effects.empirical import TERMS, function_name

DATA = Path(__file__).parents[2] / "data" / "plain"
CANDIDATES = ("viscous-friction", "bias-torque")


@pytest.fixture(scope="module")
def nested() -> Nested:
    with jax.enable_x64(True):
        runs = read_runs([DATA / "spring-1.csv", DATA / "spring-3.csv"])
        return Nested(pose(runs, "coulomb", CANDIDATES))


def _values(effects: tuple[str, ...], nested: Nested) -> tuple[dict, float]:
    """A draw of the candidate's own problem, and its potential there."""
    own = pose(nested.problem.runs, "coulomb", effects)
    drawn = prior_draws(jax.random.key(7), 1, own.layout, own.data)
    values = {name: value[0] for name, value in drawn.items()}
    vector = unconstrain(values, own.layout, own.data)
    return values, potential_at(vector, own.layout, own.data)


@pytest.mark.parametrize("effects", [(), ("bias-torque",), CANDIDATES])
def test_a_candidate_has_the_density_of_its_own_model(nested: Nested, effects) -> None:
    values, potential = _values(effects, nested)
    point = nested.point(values, effects)
    found = explained_at(jnp.asarray(point), nested.choice(effects), nested.layout, nested.data)
    assert float(found.potential) == pytest.approx(potential, rel=1e-9)


def test_slopes_are_finite_differences(nested: Nested) -> None:
    effects = ("bias-torque",)
    values, _ = _values(effects, nested)
    choice = nested.choice(effects)
    point = jnp.asarray(nested.point(values, effects))
    slope = look_at(point, choice, nested.layout, nested.data)
    used = nested.shared + 1
    for entry in (0, 1, used - 1):
        step = 1e-4 * np.eye(point.size)[entry]
        ahead, back = (
            explained_at(point + sign * step, choice, nested.layout, nested.data).potential
            for sign in (1.0, -1.0)
        )
        assert float(slope.gradient[entry]) == pytest.approx(float(ahead - back) / 2e-4, rel=1e-3)


def test_an_allowed_discrepancy_adds_in_squares(nested: Nested) -> None:
    values, _ = _values((), nested)
    allowed = Nested(nested.problem, {"fast": 0.3})
    more = dict(values) | {"fast.discrepancy": jnp.hypot(values["fast.discrepancy"], 0.3)}

    def likelihood(model: Nested, at: dict) -> float:
        found = explained_at(
            jnp.asarray(model.point(at, ())), model.choice(()), model.layout, model.data
        )
        return float(found.log_densities.sum())

    assert likelihood(allowed, values) == pytest.approx(likelihood(nested, more), rel=1e-9)


def _start(nested: Nested, values: dict, effects: tuple[str, ...]) -> Start:
    return Start(effects, nested.point(values, effects), nested.data)


@pytest.fixture(scope="module")
def fits(nested: Nested) -> list[Fitted]:
    """Both without an effect and with one, from the same start, as one batch."""
    with jax.enable_x64(True):
        drawn, _ = _values(CANDIDATES, nested)
        start = drawn | {"J": 1.5e-3, "D": 5e-3, "fast.noise": 0.4, "fast.discrepancy": 0.3}
        start |= {"bias-torque.torque": 1e-4}
        rows = [_start(nested, start, ()), _start(nested, start, ("bias-torque",))]
        return Search(nested).fit(rows)


def test_a_batch_finds_the_modes_of_the_shipped_springs(nested: Nested, fits) -> None:
    plain, biased = fits
    values = sampled_values(nested, plain)
    assert values["J"] == pytest.approx(0.00124103, rel=0.03)  # Table 1, the twin's truth
    assert values["D"] == pytest.approx(0.0054594, rel=0.1)
    assert biased.potential <= plain.potential + 10.0
    assert plain.log_evidence > biased.log_evidence - 3.0
    noise = nested.shared_names().index("fast.noise")
    step = 1e-3 * np.eye(plain.point.size)[noise]
    ahead, back = (
        Search(nested).fit([plain.start._replace(point=plain.point + s * step)], steps=0)[0]
        for s in (1.0, -1.0)
    )
    slopes = [np.asarray(one.look.gradient)[noise] for one in (ahead, back)]
    curvature = float(slopes[0] - slopes[1]) / 2e-3
    # The whole Fisher information, of which errors alone would tell half.
    assert float(plain.look.information[noise, noise]) == pytest.approx(curvature, rel=0.15)


def test_entries_that_are_held_stay(nested: Nested, fits) -> None:
    start = fits[0].start
    (found,) = Search(nested).fit([start._replace(point=start.point + 0.05)], held=("J",))
    place = nested.shared_names().index("J")
    assert found.point[place] == pytest.approx(start.point[place] + 0.05)


def test_what_cannot_be_simulated_is_no_start(nested: Nested, fits) -> None:
    """Friction so strong that the motion's steps diverge."""
    values = sampled_values(nested, fits[0])
    start = _start(nested, values | {"viscous-friction.coefficient": 3.0}, ("viscous-friction",))
    (found,) = Search(nested).fit([start])
    assert found.potential == np.inf
    assert found.log_evidence == -np.inf
    np.testing.assert_array_equal(found.point, start.point)


def test_a_fit_is_the_same_in_another_nested_model(nested: Nested, fits) -> None:
    search = Search(nested)
    other, (plain, biased) = nest(search, ("bias-torque", "unknown-torque"), fits, slots=1 + TERMS)
    both = ("bias-torque", function_name("torque", "q", -1.0, 1.0))
    widest = other.nested.choice(both)
    assert widest.slot.size == plain.choice.slot.size == biased.choice.slot.size  # one program
    assert plain.potential == pytest.approx(fits[0].potential, abs=1e-6)
    assert biased.potential == pytest.approx(fits[1].potential, abs=1e-6)
    assert other.nested.layout.effects == ("bias-torque", "unknown-torque")
    shorter = search.with_effects(fits[1], ())
    np.testing.assert_allclose(shorter.point[: nested.shared], fits[1].point[: nested.shared])


def test_readings_that_are_held_out_do_not_count(nested: Nested) -> None:
    data = without_runs(nested.problem, nested.data, ["spring-3"])
    (lanes,), (whole,) = data.lanes, nested.data.lanes
    late = np.asarray(whole.time[1]) > SETTLING_SHARE * nested.problem.runs[1].duration
    assert np.all(np.asarray(lanes.weight[1])[late] == 0.0)
    assert np.array_equal(lanes.weight[0], whole.weight[0])
    blocks = np.where(np.asarray(whole.weight).ravel() > 0, 0, -1)
    blocks[: whole.weight.shape[1] // 2] = 1
    part = without_blocks(nested.data, blocks, [1])
    hidden = np.asarray(part.lanes[0].weight).ravel()[: whole.weight.shape[1] // 2]
    assert np.all(hidden == 0.0)


def test_a_fit_of_what_was_searched_has_the_first_part_of_runs_held_out(nested: Nested) -> None:
    first, third = nested.problem.runs
    whole, part = seen_parts((first, third), ["spring-3"])
    assert whole is first
    end = SETTLING_SHARE * third.duration
    assert part.table["time"].iloc[-1] < end <= third.table["time"].iloc[len(part.table)]
    few = replace(third, table=third.table[:20])
    assert seen_parts((first, few), ["spring-3"]) == [first]


def test_the_first_share_of_every_run_is_its_first_readings(nested: Nested) -> None:
    for whole, cut in zip(nested.data.lanes, first_share(nested.data, 0.25).lanes, strict=True):
        for before, after in zip(np.asarray(whole.weight), np.asarray(cut.weight), strict=True):
            seen = np.flatnonzero(before > 0)
            assert np.flatnonzero(after > 0).tolist() == seen[: seen.size // 4].tolist()
