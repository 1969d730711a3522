"""One model with every candidate, against each candidate's own model."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.discovery.holding import without_blocks, without_runs
from muscle_bayes.inference.model.density import unconstrain
from muscle_bayes.inference.model.prior_draws import prior_draws
from muscle_bayes.inference.model.problem import pose
from muscle_bayes.inference.posteriors.starts import SETTLING_SHARE
from muscle_bayes.inference.running.programs import potential_at
from muscle_bayes.inference.search.descent import descend
from muscle_bayes.inference.search.nested import Nested
from muscle_bayes.inference.search.nested_programs import explained_at, slope_at

DATA = Path(__file__).parents[2] / "data"
CANDIDATES = ("viscous-friction", "bias-torque")


@pytest.fixture(scope="module")
def nested() -> Nested:
    with jax.enable_x64(True):
        runs = read_runs([DATA / "spring-1.csv", DATA / "spring-3.csv"])
        return Nested(pose(runs, "coulomb", CANDIDATES))


def _values(effects: tuple[str, ...], nested: Nested) -> tuple[dict, float]:
    """A draw of the candidate's own problem, and its potential there."""
    own = pose(nested.problem.runs, "coulomb", effects)
    drawn = prior_draws(jax.random.key(4), 1, own.layout, own.data)
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
    slope = slope_at(point, choice, nested.layout, nested.data)
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
        return float(sum(fit.log_density.sum() for fit in found.fits))

    assert likelihood(allowed, values) == pytest.approx(likelihood(nested, more), rel=1e-9)


def test_descent_finds_the_mode_of_the_shipped_springs(nested: Nested) -> None:
    values, _ = _values((), nested)
    start = dict(values) | {"J": 1.5e-3, "D": 5e-3, "fast.noise": 0.4, "fast.discrepancy": 0.3}
    fitted = descend(nested, (), nested.point(start, ()))
    names = nested.shared_names()
    inertia, friction = (np.exp(fitted.point[names.index(name)]) for name in ("J", "D"))
    assert inertia == pytest.approx(0.00124103, rel=0.03)  # Table 1, the twin's truth
    assert friction == pytest.approx(0.0054594, rel=0.1)
    held = descend(nested, (), nested.point(start, ()), held=("J",))
    assert np.exp(held.point[names.index("J")]) == pytest.approx(1.5e-3)


def test_readings_that_are_held_out_do_not_count(nested: Nested) -> None:
    problem = without_runs(nested.problem, ["spring-3"])
    (lanes,), (whole,) = problem.data.lanes, nested.data.lanes
    late = np.asarray(whole.time[1]) > SETTLING_SHARE * nested.problem.runs[1].duration
    assert np.all(np.asarray(lanes.weight[1])[late] == 0.0)
    assert np.array_equal(lanes.weight[0], whole.weight[0])
    blocks = np.where(np.asarray(whole.weight).ravel() > 0, 0, -1)
    blocks[: whole.weight.shape[1] // 2] = 1
    part = without_blocks(nested, blocks, [1])
    hidden = np.asarray(part.data.lanes[0].weight).ravel()[: whole.weight.shape[1] // 2]
    assert np.all(hidden == 0.0)
