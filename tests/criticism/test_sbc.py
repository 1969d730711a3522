"""Data sets are drawn from the likelihood itself, and ranks that are not uniform are told."""

from pathlib import Path

import jax
import numpy as np
import pytest
from typer.testing import CliRunner

from muscle_bayes.cli import app
from muscle_bayes.criticism.replicates import Template, replicate, unread
from muscle_bayes.criticism.sbc import RANKS, Calibration, rank_data_set
from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.inference.bend_hyst import starts
from muscle_bayes.inference.density import lane_fits, log_prior
from muscle_bayes.inference.prior_draws import prior_draws
from muscle_bayes.inference.problem import Problem
from muscle_bayes.inference.programs import potential_at, unconstrained
from muscle_bayes.report.calibration_figure import calibration_figure

DATA = Path(__file__).parents[2] / "data"
SPRINGS = Template(tuple(DATA / f"spring-{number}.csv" for number in (1, 3)))


def found(ranks: dict[str, np.ndarray]) -> Calibration:
    sets = len(next(iter(ranks.values())))
    one = [{"ranks": {k: v[i] for k, v in ranks.items()}, "converged": True} for i in range(sets)]
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
    figure = calibration_figure(found(uniform | {"poor": narrow}), "springs")
    assert "least uniform: poor" in figure._suptitle.get_text()


def test_replicates_are_draws_of_the_likelihood() -> None:
    """Standardised errors at the truth are independent standard normals."""
    with jax.enable_x64(True):
        problem = SPRINGS.problem()
        errors = []
        for seed in range(12):
            values, drawn = replicate(SPRINGS, problem, seed)
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


def test_a_data_set_is_ranked_in_every_quantity() -> None:
    ranked = rank_data_set(SPRINGS, 3)
    names = set(ranked["ranks"])
    assert {"J", "D", "fast.noise", "fast.zero[0]", "fast.start[1]"} <= names
    assert all(0 <= rank <= RANKS for rank in ranked["ranks"].values())


@pytest.mark.parametrize("known", [None, "given"])
def test_runs_that_stay_keep_their_readings(known: str | None) -> None:
    with jax.enable_x64(True):
        template = Template((DATA / "spring-3.csv",), after=(DATA / "spring-1.csv",))
        problem = template.problem()
        vectors = None
        if known is not None:
            # One point, so that what is drawn must be it.
            draws = prior_draws(jax.random.key(1), 1, problem.layout, problem.data)
            vectors = np.asarray(unconstrained(draws, problem.layout, problem.data))
        values, drawn = replicate(template, problem, 5, vectors)
        (before,), (after,) = problem.data.lanes, drawn.data.lanes
        (redrawn,) = template.redrawn(problem)
        assert [problem.runs[i].name for i in problem.lane_runs[0]] == ["spring-1", "spring-3"]
        assert redrawn.tolist() == [False, True]
        np.testing.assert_array_equal(after.reading[0], before.reading[0])
        assert np.abs(np.asarray(after.reading[1] - before.reading[1])).max() > 0.1
        if vectors is not None:
            np.testing.assert_allclose(values["J"], draws["J"][0], rtol=1e-12)


def test_readings_that_are_redrawn_do_not_tell_what_is_drawn_from() -> None:
    """Of the density, only the prior sees the unknowns of a run that is not yet read."""
    with jax.enable_x64(True):
        template = Template((DATA / "spring-3.csv",), after=(DATA / "spring-1.csv",))
        problem = template.problem()
        blind = unread(problem, template.redrawn(problem))
        layout = problem.layout
        draws = prior_draws(jax.random.key(0), 1, layout, problem.data)
        vector = unconstrained(draws, layout, problem.data)[0]
        moved = vector.at[starts(layout)["fast.zero"] + 1].add(1.0)

        def rise(one: Problem) -> float:
            return potential_at(moved, layout, one.data) - potential_at(vector, layout, one.data)

        prior = log_prior(vector, layout, problem.data) - log_prior(moved, layout, problem.data)
        np.testing.assert_allclose(rise(blind), prior, rtol=1e-6)
        assert abs(rise(problem) - prior) > 1.0


def test_a_run_that_nothing_pulls_back_is_refused(real_data: Path) -> None:
    with pytest.raises(MuscleBayesError, match="free starts"):
        Template((real_data / "emps",)).problem()


def test_the_command_tells_of_runs_it_cannot_read(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["sbc", str(tmp_path / "none.csv"), "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "none.csv" in result.output
