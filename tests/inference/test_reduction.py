"""Slow motion without inertia is used where it is good enough, and only there."""

from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from table_2 import sampled

from muscle_bayes.data import read_runs
from muscle_bayes.inference.model import reduction
from muscle_bayes.inference.model.density import unconstrain
from muscle_bayes.inference.model.lane_model import muscle_of, responses
from muscle_bayes.inference.model.prior_draws import prior_draws
from muscle_bayes.inference.model.problem import Problem, pose
from muscle_bayes.inference.model.reduction import (
    TOLERANCE,
    ReductionError,
    solved_adequately,
    unsolved,
    with_inertia,
    with_swings,
)
from muscle_bayes.inference.running.programs import solved_at
from muscle_bayes.inference.sampling import fit as fitting
from muscle_bayes.inference.search.mode import Mode
from muscle_bayes.study.published import TABLE_2

DATA = Path(__file__).parents[2] / "data" / "plain"
SLOW = ["staircase-139g", "staircase-166g", "staircase-212g", "sawtooth"]


@pytest.fixture(scope="module")
def shipped() -> Problem:
    with jax.enable_x64(True):
        return pose(read_runs([DATA / f"{name}.csv" for name in SLOW]))


def test_fine_grids_have_few_sizes_and_none_is_half_empty() -> None:
    sizes = [reduction._padded(steps) for steps in range(1, 2**20, 997)]
    assert len(set(sizes)) == 13
    for steps, size in zip(range(1, 2**20, 997), sizes, strict=True):
        assert steps <= size < max(1.5 * steps, reduction.LEAST_STEPS + 1)


def test_values_stand_for_table_2(shipped: Problem) -> None:
    muscle = muscle_of(sampled(shipped), shipped.data)
    for name, value in TABLE_2.items():
        np.testing.assert_allclose(getattr(muscle, name), value, rtol=1e-9)


def test_inertia_changes_no_shipped_slow_run_by_half_a_count(shipped: Problem) -> None:
    errors = with_swings(shipped, sampled(shipped)).reduction
    assert sorted(errors) == sorted(SLOW)
    for name, error in errors.items():
        # Where mass is poured the rotor swings, and sticks where the swing ends.
        assert error.rms < (0.45 if name == "sawtooth" else 0.2) < error.tolerance, name
        assert error.largest < 4.0, name


def test_what_inertia_adds_at_the_mode_is_added_there_and_nearly_right_beside_it(
    shipped: Problem,
) -> None:
    with jax.enable_x64(True):
        middle = sampled(shipped)
        used = solved_adequately(shipped, middle)
        assert [lanes.fine for lanes in used.data.lanes] == [None]
        whole = with_inertia(shipped, middle, SLOW)
        aside = middle | {"modulus": 1.02 * middle["modulus"], "J": 1.1 * middle["J"]}
        for values, share in ((middle, 1e-6), (aside, 0.7)):
            bare, found, reference = (readings(one, values) for one in (shipped, used, whole))
            for name in SLOW:
                left = np.sqrt(np.mean((found[name] - reference[name]) ** 2))
                before = np.sqrt(np.mean((bare[name] - reference[name]) ** 2))
                assert left <= share * before, (name, left, before)


def test_a_rotor_that_rings_keeps_its_inertia(shipped: Problem) -> None:
    """Without dry friction, a heavier rotor swings for long after every step of the heater."""
    loose = sampled(shipped) | {"J": jnp.asarray(0.5), "D": jnp.asarray(1e-5)}
    found = solved_adequately(shipped, loose)
    assert not any(error.tolerable for error in found.reduction.values())
    assert [lanes.fine is not None for lanes in found.data.lanes] == [True]
    assert found.layout.shapes == shipped.layout.shapes


def test_only_the_named_runs_keep_inertia(shipped: Problem) -> None:
    values = sampled(shipped)
    found = with_inertia(shipped, values, ["staircase-166g"])
    names = [[shipped.runs[i].name for i in owners] for owners in found.lane_runs]
    assert names == [["staircase-139g", "staircase-212g", "sawtooth"], ["staircase-166g"]]
    assert [lanes.fine is None for lanes in found.data.lanes] == [True, False]
    solve = jax.jit(responses, static_argnames="layout")
    (before,) = solve(values, layout=shipped.layout, data=shipped.data)
    untouched, whole = solve(values, layout=found.layout, data=found.data)
    order = [0, 2, 3]
    np.testing.assert_allclose(untouched.averaged, before.averaged[jnp.array(order)], atol=1e-9)
    assert 0.0 < np.sqrt(np.mean((whole.averaged[0] - before.averaged[1]) ** 2)) < 0.5


@pytest.mark.parametrize(
    ("rms", "used"), [(0.49, True), (0.51, False), (float("nan"), True), (float("inf"), True)]
)
def test_inertia_is_kept_only_where_it_was_solved(rms: float, used: bool) -> None:
    assert ReductionError(rms, 1.0, TOLERANCE).tolerable is used


def test_inertia_that_was_wanted_and_not_solved_is_told_as_unknown() -> None:
    fine, poor = ReductionError(0.1, 1.0, TOLERANCE), ReductionError(0.9, 1.0, TOLERANCE)
    found = unsolved({"fine": fine, "poor": poor})
    assert found["fine"] == fine
    assert not np.isfinite(found["poor"].rms)
    assert found["poor"].tolerable


@pytest.mark.parametrize(("largest", "kept"), [(1e10, True), (1e200, False), (np.nan, False)])
def test_inertia_with_derivatives_that_mean_nothing_is_not_kept(
    shipped: Problem, largest: float, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Derivatives of an unstable solution grow to any size long before they overflow."""
    poor = ReductionError(0.9, 1.0, TOLERANCE)
    heavy = replace(shipped, data=shipped.data._replace(), reduction={"sawtooth": poor})
    size = sum(int(np.prod(shape)) for _, shape in shipped.layout.shapes)
    mode = Mode(jnp.zeros(size), 0.0, np.eye(size), 0)
    refined = mode._replace(information=largest * np.eye(size))
    monkeypatch.setattr(fitting, "solved_adequately", lambda problem, values: heavy)
    monkeypatch.setattr(fitting, "refine", lambda mode, layout, data: refined)
    with jax.enable_x64(True):
        problem, _ = fitting._improved(shipped, mode)
    assert (problem.data is heavy.data) is kept
    assert np.isfinite(problem.reduction["sawtooth"].rms) is np.bool_(kept)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_what_is_solved_is_near_full_inertia_over_the_prior(
    shipped: Problem, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against full inertia on steps half as long, whichever solution is used."""
    layout, data = shipped.layout, shipped.data
    with jax.enable_x64(True):
        draws = prior_draws(jax.random.key(seed), 1, layout, data)
        values = {name: value[0] for name, value in draws.items()}
        used = solved_adequately(shipped, values)
        monkeypatch.setattr(reduction, "SWING_STEP", 0.5 * reduction.SWING_STEP)
        whole = with_inertia(shipped, values, SLOW)
        found, reference = (readings(problem, values) for problem in (used, whole))
    for name in SLOW:
        if np.isfinite(used.reduction[name].rms):
            assert np.sqrt(np.mean((found[name] - reference[name]) ** 2)) < TOLERANCE, name


def readings(problem: Problem, values) -> dict[str, np.ndarray]:
    """The model's mean reading in every interval that lasts, by run."""
    vector = unconstrain(values, problem.layout, problem.data)
    solved = solved_at(vector, problem.layout, problem.data).responses
    result = {}
    for lanes, response, owners in zip(problem.data.lanes, solved, problem.lane_runs, strict=True):
        for lane, owner in enumerate(owners):
            lasting = np.diff(np.asarray(lanes.schedule.time[lane])) > 0.0
            result[problem.runs[owner].name] = np.asarray(response.averaged[lane])[lasting]
    return result
