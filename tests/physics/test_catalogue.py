"""What every effect in the catalogue must be; listing an effect there gives it these tests."""

import inspect
import re
from dataclasses import fields

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from example_plants import creep, muscle_plant, release, schedule
from wide_draws import DRAWS, SIZE, nominal, prior_draws, responses_and_slopes

from muscle_bayes.errors import MuscleBayesError
from muscle_bayes.physics.effect import PORTS, CourseFilter, Effect, MemoryEffect, Signals
from muscle_bayes.physics.effects import CATALOGUE, effect_type
from muscle_bayes.physics.state import Drive
from muscle_bayes.twin import EFFECTS

each = pytest.mark.parametrize("effect", CATALOGUE.values(), ids=CATALOGUE)


def signals(seed: int, count: int) -> Signals:
    """What effects may see, drawn at random."""
    generator = np.random.default_rng(seed)
    sizes = {"q": 1.0, "speed": 3.0, "load": 0.2, "strain": 0.1, "hyst": 0.05, "temperature": 90.0}
    sizes |= {"room": 20.0, "tension": 5.0, "pull": 0.5, "driving": 0.5}
    drawn = {key: jnp.asarray(generator.normal(size=count) * size) for key, size in sizes.items()}
    drawn["pull"] = jnp.abs(drawn["pull"])
    return Signals(**drawn, memory={})


def drive(slow: bool):
    """Heat, a load that jumps, and a push into slack and contact."""
    end = 200.0 if slow else 1.0
    return schedule(
        np.linspace(0.0, end, 201),
        lambda t: 25.0 + 60.0 * np.minimum(2.0 * t / end, 1.0),
        lambda t: np.where(t < 0.3 * end, 0.12, 0.16),
        lambda t: np.where((t > 0.6 * end) & (t < 0.8 * end), -0.2, 0.0),
    )


@each
def test_name_port_and_place(effect):
    assert CATALOGUE[effect.name] is effect_type(effect.name) is effect
    assert [other.name for other in CATALOGUE.values()].count(effect.name) == 1
    assert effect.name == effect.name.lower().replace(" ", "-").replace("_", "-")
    assert effect.port in PORTS
    assert isinstance(effect.dissipative, bool)
    file = inspect.getfile(effect).removesuffix(".py")
    assert file.endswith(effect.name.replace("-", "_"))


def test_the_twin_can_hide_every_effect_with_the_same_parameters():
    twins = {name: {field.name for field in fields(kind)} for name, kind in EFFECTS.items()}
    twins["second-relaxation"] |= {"unrested"}  # the twin simulates what comes before the first row
    # The twin's D is what friction slides at, and `breakaway` what it withstands above that at rest.
    twins["stribeck-friction"] = (twins["stribeck-friction"] - {"breakaway"}) | {"drop"}
    # The twin's damper follows powers of T, exactly; the model has the first two terms of any law.
    twins["damper-law"] = (twins["damper-law"] - {"shape"}) | {"curvature"}
    assert twins == {name: set(effect.parameters) for name, effect in CATALOGUE.items()}


def test_an_unknown_name_is_told_what_there_is():
    with pytest.raises(
        MuscleBayesError, match=r"'magic' is not in the catalogue. Fix: .*coil-contact"
    ):
        effect_type("magic")
    with pytest.raises(MuscleBayesError, match="Did you mean 'coil-contact'"):
        effect_type("coil-contct")


@each
def test_docstring_gives_equation_symbols_and_source(effect):
    equation, _, rest = inspect.getdoc(effect).partition("\n\n")
    assert "=" in equation or "->" in equation
    assert "Source:" in rest
    for name in effect.parameters:
        assert re.search(rf"`{name}`[^;.]*\[", rest), "a symbol with its unit"


@each
def test_parameters_have_unit_prior_and_an_off_inside_its_support(effect):
    assert set(effect.parameters) == {field.name for field in fields(effect)}
    for name, parameter in effect.parameters.items():
        assert parameter.unit
        assert parameter.meaning
        prior = parameter.prior(SIZE)
        inside = prior.support(parameter.off) | prior.support(parameter.off + 1e-9)
        assert bool(inside), f"{name}: off is neither in its support nor at its edge"
        drawn = prior.sample(jax.random.key(1), (DRAWS,))
        assert np.isfinite(prior.log_prob(drawn)).all(), name
        assert np.isfinite(prior.log_prob(parameter.off + 1e-9)), name


@each
def test_off_is_the_identity(effect):
    off = effect.off()
    if isinstance(off, CourseFilter):
        time = jnp.asarray([0.0, 0.7, 1.0, 2.5, 2.5, 2.5])
        course = jnp.asarray([25.0, 40.0, 41.0, 30.0, 30.0, 30.0])
        np.testing.assert_array_equal(off(time, course), course)
        return
    drawn = signals(3, 20)
    for index in range(20):
        seen = jax.tree.map(lambda one, index=index: one[index], drawn)
        if isinstance(off, MemoryEffect):
            seen = seen._replace(memory={effect.name: off.initial()})
            assert float(off.rate(seen)) == 0.0
        assert float(off(jnp.asarray(1.7), seen)) == 1.7
        assert float(off(jnp.asarray(-0.03), seen)) == -0.03


@pytest.mark.parametrize("motion", [release, creep])
def test_with_every_effect_off_the_plant_is_the_nominal_one(motion):
    driven, made = drive(motion is creep), muscle_plant()
    plain = motion(made, driven, -0.2, 0.04)
    for effect in CATALOGUE.values():
        made = made + jax.tree.map(jnp.asarray, effect.off())
    seen = motion(made, driven, -0.2, 0.04)
    assert np.ptp(plain.sensed) > 0.1
    for name in plain._fields:
        # The compiler may order sums differently: to rounding, not to the last bit.
        np.testing.assert_allclose(
            getattr(seen, name), getattr(plain, name), rtol=1e-11, atol=1e-13, err_msg=name
        )


@each
def test_value_and_gradient_are_finite_over_the_prior(effect):
    drawn = {f"{effect.name}.{key}": value for key, value in prior_draws(effect, 5).items()}
    slopes, both = responses_and_slopes(nominal() | drawn)
    assert all(np.asarray(seen.finite).all() for seen in both)
    for name, column in slopes.items():
        assert np.isfinite(column).all(), name
    for name in drawn:
        assert np.any(slopes[name]), f"{name} does nothing"


@each
def test_dissipative_effects_never_do_positive_work(effect):
    if not effect.dissipative:
        return
    assert effect.port in ("torque", "friction")
    seen = signals(7, DRAWS)
    value = jnp.asarray(np.random.default_rng(8).uniform(size=DRAWS))
    for index in range(DRAWS):
        made = effect(**{key: draw[index] for key, draw in prior_draws(effect, 6).items()})
        if effect.port == "torque":
            power = (made(value, seen) - value) * seen.speed
        else:  # what is left of dry friction, which may be less than without
            power = -made(value, seen) * jnp.abs(seen.speed)
        assert float(power.max()) <= 0.0
        assert float(power.min()) < 0.0


def test_a_plant_keeps_the_order_in_which_effects_were_added():
    class Twice(Effect):
        """Q -> 2 Q"""

        name, port, dissipative, parameters = "twice", "torque", False, {}

        def __call__(self, value, signals):
            return 2.0 * value

    bias, plain = CATALOGUE["bias-torque"](jnp.asarray(0.5)), muscle_plant()
    assert plain.effects == ()
    first, last = plain + bias + Twice(), plain + Twice() + bias
    assert [one.name for one in first.effects] == ["bias-torque", "twice"]
    assert [one.name for one in last.effects] == ["twice", "bias-torque"]
    drive_now = Drive(jnp.full(2, 25.0), jnp.asarray(0.1), jnp.asarray(0.0))
    at = jnp.asarray(0.0), jnp.asarray(0.0), jnp.full(2, 0.01), drive_now
    base = float(plain.force(*at))
    assert float(first.force(*at)) == pytest.approx(2.0 * (base + 0.5), rel=1e-14)
    assert float(last.force(*at)) == pytest.approx(2.0 * base + 0.5, rel=1e-14)
    assert eqx.tree_equal(eqx.tree_at(lambda p: p.effects, first, ()), plain)
