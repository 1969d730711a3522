"""Nothing turns to NaN unflagged: over wide draws, through padding, load jumps and stops."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from example_plants import (
    TABLE_2,
    D,
    creep,
    muscle,
    muscle_plant,
    plant,
    release,
    schedule,
    spring_plant,
)
from wide_draws import DRAWS, nominal, prior_draws, responses_and_slopes

from muscle_bayes.physics.effects import CATALOGUE
from muscle_bayes.physics.friction import CoulombFriction, LinearFriction
from muscle_bayes.physics.schedule import Schedule

SPREAD = 1.5


def wide(seed: int):
    """Parameters log-uniform over more than a decade, effects from their priors."""
    generator, sample = np.random.default_rng(seed), nominal()
    for key in (*TABLE_2, "J", "D"):
        factor = np.exp(generator.uniform(-SPREAD, SPREAD, DRAWS) * (key != "T_hyst_offset"))
        sample[key] = sample[key] * factor
    sample["hyst"] = jnp.asarray(generator.uniform(-0.05, 0.3, DRAWS))
    for name, effect in CATALOGUE.items():
        drawn = prior_draws(effect, seed)
        sample |= {f"{name}.{key}": value for key, value in drawn.items()}
    return sample


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_value_and_gradient_stay_finite_over_wide_draws(seed):
    slopes, both = responses_and_slopes(wide(seed))
    solved = np.all([np.asarray(seen.finite) for seen in both], axis=0)
    # With all effects at once one draw of seed 4 is beyond the solver, and says so.
    assert solved.sum() >= DRAWS - 1
    for name, column in slopes.items():
        assert np.isfinite(np.asarray(column)[solved]).all(), name
    for seen in both:
        assert np.isfinite(np.asarray(seen.speed)[solved]).all()
        assert np.isfinite(np.asarray(seen.hyst)[solved]).all()
    straight = {
        f"{name}.{key}": jnp.full(DRAWS, parameter.off)
        for name, effect in CATALOGUE.items()
        if effect.port == "reading"
        for key, parameter in effect.parameters.items()
    }
    for seen in responses_and_slopes(wide(seed) | straight)[1]:
        reached = np.abs(np.asarray(seen.sensed)[solved]).max()
        assert reached == 1.2, "the stops are reached and hold"


def padded(driven: Schedule, at: int, extra: int) -> Schedule:
    """Zero-length intervals at a node, with a load and a force that must not count."""

    def nodes(values):
        return jnp.concatenate(
            [values[:at], jnp.repeat(values[at : at + 1], extra, 0), values[at:]]
        )

    def intervals(values, filler):
        return jnp.concatenate([values[:at], jnp.full(extra, filler), values[at:]])

    return Schedule(
        nodes(driven.time),
        nodes(driven.temperature),
        intervals(driven.load, 0.4),
        intervals(driven.applied, -0.1),
    )


@pytest.mark.parametrize("friction", [CoulombFriction, LinearFriction])
@pytest.mark.parametrize("motion", [release, creep])
def test_intervals_of_no_length_leave_the_state_as_it_is(motion, friction):
    made = plant(muscle(), friction=friction(jnp.asarray(D)))
    driven = schedule(
        np.linspace(0.0, 2.0, 81), lambda t: 25.0 + 10.0 * t, lambda t: 0.05 + 0.1 * (t > 0.5)
    )
    plain = motion(made, padded(driven, 80, 5), -0.2, 0.04)
    seen = motion(made, padded(driven, 45, 5), -0.2, 0.04)
    kept = np.r_[0:45, 50:85]
    for name in ("hyst", "speed", "sensed"):
        np.testing.assert_array_equal(getattr(seen, name)[kept], getattr(plain, name)[:80], name)
    # Speed is the state's own in fast motion; the mean over the interval, none, in slow motion.
    still = seen.speed[44] if motion is release else 0.0
    np.testing.assert_array_equal(seen.speed[45:50], still)


@pytest.mark.parametrize("motion", [release, creep])
@pytest.mark.parametrize("what", ["dry", "K_modulus", "load"])
def test_a_response_that_is_not_finite_says_so(motion, what):
    driven = schedule(np.linspace(0.0, 1.0, 11), load=0.12)
    assert bool(motion(muscle_plant(), driven).finite)
    made = muscle_plant(**{} if what == "load" else {what: np.nan})
    if what == "load":
        driven = dataclasses.replace(driven, load=driven.load * np.nan)
    assert not bool(motion(made, driven).finite)


@pytest.mark.parametrize("motion", [release, creep])
def test_the_rotor_rests_at_a_stop_and_leaves_it_when_the_load_goes(motion):
    driven = schedule(np.linspace(0.0, 4.0, 401), load=lambda t: np.where(t < 2.0, 0.3, 0.1))
    seen = motion(spring_plant(stops=(-1.0, 0.3)), driven)
    at_stop = np.asarray(seen.sensed)[100:199]
    np.testing.assert_array_equal(at_stop, 0.3)
    np.testing.assert_array_equal(seen.speed[100:199], 0.0)
    assert seen.sensed[-1] < 0.1
    assert np.max(seen.sensed) == 0.3


def test_more_friction_than_force_holds_the_rotor_where_it_is():
    driven = schedule(np.linspace(0.0, 4.0, 41), load=0.12)
    for motion in (release, creep):
        np.testing.assert_array_equal(motion(spring_plant(dry=1.0), driven, 0.123).sensed, 0.123)
