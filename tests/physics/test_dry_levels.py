"""When effects on dry friction count in slow motion."""

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
import pytest
from example_plants import D, spring_plant

from muscle_bayes.physics.breakaway import dry_levels
from muscle_bayes.physics.effect import Effect, Parameter, Port, Signals
from muscle_bayes.physics.effects.stribeck_friction import StribeckFriction
from muscle_bayes.physics.friction import DryLevels
from muscle_bayes.physics.linkage import Scalar
from muscle_bayes.physics.plant import Drive


class Doubled(Effect):
    """D -> 2 D, without anything to turn it off."""

    name: ClassVar[str] = "doubled"
    port: ClassVar[Port] = "friction"
    dissipative: ClassVar[bool] = True
    parameters: ClassVar[Mapping[str, Parameter]] = {}

    def __call__(self, value: Scalar, signals: Signals) -> Scalar:
        return 2.0 * value


def levels(effect: Effect) -> DryLevels:
    drive = Drive(jnp.full(2, 25.0), jnp.asarray(0.3), jnp.asarray(0.0))
    plant = spring_plant() + effect
    return dry_levels(plant, jnp.asarray(0.0), jnp.zeros(2), drive, jnp.asarray(0.05))


@pytest.mark.parametrize(
    ("effect", "static"), [(StribeckFriction.off(), D), (Doubled(), 2.0 * D)], ids=["off", "bare"]
)
def test_levels_are_one_without_dependence_on_speed(effect: Effect, static: float) -> None:
    found = levels(effect)
    assert float(found.static) == pytest.approx(static)
    assert float(found.sliding) == pytest.approx(static)


def test_an_effect_that_is_on_lowers_friction_while_the_rotor_slides() -> None:
    found = levels(StribeckFriction(jnp.asarray(0.5), jnp.asarray(0.01)))
    assert float(found.static) == pytest.approx(D)
    assert 0.49 * D < float(found.sliding) < 0.9 * D
