"""Data sets are drawn from the likelihood itself, and ranks that are not uniform are told."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app
from muscle_bayes.criticism import replicates
from muscle_bayes.criticism.replicates import KNOWN_DRAWS, Known, Template, replicate
from muscle_bayes.criticism.sbc import RANKS, Calibration, calibration_tasks, rank_data_set
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.model.density import lane_fits, log_prior
from muscle_bayes.inference.model.prior_draws import prior_draws
from muscle_bayes.inference.model.problem import Problem
from muscle_bayes.inference.model.reduction import ReductionError
from muscle_bayes.inference.running.programs import potential_at, unconstrained
from muscle_bayes.parallel import tasks
from muscle_bayes.report.calibration_figure import calibration_figure

DATA = Path(__file__).parents[2] / "data" / "plain"
SPRINGS = Template(tuple(DATA / f"spring-{number}.csv" for number in (1, 3)))


def found(ranks: dict[str, np.ndarray]) -> Calibration:
    sets = len(next(iter(ranks.values())))
    one = [
        {"ranks": {k: v[i] for k, v in ranks.items()}, "converged": True, "seconds": 2.0}
        for i in range(sets)
    ]
    return Calibration.of(one, "the prior")


def test_uniform_ranks_pass_and_others_do_not() -> None:
    rng = np.random.default_rng(0)
    uniform = {f"p{i}": rng.integers(0, RANKS + 1, 200) for i in range(20)}
    assert found(uniform).smallest()[1] > 0.05
    narrow = rng.choice([0, 1, 2, RANKS - 1, RANKS], 200)
    shifted = rng.integers(20, RANKS + 1, 200)
    for poor in (narrow, shifted):
        name, chance = found(uniform | {"poor": poor}).smallest()
        assert name == "poor"
        assert chance < 1e-4
    # Density of the ranks 1 + (1 - 2 u) / 2, at its quantiles: each bin alone is nearly as it should be.
    u = (np.arange(200) + 0.5) / 200
    leaning = np.floor((RANKS + 1) * (1.5 - np.sqrt(2.25 - 2.0 * u))).astype(int)
    assert found({"leaning": leaning}).smallest()[1] < 0.005
    figure = calibration_figure(found(uniform | {"poor": narrow}), "springs")
    assert "least uniform: poor" in figure._suptitle.get_text()


def test_replicates_are_draws_of_the_likelihood() -> None:
    """Standardised errors at the truth are independent standard normals."""
    with jax.enable_x64(True):
        problem = SPRINGS.problem()
        errors = []
        for seed in range(12):
            values, drawn = replicate(problem, seed)
            fits = jax.jit(lane_fits, static_argnames="layout")(
                values, layout=drawn.layout, data=drawn.data
            )
            for fit, lanes in zip(fits, drawn.data.lanes, strict=True):
                errors.append(np.asarray(fit.errors)[np.asarray(lanes.weight) > 0])
    every = np.concatenate(errors)
    assert every.size > 2000
    assert abs(every.mean()) < 4.0 / np.sqrt(every.size)
    assert abs(every.var() - 1.0) < 4.0 * np.sqrt(2.0 / every.size)
    lag = np.corrcoef(every[1:], every[:-1])[0, 1]
    assert abs(lag) < 4.0 / np.sqrt(every.size)


def test_a_rotor_that_sticks_is_drawn_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the prior's draws some stick; what is kept moves, and is what the prior draws where it moves."""

    def spans(problem: Problem) -> np.ndarray:
        (lanes,) = problem.data.lanes
        readings, weights = np.asarray(lanes.reading), np.asarray(lanes.weight)
        return np.array([np.ptp(one[w > 0]) for one, w in zip(readings, weights, strict=True)])

    with jax.enable_x64(True):
        problem = SPRINGS.problem()
        least = replicates.LEAST_SPAN * spans(problem)
        kept = [replicate(problem, seed) for seed in range(15)]
        monkeypatch.setattr(replicates, "LEAST_SPAN", 0.0)
        every = [replicate(problem, seed) for seed in range(15)]
    moves = [bool(np.all(spans(drawn) >= least)) for _, drawn in every]
    assert 0 < sum(moves) < 15
    for (values, drawn), (first, _), moved in zip(kept, every, moves, strict=True):
        assert np.all(spans(drawn) >= least)
        assert (values["J"] == first["J"]) == moved


def test_draws_that_give_no_data_set_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replicates, "LEAST_SPAN", 1e6)
    monkeypatch.setattr(replicates, "ATTEMPTS", 3)
    with jax.enable_x64(True):
        problem = SPRINGS.problem()
        with pytest.raises(MuscleBayesError, match=r"none of 3 draws.*--measured"):
            replicate(problem, 0)
        size = sum(int(np.prod(shape)) for _, shape in problem.layout.shapes)
        with pytest.raises(MuscleBayesError, match="cannot be simulated again"):
            replicate(problem, 0, Known([np.nan] * size))


@pytest.mark.slow
def test_a_data_set_is_ranked_in_every_quantity() -> None:
    ranked = rank_data_set(SPRINGS, 3)
    names = set(ranked["ranks"])
    assert {"J", "D", "fast.noise", "fast.zero[0]", "fast.start[1]"} <= names
    assert all(0 <= rank <= RANKS for rank in ranked["ranks"].values())


def test_a_calibration_about_measured_runs_keeps_their_readings_and_redraws_at_a_known_draw() -> (
    None
):
    with jax.enable_x64(True):
        problem = SPRINGS.problem()
        layout, data = problem.layout, problem.data
        draws = prior_draws(jax.random.key(1), 1, layout, data)
        vector = unconstrained(draws, layout, data)[0]
        values, drawn = replicate(problem, 5, Known(vector.tolist()))
        np.testing.assert_allclose(values["J"], draws["J"][0], rtol=1e-12)
        (before,), (after,) = data.lanes, drawn.data.lanes
        np.testing.assert_array_equal(after.reading, before.reading)
        # The density of both is that of the measured readings times that of the redrawn ones.
        redrawn = before._replace(reading=after.again)
        parts = [data, data._replace(lanes=(redrawn,)), drawn.data]
        measured, fresh, both = (potential_at(vector, layout, part) for part in parts)
        prior = log_prior(vector, layout, data)
        np.testing.assert_allclose(both - prior, measured + fresh, rtol=1e-9)
        found = jax.jit(lane_fits, static_argnames="layout")(values, layout=layout, data=drawn.data)
        errors = np.asarray(found[0].errors)[:, before.reading.shape[1] :]
        seen = errors[np.asarray(before.weight) > 0]
        assert abs(seen.var() - 1.0) < 4.0 * np.sqrt(2.0 / seen.size)


def test_slow_readings_are_redrawn_with_what_inertia_added_when_their_parameters_were_drawn() -> (
    None
):
    with jax.enable_x64(True):
        problem = Template((DATA / "staircase-166g.csv",)).problem()
        draws = prior_draws(jax.random.key(1), 1, problem.layout, problem.data)
        vector = unconstrained(draws, problem.layout, problem.data)[0]
        added = 2.0 * (-1.0) ** np.arange(problem.data.lanes[0].reading.size)[None]
        known = Known(vector.tolist())
        without = replicate(problem, 5, known)[1].data.lanes[0].again
        swung = replicate(problem, 5, known._replace(swings=[added.tolist()]))[1].data.lanes[0]
        # It is also uncertain by a part of itself, which lasts.
        share = np.mean((swung.again - without) * added) / np.mean(added**2)
        assert share == pytest.approx(1.0, abs=0.05)
        np.testing.assert_array_equal(swung.swing, added)
        kept = replicate(problem, 5, known._replace(inertial=["staircase-166g"]))[1]
        assert kept.data.lanes[0].fine is not None


@pytest.mark.parametrize(("rms", "inertial"), [(0.1, []), (0.7, ["staircase-166g"])])
def test_draws_keep_how_the_model_was_solved_that_they_are_of(
    rms: float, inertial: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with jax.enable_x64(True):
        template = Template((DATA / "staircase-166g.csv",))
        problem = template.problem()
        (lanes,) = problem.data.lanes
        swing = np.random.default_rng(2).normal(size=lanes.reading.shape)
        solved = replace(
            problem,
            data=problem.data._replace(lanes=(lanes._replace(swing=swing),)),
            reduction={"staircase-166g": ReductionError(rms, 2.0 * rms, 0.5)},
        )
        start = prior_draws(jax.random.key(1), 6, problem.layout, problem.data)
        vectors = np.asarray(unconstrained(start, problem.layout, problem.data))
        draws = SimpleNamespace(vector=vectors.reshape(2, 3, -1), divergences=0)
        monkeypatch.setattr(replicates, "sample", lambda *_, **__: (solved, draws, {}))
        monkeypatch.setattr(replicates, "agree", lambda *_: True)
        measured = json.loads(json.dumps(replicates.measured_draws(template, 0)))
        assert measured["converged"]
        assert measured["inertial"] == inertial
        known = Known.drawn(measured, 2 * KNOWN_DRAWS - 1)
        np.testing.assert_array_equal(known.vector, vectors[-1])
        (again,) = known.model(problem).data.lanes
        np.testing.assert_array_equal(again.swing, swing)
        assert (again.fine is not None) == bool(inertial)


def test_a_run_that_nothing_pulls_back_is_refused(real_data: Path) -> None:
    with pytest.raises(MuscleBayesError, match="free starts"):
        Template((real_data / "emps",)).problem()


def test_the_command_tells_of_runs_it_cannot_read(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["sbc", str(tmp_path / "none.csv"), "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "none.csv" in result.output


def test_nothing_is_drawn_from_a_posterior_that_did_not_converge(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    poor = {"measured-0": {"vectors": [], "converged": False}}
    monkeypatch.setattr(tasks, "run_tasks", lambda *_, **__: poor)
    arguments = ["sbc", str(DATA / "spring-1.csv"), "--measured", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2
    assert "did not converge" in result.output


def test_every_data_set_has_its_own_draw_of_what_is_known() -> None:
    vectors = [[float(number)] for number in range(50)]
    known = {"vectors": vectors, "inertial": ["slow"], "swings": [[[0.5]]]}
    arguments = calibration_tasks(SPRINGS, 30, 7, known).arguments
    assert list(arguments) == [f"seed-{seed}" for seed in range(7, 37)]
    assert [one[1] for one in arguments.values()] == list(range(7, 37))
    truths = [one[2].vector[0] for one in arguments.values()]
    assert len(set(truths)) > 15
    assert all(one[2][1:] == (["slow"], [[[0.5]]]) for one in arguments.values())
    more = calibration_tasks(SPRINGS, 40, 7, known).arguments
    assert [more[name] for name in arguments] == list(arguments.values())
