"""Springs whose rate is stated, and motion without endstops."""

import jax.numpy as jnp
import numpy as np
import pytest

from muscle_bayes.conventions import SPRING_INTERCEPT, SPRING_MIN_LENGTH, SPRING_RATE
from muscle_bayes.physics.elements import Instant, ReferenceSpring, Spring, TorsionSpring
from muscle_bayes.physics.linkage import Pins, Straight
from muscle_bayes.physics.solvers.play import play

NONE = jnp.zeros(())
INF = float("inf")


def at(q: float, speed: float = 0.0) -> Instant:
    return Instant(jnp.asarray(q), jnp.asarray(speed), NONE, NONE, NONE, {})


def test_the_reference_spring_stated_in_numbers_is_the_reference_spring() -> None:
    pins = Pins(0.03, 0.03, 0.05, 1.0)
    free = -SPRING_INTERCEPT / SPRING_RATE
    shape = {"damping": 0.0, "free_length": free, "closed_length": SPRING_MIN_LENGTH}
    stated = Spring(pins, SPRING_RATE, **shape)
    for q in np.linspace(-1.2, 1.2, 25):
        expected = ReferenceSpring(pins).force(at(q), ())
        np.testing.assert_allclose(stated.force(at(q), ()), expected, rtol=1e-9, atol=1e-12)


def test_springs_and_dampers_are_linear() -> None:
    spring = Spring(Straight(0.1, 1.0), 356.0, damping=8.4, free_length=0.08)
    assert spring.force(at(0.01, 0.2), ()) == pytest.approx(-(356.0 * 0.03 + 8.4 * 0.2))
    assert spring.force(at(-0.05), ()) == pytest.approx(356.0 * 0.03)  # it pushes
    torsion = TorsionSpring(0.5, 0.02, 0.1)
    assert torsion.force(at(0.3, 2.0), ()) == pytest.approx(-(0.02 + 0.15 + 0.2))


@pytest.mark.parametrize("pull", [0.7, -20.0, 300.0])
def test_without_endstops_a_rest_is_found_wherever_it_is(pull: float) -> None:
    """f(x) = pull - 2 x against friction 0.1: the slide ends where |f| = 0.1."""

    def forces(x, _):
        return pull - 2.0 * x, jnp.asarray(0.1)

    rest = play(forces, jnp.zeros(()), None, (-INF, INF))
    assert float(rest) == pytest.approx((pull - np.sign(pull) * 0.1) / 2.0, rel=1e-9)


def test_a_pull_that_never_ends_is_not_finite() -> None:
    def forces(x, _):
        return 1.0 + 0.0 * x, jnp.asarray(0.1)

    assert not np.isfinite(float(play(forces, jnp.zeros(()), None, (-INF, INF))))
