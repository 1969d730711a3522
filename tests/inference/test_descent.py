"""Where a descent ends."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.data import read_runs
from muscle_bayes.discovery.nominal import nest, nominal
from muscle_bayes.inference.running.precision import double_precision
from muscle_bayes.inference.search import damped_steps, descent
from muscle_bayes.inference.search.descent import descend
from muscle_bayes.inference.search.nested import Choice, Nested, values_at
from muscle_bayes.inference.search.nested_programs import Slope

DATA = Path(__file__).parents[2] / "data"


@double_precision
def test_steps_that_are_cut_short_do_not_end_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A coordinate in a unit far below its width: each step gains little, the way is long."""
    start = nominal(read_runs([DATA / "spring-1.csv"]), "coulomb", (), 0)
    nested, point = nest(start, ["bias-torque"])
    mode = descend(nested, (), point)
    entry = nested.shared_names().index("fast.correlation_time")
    far = np.sqrt(4.0 / mode.information[entry, entry])
    begun = mode.point.copy()
    begun[entry] += far
    for module in (damped_steps, descent):
        monkeypatch.setattr(module, "LONGEST_MOVE", far / 60.0)
    first = descend(nested, (), begun, 1)
    assert 0.0 < descend(nested, (), begun, 0).potential - first.potential < descent.LEAST_GAIN
    assert descend(nested, (), begun, 200).potential == pytest.approx(mode.potential, abs=0.3)
    monkeypatch.setattr(descent, "CUT", np.inf)
    assert descend(nested, (), begun, 200).potential > mode.potential + 1.0


@double_precision
def test_no_step_ends_where_derivatives_are_not_finite(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where strong friction makes the motion's steps diverge and an endstop cuts that off."""
    start = nominal(read_runs([DATA / "spring-1.csv"]), "coulomb", (), 0)
    nested, point = nest(start, ["viscous-friction"])
    mode = descend(nested, (), point)
    begun = mode.point.copy()
    begun[nested.shared_names().index("fast.noise")] += 1.0
    slope_of, asked = descent._slope, []

    def poisoned(nested: Nested, choice: Choice, point: np.ndarray) -> Slope:
        asked.append(point)
        slope = slope_of(nested, choice, point)
        return slope._replace(gradient=slope.gradient * (np.nan if len(asked) == 2 else 1.0))

    monkeypatch.setattr(descent, "_slope", poisoned)
    found = descend(nested, (), begun)
    assert len(asked) > 2
    assert not np.array_equal(found.point, asked[1])
    assert found.potential == pytest.approx(mode.potential, abs=0.3)


@double_precision
def test_what_cannot_be_simulated_is_no_start() -> None:
    """Friction so strong that the motion's steps diverge."""
    start = nominal(read_runs([DATA / "spring-1.csv"]), "coulomb", (), 0)
    nested, point = nest(start, ["viscous-friction"])
    nothing, effects = nested.choice(()), ("viscous-friction",)
    present = values_at(jnp.asarray(point), nothing, nested.layout, nested.data)
    overdamped = nested.point({**present, "viscous-friction.coefficient": 3.0}, effects)
    found = descend(nested, effects, overdamped)
    assert not found.slope.finite
    assert found.potential == np.inf
    assert found.log_evidence == -np.inf
    np.testing.assert_array_equal(found.point, overdamped)
